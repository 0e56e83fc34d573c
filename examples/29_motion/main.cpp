// Motion blur, and a rolling shutter: the scene is brought to one moment after the other, and every one is traced.

#include "29_motion/motion.h"

#include <algorithm>
#include <cstdio>

using namespace glint;

namespace {

struct FrameParameters {
    CameraParameters camera;
    Vector4f light;
};

struct Settings {
    uint32_t slice = 0, slices = 1;
    float rolling = 0.0f;
    uint32_t is_matte = 0;
};

struct MorphSettings {
    uint32_t vertices = 0, first = 0;  ///< of the corners that are written
    float weight = 0.0f;
    uint32_t padding = 0;
};

/// Mesh, floor, and the mesh once more, whose corners move.
class MovingScene {
public:
    MovingScene(Device& device, const CourseStage& stage) : stage_(stage) {
        const Mesh& mesh = stage.mesh(CourseStage::object_mesh);
        const Mesh& floor = stage.mesh(CourseStage::object_floor);
        const Mesh target = Motion::target(mesh);
        for (const Mesh* each : {&mesh, &floor, &mesh}) add(*each);
        std::vector<Vector3f> target_vertices;
        for (size_t i = 0; i < target.positions.size(); i++)
            target_vertices.insert(target_vertices.end(), {target.positions[i], target.normals[i]});

        const Buffer::Flags flags = Buffer::FlagStorage | Buffer::FlagTracing;
        vertex_buffer_ = device.createBuffer(flags, std::span(vertices_), "vertices");
        index_buffer_ = device.createBuffer(flags, std::span(indices_), "indices");
        target_buffer_ = device.createBuffer(Buffer::FlagStorage, std::span(target_vertices), "target");
        for (uint32_t i = 0; i < objects_.size(); i++) {
            objects_[i] = device.createTracing(i == 0 ? "mesh" : i == 1 ? "floor" : "morph");
            objects_[i].addVertexBuffer(static_cast<uint32_t>(vertices_.size() / 2), FormatRGBf32, 24, vertex_buffer_);
            objects_[i].addIndexBuffer(3 * (first_triangles_[i + 1] - first_triangles_[i]), FormatRu32, index_buffer_,
                                       uint64_t{first_triangles_[i]} * 12);
            (void)objects_[i].create(Tracing::TypeTriangle, i == 2 ? Tracing::FlagUpdate | Tracing::FlagFastTrace
                                                                   : Tracing::Flags{Tracing::FlagFastTrace});
        }
        scene_ = device.createTracing(instancesAt(Motion(stage, 0.0, 0.0), 0.0f), Tracing::FlagFastBuild, "scene");
        if (Status status = device.buildTracings({objects_[0], objects_[1], objects_[2], scene_}); !status)
            error_ = status.error();
    }

    const Error& error() const { return error_; }
    const Buffer& vertexBuffer() const { return vertex_buffer_; }
    const Buffer& indexBuffer() const { return index_buffer_; }
    const Tracing& scene() const { return scene_; }
    uint64_t triangles() const { return indices_.size() / 3; }

    /// Brings everything to a moment: instances, and the third body's corners, to which its structure is refitted.
    void moveTo(Compute& compute, const Kernel& morph, const Motion& motion, float moment) const {
        const auto corners = static_cast<uint32_t>(stage_.mesh(CourseStage::object_mesh).positions.size());
        compute.setKernel(morph);
        compute.setUniform(
            0, MorphSettings{corners, static_cast<uint32_t>(vertices_.size() / 2) - corners, motion.weight(moment)});
        compute.setStorageBuffers(0, {target_buffer_, vertex_buffer_});
        compute.dispatch(corners);
        compute.updateTracing(objects_[2]);
        compute.setInstances(scene_, instancesAt(motion, moment));
        compute.buildTracing(scene_);
    }

private:
    void add(const Mesh& mesh) {
        const auto first = static_cast<uint32_t>(vertices_.size() / 2);
        for (size_t i = 0; i < mesh.positions.size(); i++)
            vertices_.insert(vertices_.end(), {mesh.positions[i], mesh.normals[i]});
        for (const uint32_t index : mesh.indices) indices_.push_back(first + index);
        first_triangles_.push_back(static_cast<uint32_t>(indices_.size() / 3));
    }

    std::vector<Tracing::Instance> instancesAt(const Motion& motion, float moment) const {
        // The floor is instance 1, as everywhere in the course.
        const std::array<std::pair<uint32_t, Transform3x4>, 4> all = {
            {{0, motion.transform(Motion::MatrixKeys, moment)},
             {1, stage_.transform(CourseStage::object_floor)},
             {0, motion.transform(Motion::TransformKeys, moment)},
             {2, motion.transform(Motion::Morph, moment)}}};
        std::vector<Tracing::Instance> instances;
        for (const auto& [object, transform] : all) {
            Tracing::Instance& instance = instances.emplace_back();
            std::copy(transform.rows.begin(), transform.rows.end(), instance.transform);
            instance.tracing = &objects_[object];
            instance.data = first_triangles_[object];
        }
        return instances;
    }

    const CourseStage& stage_;
    Error error_;
    std::vector<Vector3f> vertices_;  ///< a position and a normal each
    std::vector<uint32_t> indices_;
    std::vector<uint32_t> first_triangles_ = {0};
    Buffer vertex_buffer_, index_buffer_, target_buffer_;
    std::array<Tracing, 3> objects_;
    Tracing scene_;
};

}  // namespace

int main(int argc, char** argv) {
    Example example(EXAMPLE_NAME, "Traces bodies that move and change their shape while the shutter is open.");
    std::filesystem::path mesh_path;
    bool use_query = false, is_matte = false;
    uint32_t slices = 32;
    float shutter = 0.5f, rolling = 0.0f;
    example.add("--mesh", mesh_path, "Mesh to show (.obj, .ply, .gltf, .glb); a torus without it");
    example.add("--query", use_query, "Trace by ray queries in a compute shader instead of a ray-tracing pipeline");
    example.add("--matte", is_matte, "Show for which share of the exposure each pixel sees a body");
    example.addKnob("--slices", slices, 1, 512, "Moments that are traced");
    example.addKnob("--shutter", shutter, 0.0f, 4.0f, "Seconds from the first moment to the last");
    example.addKnob("--rolling", rolling, 0.0f, 0.99f,
                    "How much later the bottom row is exposed than the top one, as a share of the shutter's time");
    if (!example.parse(argc, argv)) return example.exitCode();

    const Expected<CourseStage> stage = CourseStage::load(mesh_path);
    if (!stage) return report(stage.error());
    Device device = openDevice(example, use_query ? FeatureComputeTracing : FeatureNone);
    if (!device) return report(device.error());
    use_query = use_query || needsQueries(example, device, 1);
    const char* shader = EXAMPLE_DIR "/main.shader";
    Kernel morph = device.createKernel("morph"), kernel;
    morph.loadShaderGLSL(shader, "MORPH_SHADER=1");
    if (!morph.create()) return report(morph.error());
    Traversal traversal;
    if (use_query) {
        kernel = device.createKernel("trace");
        kernel.loadShaderGLSL(shader, "QUERY_SHADER=1");
        if (!kernel.create()) return report(kernel.error());
    } else {
        traversal = device.createTraversal("trace");
        traversal.loadShaderGLSL(Shader::TypeRayGen, shader, "RAYGEN_SHADER=1");
        traversal.loadShaderGLSL(Shader::TypeRayMiss, shader, "MISS_SHADER=1");
        traversal.loadShaderGLSL(Shader::TypeClosest, shader, "CLOSEST_SHADER=1");
        if (!traversal.create()) return report(traversal.error());
    }
    const MovingScene scene(device, *stage);
    if (scene.error()) return report(scene.error());

    Texture sums;
    Viewer viewer(example, device);
    const Status status = viewer.run([&](Frame& frame) -> Status {
        if (frame.is_resized)
            sums = device.createTexture2D(FormatRGBAf32, frame.width, frame.height, Texture::FlagSurface, "sums");
        if (!sums) return sums.error();
        Camera camera = CourseStage::camera(0.0f, frame.aspect());
        camera.lookAt(frame.view.eye(camera.position(), CourseStage::target()), CourseStage::target());
        const Motion motion(*stage, frame.time, frame.time + shutter);
        Compute compute = device.createCompute();
        frame.timer.begin(compute, "slices");
        for (uint32_t i = 0; i < slices; i++) {
            scene.moveTo(compute, morph, motion, (static_cast<float>(i) + 0.5f) / static_cast<float>(slices));
            if (use_query)
                compute.setKernel(kernel);
            else
                compute.setTraversal(traversal);
            compute.setUniform(0, FrameParameters{camera.parameters(), CourseStage::light()});
            compute.setUniform(1, Settings{i, slices, rolling, is_matte});
            compute.setStorageBuffers(0, {scene.vertexBuffer(), scene.indexBuffer()});
            compute.setTracing(0, scene.scene());
            compute.setSurfaceTextures(0, {frame.picture, sums});
            compute.dispatch(frame.picture);
        }
        frame.timer.end(compute);
        return device.submit(compute);
    });
    if (!status) return report(status.error());

    Statistics& statistics = example.statistics();
    statistics.counts = {{"triangles", scene.triangles()}, {"slices", slices}};
    statistics.setRays("slices", 1ull * statistics.width * statistics.height * slices);
    std::printf("%u slices; %.1f ms to move and trace them %s\n", slices, statistics.median("slices") * 1e-6,
                use_query ? "by ray queries" : "through a pipeline");
    return viewer.finish();
}
