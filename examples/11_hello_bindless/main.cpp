// Every texture of a scene in one table: a compute shader that traces rays reads whichever one a hit asks for.

#include "11_hello_bindless/hall.h"
#include "common/viewer.h"

#include <glint/math/camera.h>

#include <algorithm>
#include <array>
#include <cstdio>
#include <functional>
#include <map>

using namespace glint;

namespace {

constexpr uint32_t table_size = 2048;

// As main.shader has them.

struct Parameters {
    CameraParameters camera;
    Vector4f light = Vector4f(0.0f);
    float pixel_angle = 0.0f;
    uint32_t reflects = 1;
    Vector2f padding = {0, 0};
};

struct TextureUse {
    uint32_t texture = ~0u;
    float rotation = 0.0f;
    Vector2f offset = {0, 0};
    Vector2f scale = {1, 1};
};

struct alignas(16) Material {
    Vector4f base_color = {1, 1, 1, 1};  ///< of a mask, alpha is over the cutoff: 1 and more is seen
    TextureUse color_use, normal_use, surface_use;
    float metallic = 0.0f;
    float roughness = 1.0f;
    float normal_scale = 1.0f;
    uint32_t first_index = 0;
};
static_assert(sizeof(Material) == 112);

struct Vertex {
    Vector3f position;
    Vector3f normal = {0, 0, 0};
    Vector2f place = {0, 0};
};
static_assert(sizeof(Vertex) == 32);

/// The scene as the shader reads it: the triangles of a material one after the other, Z up.
struct Triangles {
    std::vector<Vertex> vertices;
    std::vector<std::vector<uint32_t>> indices;  ///< of each material
};

/// Y up to Z up.
Vector3f upright(const Vector3f& v) { return {v.x, -v.z, v.y}; }

Triangles gather(const Scene& scene) {
    Triangles result;
    result.indices.resize(scene.materials.size() + 1);  // the last one for what has none
    const ScenePose pose = scene.pose();
    const auto add = [&](const auto& self, uint32_t index) -> void {
        const SceneNode& node = scene.nodes[index];
        const Matrix4x4f& world = pose.world[index];
        const Matrix3x3f normals = glm::transpose(glm::inverse(Matrix3x3f(world)));
        if (node.mesh != scene_none)
            for (const ScenePrimitive& part : scene.meshes[node.mesh].primitives) {
                const auto first = static_cast<uint32_t>(result.vertices.size());
                for (size_t i = 0; i < part.positions.size(); i++) {
                    Vertex& vertex = result.vertices.emplace_back();
                    vertex.position = upright(transformPoint(world, part.positions[i]));
                    if (!part.normals.empty()) vertex.normal = upright(glm::normalize(normals * part.normals[i]));
                    if (!part.texcoords[0].empty()) vertex.place = part.texcoords[0][i];
                }
                const size_t material = std::min<size_t>(part.material, scene.materials.size());
                for (const uint32_t i : part.indices) result.indices[material].push_back(first + i);
            }
        for (const uint32_t child : node.children) self(self, child);
    };
    for (const uint32_t root : scene.roots) add(add, root);
    return result;
}

/// Textures, each image once for each way to read it: as sRGB colours, or as they are.
class Textures {
public:
    Textures(Device& device, const Scene& scene)
        : device_(device), scene_(scene), table_(device.createTextureTable(table_size, "textures")) {}

    TextureUse use(const SceneTextureUse& from, bool is_color) {
        if (from.texture == scene_none || scene_.textures[from.texture].image == scene_none) return {};
        const uint32_t image = scene_.textures[from.texture].image;
        const auto [known, is_new] = places_.try_emplace({image, is_color}, static_cast<uint32_t>(places_.size()));
        if (is_new) table_.set(known->second, upload(scene_.images[image], is_color));
        return {known->second, from.rotation, from.offset, from.scale};
    }
    const TextureTable& table() const { return table_; }
    size_t count() const { return places_.size(); }
    uint64_t bytes() const { return bytes_; }

private:
    Texture upload(const SceneImage& from, bool is_color) {
        const Expected<Image> image = from.image.convert(FormatRGBAu8n);
        if (!image) return {};
        const Format format = is_color ? FormatRGBAu8ns : FormatRGBAu8n;
        const Texture texture =
            device_.createTexture2D(format, image->width(), image->height(), Texture::FlagMipmaps, from.name);
        device_.setTexture(texture, image->bytes().data(), image->bytes().size());
        device_.createMipmaps(texture);
        for (uint32_t mip = 0; mip < texture.getMipmaps(); mip++) bytes_ += texture.getDataSize(mip);
        return texture;
    }

    Device& device_;
    const Scene& scene_;
    TextureTable table_;
    std::map<std::pair<uint32_t, bool>, uint32_t> places_;
    uint64_t bytes_ = 0;
};

/// Where the camera is in the hall, from one end to the other in half a minute.
Vector3f walk(double time) {
    const auto t = static_cast<float>(time);
    return {32.0f * std::sin(t), 1200.0f * std::sin(0.1f * t), 128.0f + 32.0f * std::cos(t)};
}

}  // namespace

int main(int argc, char** argv) {
    Example example(EXAMPLE_NAME, "Traces a scene whose textures are all in one table, with one reflection.");
    std::filesystem::path scene_path;
    bool is_primary = false;
    example.add("--scene", scene_path, "Scene to show (.gltf, .glb); a hall without it");
    example.addKnob("--primary", is_primary, "No reflections");
    if (!example.parse(argc, argv)) return example.exitCode();

    Expected<Scene> scene = scene_path.empty() ? Expected<Scene>(makeHall()) : Scene::load(scene_path);
    if (!scene) return report(scene.error());
    Device device = openDevice(example, FeatureComputeTracing | FeatureTextureTable);
    if (!device) return report(device.error());

    // Geometry, textures and materials.
    const Triangles triangles = gather(*scene);
    scene->materials.emplace_back();
    Textures textures(device, *scene);
    std::vector<Material> materials;
    std::vector<uint32_t> indices;
    // Masks come last: a structure of their own shows their hits to the shader, one by one.
    const auto is_mask = [&](size_t i) {
        const SceneMaterial& material = scene->materials[i];
        return material.alpha == SceneAlpha::Mask && material.alpha_cutoff > 0.0f;
    };
    std::vector<size_t> order;
    for (size_t i = 0; i < scene->materials.size(); i++)
        if (!triangles.indices[i].empty()) order.push_back(i);
    const auto first_mask =
        static_cast<uint32_t>(std::stable_partition(order.begin(), order.end(), std::not_fn(is_mask)) - order.begin());
    for (const size_t i : order) {
        const SceneMaterial& from = scene->materials[i];
        Material& material = materials.emplace_back();
        material.base_color = from.base_color;
        if (is_mask(i)) material.base_color.w /= from.alpha_cutoff;
        material.color_use = textures.use(from.base_color_texture, true);
        material.normal_use = textures.use(from.normal_texture, false);
        material.surface_use = textures.use(from.metallic_roughness_texture, false);
        material.metallic = from.metallic;
        material.roughness = from.roughness;
        material.normal_scale = from.normal_scale;
        material.first_index = static_cast<uint32_t>(indices.size());
        indices.insert(indices.end(), triangles.indices[i].begin(), triangles.indices[i].end());
    }
    const Buffer::Flags flags = Buffer::FlagStorage | Buffer::FlagTracing;
    const Buffer vertex_buffer = device.createBuffer(flags, std::span(triangles.vertices), "vertices");
    const Buffer index_buffer = device.createBuffer(flags, std::span(indices), "indices");
    const Buffer material_buffer = device.createBuffer(Buffer::FlagStorage, std::span(materials), "materials");
    const Sampler sampler =
        device.createSampler({.filter = Sampler::FilterTrilinear, .wrap = Sampler::WrapModeRepeat}, "trilinear");

    // A geometry for each material; an instance says the number of its first one.
    Tracing parts[2];
    std::vector<Tracing::Instance> instances;
    std::vector<Tracing> structures;
    const auto count = static_cast<uint32_t>(materials.size());
    for (const auto& [begin, end] : {std::pair(0u, first_mask), {first_mask, count}}) {
        if (begin == end) continue;
        Tracing& part = parts[instances.size()] = device.createTracing(begin < first_mask ? "model" : "masks");
        for (uint32_t i = begin; i < end; i++) {
            const uint32_t first = materials[i].first_index;
            const size_t last = i + 1 < count ? materials[i + 1].first_index : indices.size();
            part.addVertexBuffer(static_cast<uint32_t>(triangles.vertices.size()), FormatRGBf32, sizeof(Vertex),
                                 vertex_buffer);
            part.addIndexBuffer(static_cast<uint32_t>(last - first), FormatRu32, index_buffer,
                                first * sizeof(uint32_t));
        }
        Tracing::Flags form = Tracing::FlagCompact | Tracing::FlagFastTrace;
        if (begin == first_mask) form |= Tracing::FlagTransparent;
        if (Status status = part.create(Tracing::TypeTriangle, form); !status) return report(status.error());
        instances.push_back({.tracing = &part, .data = begin});
        structures.push_back(part);
    }
    const Tracing top = device.createTracing(instances);
    structures.push_back(top);
    if (Status status = device.buildTracings(structures, Buffer(), Tracing::FlagCompact); !status)
        return report(status.error());
    Kernel kernel = device.createKernel("trace");
    kernel.loadShaderGLSL(EXAMPLE_DIR "/main.shader", first_mask < count ? "ALPHA_TEST=1" : "");
    if (!kernel.create()) return report(kernel.error());

    // A file's scene is looked at from all around.
    Vector3f low(triangles.vertices[0].position), high = low;
    for (const Vertex& vertex : triangles.vertices) {
        low = glm::min(low, vertex.position);
        high = glm::max(high, vertex.position);
    }
    const Vector3f centre = (low + high) * 0.5f;
    const float radius = std::max(0.5f * glm::length(high - low), 1e-6f);
    const auto around = [&](double time) {
        return centre + transformPoint(rotateZ(8.0f * static_cast<float>(time)), Vector3f(1.6f, -1.2f, 0.9f)) * radius;
    };

    Parameters parameters;
    Viewer viewer(example, device);
    const Status status = viewer.run([&](Frame& frame) {
        const bool is_hall = scene_path.empty();
        const Vector3f from = is_hall ? walk(frame.time) : around(frame.time);
        // The light goes ahead, and in the hall the camera looks after it.
        const Vector3f light = is_hall ? walk(frame.time + 0.2) : around(frame.time + 4.0);
        const Vector3f to = is_hall ? light : centre;
        const Camera camera = Camera()
                                  .lookAt(frame.view.eye(from, to), to)
                                  .perspective(60.0f, frame.aspect(), is_hall ? 0.1f : radius * 1e-3f);
        parameters.camera = camera.parameters();
        parameters.light = Vector4f(light, is_hall ? 400.0f : 4.0f * radius);
        parameters.pixel_angle = glm::length(Vector3f(parameters.camera.ray_y)) / static_cast<float>(frame.height);
        parameters.reflects = is_primary ? 0u : 1u;

        Compute compute = device.createCompute();
        frame.timer.begin(compute, "trace");
        compute.setKernel(kernel);
        compute.setUniform(0, parameters);
        compute.setStorageBuffers(0, {vertex_buffer, index_buffer, material_buffer});
        compute.setSampler(0, sampler);
        compute.setTracing(0, top);
        compute.setTextureTable(0, textures.table());
        compute.setSurfaceTexture(0, frame.picture);
        compute.dispatch(frame.picture);
        frame.timer.end(compute);
        return device.submit(compute);
    });
    if (!status) return report(status.error());

    Statistics& statistics = example.statistics();
    statistics.counts = {{"triangles", indices.size() / 3},
                         {"materials", materials.size()},
                         {"textures", textures.count()},
                         {"texture_bytes", textures.bytes()},
                         {"masks", count - first_mask},
                         {"tracing_bytes", parts[0].getMemory() + parts[1].getMemory() + top.getMemory()}};
    statistics.setRays("trace", 1ull * statistics.width * statistics.height);  // of the camera, and as many reflections
    std::printf("%zu triangles, %zu materials, %zu textures of %.1f MB in one table; %.1f ms to trace them\n",
                indices.size() / 3, materials.size(), textures.count(), static_cast<double>(textures.bytes()) * 1e-6,
                statistics.median("trace") * 1e-6);
    return viewer.finish();
}
