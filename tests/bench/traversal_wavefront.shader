// The rays of 06_hello_traversal, and paths of light through its scene, cut into kernels with queues between them
// (wavefront). The paths also as one kernel: as stages of a ray-tracing pipeline and as a kernel with ray queries; for
// 06 those are the example's own. Both forms call the same functions for what happens where a ray has arrived.
// COHERENT=1: 06's rays; without, paths, that go on from matt surfaces, and end at lamps, in the sky and by roulette.
#include "../../examples/06_hello_traversal/main.shader"

#include <glint/constants.h>
#include <glint/random.h>

layout(set = 3, binding = 0) uniform Settings {
    uvec2 size;      // of the picture
    uint most_rays;  // of a path: closest hits that are looked for, one after the other
    uint roulette;
};

// Of an instance: columns of the matrix to its space, and its mesh. In all forms, so that pictures agree to the last
// bit but for what the driver's compiler does.
struct Place {
    vec4 to_object[3];
    uvec4 mesh;
};
layout(std430, set = 3, binding = 1) readonly buffer Places { Place places[]; };

const uint no_instance = 0xffffffffu;
const uint group_miss = 3u, group_count = 4u;  // hits have their mesh

struct Path {
    vec3 origin;
    float t_min;
    vec3 direction;
    uint left;  // rays that may still follow
    vec3 open;  // what arrives of the light that is found
    uint seed;
    vec3 light;
    uint padding;
};

struct Found {
    float t;
    uint primitive;
    uint instance;
    uint padding;
    vec2 barycentrics;
};

Path beginPath(uvec2 pixel) {
    return Path(camera.position.xyz, 0.0, cameraDirection(pixel, size), most_rays, vec3(1.0),
                glintHash(pixel.x, pixel.y), vec3(0.0), 0u);
}

float nextRandom(inout Path path) {
    path.seed = path.seed * 747796405u + 2891336453u;
    return glintUniform(glintHash(path.seed));
}

#if COHERENT

void shadeMiss(inout Path path) {
    if (path.left == most_rays) path.light = background;
    path.left = 0u;
}

#else

void shadeMiss(inout Path path) {
    path.light += path.open * mix(vec3(0.70, 0.76, 0.82), vec3(0.16, 0.27, 0.46), sqrt(max(path.direction.z, 0.0)));
    path.left = 0u;
}

#endif

void shadeHit(const uint mesh, inout Path path, const Found found) {
#if !COHERENT
    if (mesh == mesh_dodecahedron) {
        path.light += path.open * vec3(6.0, 5.0, 4.0);
        path.left = 0u;
        return;
    }
#endif
    const Place place = places[found.instance];
    const vec3 position = path.origin + path.direction * found.t;
    const vec3 normal =
        normalAt(mesh, found.primitive, found.barycentrics,
                 mat4x3(place.to_object[0].xyz, place.to_object[1].xyz, place.to_object[2].xyz, vec3(0.0)));
    path.left--;
#if COHERENT
    const vec3 color = lit(position, path.direction, normal, meshColor(mesh, position));
    path.light += path.left > 0u ? color : 0.5 * color;
    path.direction = reflect(path.direction, normal);
#else
    // Surfaces glow a little, so that every pixel shows where its path has been.
    path.open *= meshColor(mesh, position);
    path.light += 0.2 * path.open;
    if (roulette != 0u && path.left + 1u < most_rays) {
        const float goes_on = min(max(path.open.x, max(path.open.y, path.open.z)), 0.95);
        path.open /= goes_on;
        if (nextRandom(path) >= goes_on) path.left = 0u;
    }
    const float height = 1.0 - 2.0 * nextRandom(path), turn = GLINT_TWO_PI * nextRandom(path);
    const float radius = sqrt(max(1.0 - height * height, 0.0));
    const vec3 outside = dot(normal, path.direction) < 0.0 ? normal : -normal;
    path.direction = normalize(outside + 0.999 * vec3(radius * cos(turn), radius * sin(turn), height));
#endif
    path.origin = position;
    path.t_min = nearest;
}

void shade(const uint group, inout Path path, const Found found) {
    if (group == group_miss)
        shadeMiss(path);
    else
        shadeHit(group, path, found);
}

vec4 pictureColor(Path path) {
#if COHERENT
    return vec4(path.light, 1.0);
#else
    return vec4(sqrt(1.0 - exp(-path.light)), 1.0);
#endif
}

#if PATH_RAYGEN

layout(location = 0) rayPayloadEXT Path path;

void main() {
    path = beginPath(gl_LaunchIDEXT.xy);
    while (path.left > 0u)
        traceRayEXT(scene, gl_RayFlagsOpaqueEXT, 0xff, 0, 0, 0, path.origin, path.t_min, path.direction, farthest, 0);
    imageStore(picture, ivec2(gl_LaunchIDEXT.xy), pictureColor(path));
}

#elif PATH_MISS

layout(location = 0) rayPayloadInEXT Path path;

void main() { shadeMiss(path); }

#elif PATH_CLOSEST

layout(location = 0) rayPayloadInEXT Path path;
hitAttributeEXT vec2 barycentrics;

void main() {
    shadeHit(MESH, path, Found(gl_HitTEXT, uint(gl_PrimitiveID), uint(gl_InstanceID), 0u, barycentrics));
}

#endif

#if PATH_QUERY || REFILL || SEARCH

Found search(Path path) {
    rayQueryEXT query;
    rayQueryInitializeEXT(query, scene, gl_RayFlagsOpaqueEXT, 0xff, path.origin, path.t_min, path.direction, farthest);
    while (rayQueryProceedEXT(query)) {}
    if (rayQueryGetIntersectionTypeEXT(query, true) == gl_RayQueryCommittedIntersectionNoneEXT)
        return Found(farthest, 0u, no_instance, 0u, vec2(0.0));
    return Found(rayQueryGetIntersectionTEXT(query, true),
                 uint(rayQueryGetIntersectionPrimitiveIndexEXT(query, true)),
                 uint(rayQueryGetIntersectionInstanceIdEXT(query, true)), 0u,
                 rayQueryGetIntersectionBarycentricsEXT(query, true));
}

#endif

uint groupOf(const Found found) { return found.instance == no_instance ? group_miss : places[found.instance].mesh.x; }

#if PATH_QUERY

layout(local_size_x = 8, local_size_y = 8) in;

void main() {
    const uvec2 pixel = gl_GlobalInvocationID.xy;
    if (any(greaterThanEqual(pixel, size))) return;
    Path path = beginPath(pixel);
    while (path.left > 0u) {
        const Found found = search(path);
        shade(groupOf(found), path, found);
    }
    imageStore(picture, ivec2(pixel), pictureColor(path));
}

#elif REFILL || GENERATE || SEARCH || SHADOW || GROUPS || SHADE || COMPACT || PLAN || RESOLVE

layout(local_size_x = 64) in;

/// Paths are numbered by tiles of 8 x 4 pixels.
uvec2 pixelOf(uint path) {
    const uint tile = path / 32u, in_tile = path % 32u, row = size.x / 8u;
    return uvec2(tile % row * 8u + in_tile % 8u, tile / row * 4u + in_tile / 8u);
}

#if REFILL

// A thread goes on to its next path as soon as one ends: REFILL of them.
void main() {
    const uint capacity = size.x * size.y, first = gl_WorkGroupID.x * (64u * REFILL) + gl_LocalInvocationIndex;
    Path path;
    path.left = 0u;
    for (uint turn = 0u;;) {
        if (path.left == 0u) {
            if (turn > 0u) imageStore(picture, ivec2(pixelOf(first + 64u * (turn - 1u))), pictureColor(path));
            if (turn == REFILL || first + 64u * turn >= capacity) break;
            path = beginPath(pixelOf(first + 64u * turn));
            turn++;
        }
        const Found found = search(path);
        shade(groupOf(found), path, found);
    }
}

#else

// Queues hold the numbers of paths, which stay where they are.
layout(std430, set = 3, binding = 2) buffer Paths { Path paths[]; };
layout(std430, set = 3, binding = 3) buffer Hits { Found hits[]; };
// As many keys (groups) as there are pixels, then as many numbers of paths.
layout(std430, set = 3, binding = 4) buffer Queue { uint queue[]; };
layout(std430, set = 3, binding = 5) buffer Next { uint next[]; };
// 1 or 0 for each place of the queue; then their running sums.
layout(std430, set = 3, binding = 6) buffer Alive { uint alive[]; };
layout(std430, set = 3, binding = 7) buffer Plan {
    uvec3 queue_groups;
    uint queue_size;
    uvec4 sort_region;
    uvec4 scan_region;
    uvec4 shade_groups[group_count];  // w: the first place
    uint shade_sizes[group_count];
    uint searches;  // closest hits looked for so far
} plan;

void planQueue(uint count) {
    plan.queue_size = count;
    plan.queue_groups = uvec3((count + 63u) / 64u, 1u, 1u);
    plan.sort_region = uvec4(0u, size.x * size.y, count, 0u);
    plan.scan_region = uvec4(0u, count + 1u, 0u, 0u);
}

/// The first place of the queue whose key is not less.
uint placeOf(uint key) {
    uint first = 0u, last = plan.queue_size;
    while (first < last) {
        const uint middle = (first + last) / 2u;
        if (queue[middle] < key)
            first = middle + 1u;
        else
            last = middle;
    }
    return first;
}

void main() {
    const uint place = gl_GlobalInvocationID.x, capacity = size.x * size.y;
#if GENERATE
    if (place >= capacity) return;
    paths[place] = beginPath(pixelOf(place));
    queue[capacity + place] = place;
    if (place == 0u) {
        planQueue(capacity);
        plan.searches = capacity;
    }
#elif SEARCH
    if (place >= plan.queue_size) return;
    const uint path = queue[capacity + place];
    const Found found = search(paths[path]);
    hits[path] = found;
    if (place == 0u) alive[plan.queue_size] = 0u;
#if SORTED
    queue[place] = groupOf(found);
#endif
#elif SHADOW
    if (place >= plan.queue_size) return;
    const uint path = queue[capacity + place];
    const vec3 position = paths[path].origin;
    rayQueryEXT query;
    rayQueryInitializeEXT(query, scene, gl_RayFlagsOpaqueEXT | gl_RayFlagsTerminateOnFirstHitEXT, 0xff, position,
                          nearest, normalize(light.xyz - position), distance(light.xyz, position));
    while (rayQueryProceedEXT(query)) {}
    if (rayQueryGetIntersectionTypeEXT(query, true) != gl_RayQueryCommittedIntersectionNoneEXT)
        paths[path].light *= shaded;
#elif GROUPS
    if (place >= group_count) return;
    const uint first = placeOf(place), last = placeOf(place + 1u);
    plan.shade_groups[place] = uvec4((last - first + 63u) / 64u, 1u, 1u, first);
    plan.shade_sizes[place] = last - first;
#elif SHADE
#if SORTED
    if (place >= plan.shade_sizes[GROUP]) return;
    const uint at = plan.shade_groups[GROUP].w + place;
#else
    if (place >= plan.queue_size) return;
    const uint at = place;
#endif
    const uint number = queue[capacity + at];
    Path path = paths[number];
    const Found found = hits[number];
#if SORTED
    shade(GROUP, path, found);
#else
    shade(groupOf(found), path, found);
#endif
    paths[number] = path;
    alive[at] = path.left > 0u ? 1u : 0u;
#elif COMPACT
    if (place >= plan.queue_size) return;
    const uint to = alive[place];
    if (alive[place + 1u] != to) next[capacity + to] = queue[capacity + place];
#elif PLAN
    if (place > 0u) return;
    planQueue(alive[plan.queue_size]);
    plan.searches += plan.queue_size;
#elif RESOLVE
    if (place >= capacity) return;
    imageStore(picture, ivec2(pixelOf(place)), pictureColor(paths[place]));
#endif
}

#endif

#endif
