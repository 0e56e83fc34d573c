// Glass bodies that are given by planes: boxes, and an intersection shader that says where a ray meets what is in them.

#include "26_procedural/hull.h"

#include <algorithm>

using namespace glint;

namespace {

struct Settings {
    uint32_t bounces = 8;
    float index = 1.5f;
};

/// The first plane of a hull, and their count.
struct Range {
    uint32_t first, count;
};

}  // namespace

int main(int argc, char** argv) {
    Example example(EXAMPLE_NAME, "Traces glass bodies given by planes, with a mesh in one of them.");
    Course course(example, EXAMPLE_DIR "/main.shader");
    Settings settings;
    example.addKnob("--bounces", settings.bounces, 1, 32, "Surfaces of glass that a ray may go through");
    example.addKnob("--index", settings.index, 1.0f, 3.0f, "Index of refraction");
    if (!example.parse(argc, argv)) return example.exitCode();

    const auto load = [&](Traversal& traversal) {
        traversal.loadShaderGLSL(Shader::TypeRayGen, course.shader(), "RAYGEN_SHADER=1");
        traversal.loadShaderGLSL(Shader::TypeRayMiss, course.shader(), "MISS_SHADER=1");
        traversal.loadShaderGLSL(Shader::TypeClosest, course.shader(), "CLOSEST_SHADER=1");
        // The group of boxes.
        traversal.addHitGroup();
        traversal.loadShaderGLSL(Shader::TypeIntersection, course.shader(), "INTERSECTION_SHADER=1");
        traversal.loadShaderGLSL(Shader::TypeClosest, course.shader(), "GLASS_SHADER=1");
    };
    Buffer box_buffer, plane_buffer, range_buffer;
    Tracing glass;
    course.setArrange([&](Device& device, std::vector<Tracing::Instance>& instances) -> Status {
        std::vector<BoundBox> boxes;
        std::vector<Vector4f> planes;
        std::vector<Range> ranges;
        for (const Hull& hull : createHulls(course.stage())) {
            boxes.push_back(hull.box);
            ranges.push_back({static_cast<uint32_t>(planes.size()), static_cast<uint32_t>(hull.planes.size())});
            planes.insert(planes.end(), hull.planes.begin(), hull.planes.end());
        }
        box_buffer = device.createBuffer(Buffer::FlagTracing, std::span(boxes), "boxes");
        plane_buffer = device.createBuffer(Buffer::FlagStorage, std::span(planes), "planes");
        range_buffer = device.createBuffer(Buffer::FlagStorage, std::span(ranges), "ranges");
        glass = device.createTracing("glass");
        glass.addBoundBuffer(static_cast<uint32_t>(boxes.size()), sizeof(BoundBox), box_buffer);
        if (Status status = glass.create(Tracing::TypeBound); !status) return status;
        if (Status status = device.buildTracings({glass}); !status) return status;

        // The mesh at half its size, in the middle of its hull. Rays in glass look at front faces of triangles as well.
        Tracing::Instance& mesh = instances[CourseStage::object_mesh];
        const Transform3x4 half = floatingMesh(course.stage(), boxes[0].center());
        std::copy(half.rows.begin(), half.rows.end(), mesh.transform);
        for (Tracing::Instance& instance : instances) instance.flags = Tracing::InstanceCullDisable;
        // No part of shadows: its mask.
        instances.push_back({.tracing = &glass, .mask = 2, .offset = 1});
        return {};
    });
    return course.run(1, load, [&](Compute& compute) {
        compute.setUniform(1, settings);
        compute.setStorageBuffers(2, {plane_buffer, range_buffer});
    });
}
