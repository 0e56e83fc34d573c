// What the examples of the course share on the device; course.h is the other side. A shader is compiled with
// RAYGEN_SHADER, MISS_SHADER, CLOSEST_SHADER and so on for a ray-tracing pipeline, with QUERY_SHADER for the same
// picture by ray queries in a compute shader.

#include <glint/ray.h>
#include <glint/shading.h>

struct Camera {
    mat4 view, inverse_view, projection;
    vec4 position, ray_corner, ray_x, ray_y;
};

layout(set = 0, binding = 0) uniform CourseFrame {
    Camera camera;
    vec4 light;  // where it is; what it sends out, as what arrives 1 unit away
};

// A position and a normal each.
layout(std430, set = 0, binding = 1) readonly buffer Vertices { float vertices[]; };
layout(std430, set = 0, binding = 2) readonly buffer Indices { uint indices[]; };

layout(set = 0, binding = 3) uniform accelerationStructureEXT scene;

layout(set = 0, binding = 4, rgba8) uniform writeonly image2D picture;

const uint object_mesh = 0u, object_floor = 1u;
const float far = 1000.0;

vec3 vertexPosition(uint vertex) {
    return vec3(vertices[vertex * 6u], vertices[vertex * 6u + 1u], vertices[vertex * 6u + 2u]);
}
vec3 vertexNormal(uint vertex) {
    return vec3(vertices[vertex * 6u + 3u], vertices[vertex * 6u + 4u], vertices[vertex * 6u + 5u]);
}

// ------------------------------------------------------------------------------------------------ what a ray has hit

struct Surface {
    GlintSurfacePoint point;  // where, with the triangle's own normal
    vec3 normal;              // interpolated from the corners. Both normals are on the side of the ray's origin
    uint object;
};

/// The instances' custom index is the first triangle of the object in the index buffer.
Surface surfaceAt(uint object, uint first_triangle, uint primitive, vec2 barycentrics, mat4x3 to_world,
                  mat4x3 to_object, vec3 direction) {
    const uint corner = (first_triangle + primitive) * 3u;
    const uint a = indices[corner], b = indices[corner + 1u], c = indices[corner + 2u];
    Surface surface;
    surface.point =
        glintSurfacePoint(vertexPosition(a), vertexPosition(b), vertexPosition(c), barycentrics, to_world, to_object);
    surface.point.normal = glintFaceRay(surface.point.normal, direction);
    const vec3 normal = glintInterpolate(vertexNormal(a), vertexNormal(b), vertexNormal(c), barycentrics);
    surface.normal = glintFaceRay(glintTransformNormal(to_world, normal), -surface.point.normal);
    surface.object = object;
    return surface;
}

// ---------------------------------------------------------------------------------------------------------- its light

vec3 sky(vec3 direction) { return mix(vec3(0.70, 0.76, 0.82), vec3(0.16, 0.27, 0.46), sqrt(max(direction.z, 0.0))); }

/// A floor of checkers, and a mesh of one colour.
vec3 surfaceColor(Surface surface) {
    if (surface.object == object_mesh) return vec3(0.80, 0.42, 0.22);
    const vec2 cell = floor(surface.point.position.xy);
    return mod(cell.x + cell.y, 2.0) < 0.5 ? vec3(0.62) : vec3(0.30);
}

/// Where the light is, and what arrives of it across its way.
vec3 toLight(Surface surface, out float arriving) {
    const vec3 way = light.xyz - surface.point.position;
    arriving = light.w / dot(way, way);
    return normalize(way);
}

const float ambient = 0.12;

/// Phong's model: what the surroundings send, and what the lamp does if nothing is in the way. `visible` is 0 or 1.
vec3 phong(Surface surface, vec3 color, vec3 direction, float visible, float specular, float shininess) {
    float arriving;
    const vec3 to_light = toLight(surface, arriving);
    const float diffuse = glintDiffuse(surface.normal, to_light);
    const float highlight =
        diffuse > 0.0 ? specular * glintPhong(surface.normal, to_light, direction, shininess) : 0.0;
    return color * ambient + (color * diffuse + highlight) * (arriving * visible);
}
vec3 phong(Surface surface, vec3 direction, float visible, float specular, float shininess) {
    return phong(surface, surfaceColor(surface), direction, visible, specular, shininess);
}

/// False where no light can arrive, whatever is in the way: the triangle, or its interpolated normal, is turned away.
bool facesLight(Surface surface) {
    const vec3 way = light.xyz - surface.point.position;
    return dot(surface.point.normal, way) > 0.0 && dot(surface.normal, way) > 0.0;
}

// ------------------------------------------------------------------------------------------- the two kinds of program

#if QUERY_SHADER
layout(local_size_x = 8, local_size_y = 8) in;
#define PIXEL gl_GlobalInvocationID.xy
#else
#define PIXEL gl_LaunchIDEXT.xy
#endif

#if QUERY_SHADER || RAYGEN_SHADER

vec3 cameraDirection() {
    const vec2 place = (vec2(PIXEL) + 0.5) / vec2(imageSize(picture));
    return normalize(camera.ray_corner.xyz + camera.ray_x.xyz * place.x + camera.ray_y.xyz * place.y);
}

/// Values as they are to be stored.
void storePixel(vec3 color) { imageStore(picture, ivec2(PIXEL), vec4(color, 1.0)); }

#endif

#if QUERY_SHADER

/// Whole groups of threads are started.
bool isOutside() { return any(greaterThanEqual(PIXEL, uvec2(imageSize(picture)))); }

/// What a query has found; false if it has found no triangle.
bool committedSurface(rayQueryEXT query, vec3 direction, out Surface surface) {
    if (rayQueryGetIntersectionTypeEXT(query, true) != gl_RayQueryCommittedIntersectionTriangleEXT) return false;
    surface = surfaceAt(uint(rayQueryGetIntersectionInstanceIdEXT(query, true)),
                        uint(rayQueryGetIntersectionInstanceCustomIndexEXT(query, true)),
                        uint(rayQueryGetIntersectionPrimitiveIndexEXT(query, true)),
                        rayQueryGetIntersectionBarycentricsEXT(query, true),
                        rayQueryGetIntersectionObjectToWorldEXT(query, true),
                        rayQueryGetIntersectionWorldToObjectEXT(query, true), direction);
    return true;
}

/// False if the ray meets nothing.
bool closestSurface(vec3 origin, vec3 direction, out Surface surface) {
    rayQueryEXT query;
    rayQueryInitializeEXT(query, scene, gl_RayFlagsOpaqueEXT, 0xff, origin, 0.0, direction, far);
    while (rayQueryProceedEXT(query)) {}
    return committedSurface(query, direction, surface);
}

/// 1 where the lamp is seen from, else 0: any hit on the way there is enough.
float visibility(Surface surface) {
    if (!facesLight(surface)) return 0.0;
    vec3 origin, way;
    glintSegment(surface.point, glintFreePoint(light.xyz), origin, way);
    rayQueryEXT query;
    rayQueryInitializeEXT(query, scene, gl_RayFlagsOpaqueEXT | gl_RayFlagsTerminateOnFirstHitEXT, 0xff, origin, 0.0,
                          way, GLINT_SEGMENT_END);
    while (rayQueryProceedEXT(query)) {}
    return rayQueryGetIntersectionTypeEXT(query, true) == gl_RayQueryCommittedIntersectionNoneEXT ? 1.0 : 0.0;
}

#elif CLOSEST_SHADER

hitAttributeEXT vec2 hit_barycentrics;

/// What the ray of this closest-hit shader has hit.
Surface hitSurface() {
    return surfaceAt(gl_InstanceID, gl_InstanceCustomIndexEXT, gl_PrimitiveID, hit_barycentrics, gl_ObjectToWorldEXT,
                     gl_WorldToObjectEXT, gl_WorldRayDirectionEXT);
}

#endif
