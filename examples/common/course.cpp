#include "common/course.h"

#include <glint/geometry/primitives.h>
#include <glint/geometry/triangle_order.h>

#include <algorithm>
#include <cstdio>

using namespace glint;

namespace {

constexpr uint32_t stride = 24;  // of a vertex: a position and a normal

struct FrameParameters {
    CameraParameters camera;
    Vector4f light;
};

}  // namespace

Expected<CourseStage> CourseStage::load(const std::filesystem::path& path) {
    Expected<Mesh> mesh = path.empty() ? createTorus(1.0f, 0.42f, 64, 32) : Mesh::load(path);
    if (!mesh) return unexpected(mesh.error());
    // One geometry, so that primitives count over the whole mesh.
    mesh->parts.clear();
    sortTriangles(*mesh);
    if (mesh->normals.empty()) mesh->createNormals();

    CourseStage stage;
    const BoundBox box = mesh->bounds();
    const Vector3f size = box.size(), center = box.center();
    const float factor = mesh_size / std::max({size.x, size.y, size.z, 1e-30f});
    const Matrix4x4f pose = translate({0.0f, 0.0f, lift}) * rotateZ(90.0f) * rotateX(90.0f) * scale(Vector3f(factor)) *
                            translate(-Vector3f(center.x, center.y - 0.5f * size.y, center.z));
    stage.meshes_ = {std::move(*mesh), createPlane(floor_size)};
    stage.transforms_ = {Transform3x4(pose), Transform3x4()};
    return stage;
}

Camera CourseStage::camera(float time, float aspect) {
    const Vector3f from = transformPoint(rotateZ(20.0f * time), {5.4f, -2.0f, 3.1f});
    return Camera().lookAt(from, target()).perspective(40.0f, aspect);
}

CourseBuffers::CourseBuffers(Device& device, const CourseStage& stage, const Arrange& arrange) {
    std::vector<Vector3f> vertices;
    std::vector<uint32_t> indices;
    std::vector<Tracing::Instance> instances(CourseStage::object_count);
    for (uint32_t i = 0; i < instances.size(); i++) {
        const Mesh& mesh = stage.mesh(i);
        const auto first_vertex = static_cast<uint32_t>(vertices.size() / 2);
        instances[i].data = static_cast<uint32_t>(indices.size() / 3);
        for (size_t k = 0; k < mesh.positions.size(); k++)
            vertices.insert(vertices.end(), {mesh.positions[k], mesh.normals[k]});
        for (const uint32_t index : mesh.indices) indices.push_back(first_vertex + index);
        const Transform3x4& transform = stage.transform(i);
        std::copy(transform.rows.begin(), transform.rows.end(), instances[i].transform);
    }
    triangles_ = indices.size() / 3;
    vertices_ = vertices.size() / 2;
    vertex_buffer_ = device.createBuffer(Buffer::FlagStorage | Buffer::FlagTracing, std::span(vertices), "vertices");
    index_buffer_ = device.createBuffer(Buffer::FlagStorage | Buffer::FlagTracing, std::span(indices), "indices");

    for (uint32_t i = 0; i < instances.size(); i++) {
        Tracing& object = objects_.emplace_back(device.createTracing(i == CourseStage::object_mesh ? "mesh" : "floor"));
        object.addVertexBuffer(static_cast<uint32_t>(vertices_), FormatRGBf32, stride, vertex_buffer_);
        object.addIndexBuffer(static_cast<uint32_t>(stage.mesh(i).indices.size()), FormatRu32, index_buffer_,
                              uint64_t{instances[i].data} * 3 * sizeof(uint32_t));
        (void)object.create(Tracing::TypeTriangle, Tracing::FlagFastTrace);  // carried by the handle
    }
    for (uint32_t i = 0; i < instances.size(); i++) instances[i].tracing = &objects_[i];
    if (arrange) {
        if (Status status = arrange(device, instances); !status) {
            error_ = status.error();
            return;
        }
    }
    scene_ = device.createTracing(instances, Tracing::FlagFastTrace, "scene");
    if (Status status = device.buildTracings({objects_[0], objects_[1], scene_}); !status) error_ = status.error();
}

void CourseBuffers::bind(Compute& compute, const Camera& camera, const Texture& picture) const {
    compute.setUniform(0, FrameParameters{camera.parameters(), CourseStage::light()});
    compute.setStorageBuffers(0, {vertex_buffer_, index_buffer_});
    compute.setTracing(0, scene_);
    compute.setSurfaceTexture(0, picture);
}

uint64_t CourseBuffers::tracingMemory() const {
    uint64_t bytes = scene_.getMemory();
    for (const Tracing& object : objects_) bytes += object.getMemory();
    return bytes;
}

Course::Course(Example& example, std::string shader) : example_(example), shader_(std::move(shader)) {
    example_.add("--mesh", mesh_, "Mesh to show (.obj, .ply, .gltf, .glb); a torus without it");
    example_.add("--query", use_query_, "Trace by ray queries in a compute shader instead of a ray-tracing pipeline");
}

int Course::run(uint32_t recursion, const std::function<void(Traversal&)>& load,
                const std::function<void(Compute&)>& bind) {
    Expected<CourseStage> stage = CourseStage::load(mesh_);
    if (!stage) return report(stage.error());
    stage_ = std::move(*stage);
    // A driver's pipelines need none of its ray queries.
    Device device = openDevice(example_, use_query_ ? FeatureComputeTracing : FeatureNone);
    if (!device) return report(device.error());
    use_query_ = use_query_ || needsQueries(example_, device, recursion);

    Kernel kernel;
    Traversal traversal;
    if (use_query_) {
        kernel = device.createKernel("trace");
        kernel.loadShaderGLSL(shader_, "QUERY_SHADER=1");
        if (!kernel.create()) return report(kernel.error());
    } else {
        traversal = device.createTraversal("trace");
        load(traversal);
        traversal.setRecursionDepth(recursion);
        if (!traversal.create()) return report(traversal.error());
    }
    const CourseBuffers buffers(device, stage_, arrange_);
    if (buffers.error()) return report(buffers.error());

    Viewer viewer(example_, device);
    const Status status = viewer.run([&](Frame& frame) {
        Camera camera = CourseStage::camera(static_cast<float>(frame.time), frame.aspect());
        camera.lookAt(frame.view.eye(camera.position(), CourseStage::target()), CourseStage::target());
        Compute compute = device.createCompute();
        frame.timer.begin(compute, "trace");
        if (use_query_)
            compute.setKernel(kernel);
        else
            compute.setTraversal(traversal);
        buffers.bind(compute, camera, frame.picture);
        if (bind) bind(compute);
        compute.dispatch(frame.picture);
        frame.timer.end(compute);
        return device.submit(compute);
    });
    if (!status) return report(status.error());

    Statistics& statistics = example_.statistics();
    statistics.counts = {{"triangles", buffers.triangles()},
                         {"vertices", buffers.vertices()},
                         {"tracing_bytes", buffers.tracingMemory()}};
    // Of the camera; what follows from them depends on the picture.
    statistics.setRays("trace", 1ull * statistics.width * statistics.height);
    std::printf("%llu triangles; %.1f ms to trace them %s\n", static_cast<unsigned long long>(buffers.triangles()),
                statistics.median("trace") * 1e-6, use_query_ ? "by ray queries" : "through a pipeline");
    return viewer.finish();
}
