#include "08_hello_dynamic/models.h"

#include <glint/geometry/primitives.h>
#include <glint/geometry/triangle_order.h>

#include <algorithm>
#include <cmath>

using namespace glint;

namespace {

constexpr double speed = 0.5;  // radians a second: there and back in 12.6 s

struct Parameters {
    uint32_t vertices;
    uint32_t grid;
    float ring;
    float amount, time;
};

/// The first error of some objects.
template <class... Objects>
Error firstError(const Objects&... objects) {
    Error error;
    ((error = error ? error : objects.error()), ...);
    return error;
}

}  // namespace

float Models::amount(double time) { return strongest * static_cast<float>(0.5 - 0.5 * std::cos(speed * time)); }

double Models::timeOf(float amount) { return std::acos(std::clamp(1.0 - 2.0 * amount / strongest, -1.0, 1.0)) / speed; }

Models::Models(Device& device) {
    Mesh mesh = createTorus(ring, tube, 72, 36);
    sortTriangles(mesh);  // lavapipe traces triangles that are near in space and in memory many times faster
    vertices_ = static_cast<uint32_t>(mesh.positions.size());
    triangles_ = static_cast<uint32_t>(mesh.triangleCount());
    std::vector<Vector3f> rest;
    for (size_t i = 0; i < mesh.positions.size(); i++) rest.insert(rest.end(), {mesh.positions[i], mesh.normals[i]});
    rest_ = device.createBuffer(Buffer::FlagStorage, std::span(rest), "at rest");
    deformed_ = device.createBuffer(Buffer::FlagStorage | Buffer::FlagTracing, uint64_t{count} * vertices_ * stride,
                                    "deformed");
    indices_ = device.createBuffer(Buffer::FlagStorage | Buffer::FlagTracing, std::span(mesh.indices), "indices");
    kernel_ = device.createKernel("deform");
    kernel_.loadShaderGLSL(EXAMPLE_DIR "/main.shader", "DEFORM_SHADER=1");
    (void)kernel_.create();  // carried by the handle
    error_ = firstError(rest_, deformed_, indices_, kernel_);
}

void Models::deform(Compute& compute, float amount, float time) const {
    compute.setKernel(kernel_);
    compute.setUniform(0, Parameters{vertices_, grid, ring, amount, time});
    compute.setStorageBuffers(0, {rest_, deformed_});
    compute.dispatch(vertices_, count);
}

std::vector<Tracing::Instance> Models::instances(float time) {
    std::vector<Tracing::Instance> instances(count);
    for (uint32_t i = 0; i < count; i++) {
        const Vector3f place((static_cast<float>(i % grid) - 0.5f * (grid - 1)) * pitch,
                             (static_cast<float>(i / grid) - 0.5f * (grid - 1)) * pitch, 0.0f);
        const float turn = 20.0f * time + 15.0f * static_cast<float>(i % grid + i / grid);
        const Transform3x4 transform(translate(place) * rotateZ(turn) * rotateX(35.0f));
        std::copy(transform.rows.begin(), transform.rows.end(), instances[i].transform);
        instances[i].data = i;
    }
    return instances;
}

Camera Models::camera(float time, float aspect) {
    const Vector3f from = transformPoint(rotateZ(2.0f * time), {8.0f, -31.0f, 18.0f});
    return Camera().lookAt(from, target()).perspective(41.0f, aspect);
}

Structures::Structures(Device& device, const Models& models, Tracing::Flags flags) {
    const auto addScratch = [&](const Tracing& tracing) {
        const uint64_t size = std::max(tracing.getBuildSize(), tracing.getUpdateSize());
        Buffer scratch = device.createBuffer(Buffer::FlagScratch, size, "scratch");
        error_ = firstError(*this, tracing, scratch);
        return scratch;
    };
    for (uint32_t i = 0; i < Models::count && !error_; i++) {
        Tracing& tracing = tracings_.emplace_back(device.createTracing("model"));
        tracing.addVertexBuffer(models.vertices(), FormatRGBf32, Models::stride, models.vertexBuffer(),
                                uint64_t{i} * models.vertices() * Models::stride);
        tracing.addIndexBuffer(3 * models.triangles(), FormatRu32, models.indexBuffer());
        (void)tracing.create(Tracing::TypeTriangle, flags | Tracing::FlagUpdate);  // carried by the handle
        scratch_.push_back(addScratch(tracing));
    }
    if (error_) return;
    std::vector<Tracing::Instance> instances = Models::instances(0.0f);
    for (uint32_t i = 0; i < Models::count; i++) instances[i].tracing = &tracings_[i];
    scene_ = device.createTracing(instances, Tracing::FlagFastBuild, "scene");
    scene_scratch_ = addScratch(scene_);
}

void Structures::build(Compute& compute, bool refit) const {
    for (size_t i = 0; i < tracings_.size(); i++) {
        if (refit)
            compute.updateTracing(tracings_[i], scratch_[i]);
        else
            compute.buildTracing(tracings_[i], scratch_[i]);
    }
}

Status Structures::build(Device& device, bool refit) const {
    if (!refit) return device.buildTracings(tracings_, Buffer());
    for (size_t i = 0; i < tracings_.size(); i++) device.updateTracing(tracings_[i], scratch_[i]);
    return {};
}

void Structures::buildScene(Compute& compute, std::vector<Tracing::Instance> instances) const {
    for (size_t i = 0; i < instances.size(); i++) instances[i].tracing = &tracings_[i];
    compute.setInstances(scene_, instances);
    compute.buildTracing(scene_, scene_scratch_);
}

uint64_t Structures::memory() const {
    uint64_t bytes = scene_.getMemory();
    for (const Tracing& tracing : tracings_) bytes += tracing.getMemory();
    return bytes;
}

uint64_t Structures::scratchMemory() const {
    uint64_t bytes = scene_scratch_.getSize();
    for (const Buffer& scratch : scratch_) bytes += scratch.getSize();
    return bytes;
}
