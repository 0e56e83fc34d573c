#pragma once

// What the examples of the ray-tracing course (20 and up) share: a mesh on a
// floor, a camera and a lamp, and the loop that traces them, through a
// ray-tracing pipeline or by ray queries in a compute shader. course.shader is
// the other side. The shader of an example compiles with QUERY_SHADER=1 to the
// second form.
//
//     int main(int argc, char** argv) {
//         Example example(EXAMPLE_NAME, "Shows normals as colours.");
//         Course course(example, EXAMPLE_DIR "/main.shader");
//         if (!example.parse(argc, argv)) return example.exitCode();
//         return course.run(1, [&](Traversal& traversal) {
//             traversal.loadShaderGLSL(Shader::TypeRayGen, course.shader(),
//             "RAYGEN_SHADER=1");
//             ...
//         });
//     }

#include "common/viewer.h"

#include <glint/device/traversal.h>
#include <glint/format/mesh.h>
#include <glint/math/camera.h>

#include <filesystem>
#include <functional>
#include <string>
#include <vector>

/// A mesh that stands on a square floor, and where camera and lamp are; apart
/// from how it is drawn, so that tests use it too. World units are those of the
/// floor's checkers; Z is up.
class CourseStage {
public:
    static constexpr float mesh_size = 3.0f;  ///< longest side
    static constexpr float floor_size = 10.0f;
    static constexpr float lift = 0.01f;  ///< over the floor, so that flat meshes do not lie in it
    static constexpr uint32_t object_mesh = 0, object_floor = 1, object_count = 2;

    /// Stands the mesh of a file, or a torus of 4,096 triangles if `path` is
    /// empty, on the floor: Y of the mesh becomes up, and its Z faces +X, as
    /// models of files mostly have it. Triangles are sorted in space; normals are
    /// made where there are none. Errors: those of Mesh::load.
    static glint::Expected<CourseStage> load(const std::filesystem::path& path);

    const glint::Mesh& mesh(uint32_t object) const { return meshes_[object]; }
    /// Object to world.
    const glint::Transform3x4& transform(uint32_t object) const { return transforms_[object]; }

    /// Turns about the mesh by 20 degrees a second.
    static glint::Camera camera(float time, float aspect);
    /// What it looks at.
    static glint::Vector3f target() { return {0.0f, 0.0f, 1.2f}; }
    /// Where the lamp is, and what arrives of it 1 unit away.
    static glint::Vector4f light() { return {3.0f, -4.0f, 6.0f, 45.0f}; }

private:
    std::vector<glint::Mesh> meshes_;
    std::vector<glint::Transform3x4> transforms_;
};

/// The stage on a device, as course.shader wants it: the objects' vertices (a
/// position and a normal each) in one buffer, their indices in another, a
/// structure for each object, and one of an instance of each.
class CourseBuffers {
public:
    /// Takes the instances of mesh and floor, which it may change and add to, and has what it adds built on the device.
    using Arrange = std::function<glint::Status(glint::Device&, std::vector<glint::Tracing::Instance>&)>;

    /// Makes and builds everything; check error().
    CourseBuffers(glint::Device& device, const CourseStage& stage, const Arrange& arrange = {});
    const glint::Error& error() const { return error_; }

    /// Binds what course.shader declares in set 0.
    void bind(glint::Compute& compute, const glint::Camera& camera, const glint::Texture& picture) const;

    uint64_t triangles() const { return triangles_; }
    uint64_t vertices() const { return vertices_; }
    uint64_t tracingMemory() const;

private:
    glint::Error error_;
    glint::Buffer vertex_buffer_, index_buffer_;
    std::vector<glint::Tracing> objects_;
    glint::Tracing scene_;
    uint64_t triangles_ = 0, vertices_ = 0;
};

class Course {
public:
    /// Adds --mesh and --query to the arguments. `shader`: the file of the
    /// example's shaders.
    Course(Example& example, std::string shader);

    const std::string& shader() const { return shader_; }
    /// To be told before run(): what else stands on the stage, and whatever the example needs on the device.
    void setArrange(CourseBuffers::Arrange arrange) { arrange_ = std::move(arrange); }
    /// What run() shows.
    const CourseStage& stage() const { return stage_; }

    /// Opens the device, makes stage and program, draws, writes what was asked
    /// for: the exit code. `load` loads the shaders of the pipeline, whose traces
    /// nest `recursion` deep; `bind` sets what the shader has beside set 0. With
    /// --query, and where the device has no such pipelines, the shader's query
    /// form is traced instead.
    int run(uint32_t recursion, const std::function<void(glint::Traversal&)>& load,
            const std::function<void(glint::Compute&)>& bind = {});

private:
    Example& example_;
    std::string shader_;
    std::filesystem::path mesh_;
    CourseBuffers::Arrange arrange_;
    CourseStage stage_;
    bool use_query_ = false;
};
