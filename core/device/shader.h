#pragma once

#include <glint/device/handle.h>
#include <glint/shader/reflection.h>

#include <cstdint>
#include <source_location>
#include <span>
#include <string_view>

namespace glint {

/// One compiled stage, independent of any device. A Shader can be set on many kernels, pipelines and traversals.
/// Files are looked up as given, then in the folders of addPath.
class Shader : public Handle {
public:
    enum Type : uint8_t {
        TypeVertex,
        TypeControl,
        TypeEvaluate,
        TypeGeometry,
        TypeFragment,
        TypeCompute,
        TypeTask,
        TypeMesh,
        TypeRayGen,
        TypeRayMiss,
        TypeClosest,
        TypeFirstHit,
        TypeIntersection,
        TypeCallable,
    };
    using Mask = ShaderMask;
    static constexpr Mask MaskVertex = stageBit(ShaderStage::Vertex);
    static constexpr Mask MaskFragment = stageBit(ShaderStage::Fragment);
    static constexpr Mask MaskCompute = stageBit(ShaderStage::Compute);
    static constexpr Mask MaskTask = stageBit(ShaderStage::Task);
    static constexpr Mask MaskMesh = stageBit(ShaderStage::Mesh);
    static constexpr Mask MaskVertexFragment = MaskVertex | MaskFragment;
    static constexpr Mask MaskRayGen = stageBit(ShaderStage::RayGen);
    static constexpr Mask MaskRayMiss = stageBit(ShaderStage::RayMiss);
    static constexpr Mask MaskClosest = stageBit(ShaderStage::Closest);
    static constexpr Mask MaskFirstHit = stageBit(ShaderStage::FirstHit);
    static constexpr Mask MaskIntersection = stageBit(ShaderStage::Intersection);
    static constexpr Mask MaskCallable = stageBit(ShaderStage::Callable);
    static constexpr Mask MaskTracing =
        MaskRayGen | MaskRayMiss | MaskClosest | MaskFirstHit | MaskIntersection | MaskCallable;
    static constexpr Mask MaskAll = ~0u;

    Shader() = default;
    explicit Shader(detail::Object* object) : Handle(object) {}

    /// Compiles a GLSL file; `macros` is "A=1; B=2". On failure the handle carries the error: "shader.*", "file.open".
    static Shader loadGLSL(Type type, std::string_view path, std::string_view macros = {},
                           std::source_location where = std::source_location::current());
    /// Compiles GLSL text; `name` stands for the file in messages.
    static Shader createGLSL(Type type, std::string_view text, std::string_view macros = {},
                             std::string_view name = "shader",
                             std::source_location where = std::source_location::current());
    static Shader loadSPIRV(Type type, std::string_view path,
                            std::source_location where = std::source_location::current());
    static Shader createSPIRV(Type type, std::span<const uint32_t> words, std::string_view name = "shader",
                              std::source_location where = std::source_location::current());
    static Shader createAssembly(Type type, std::string_view text, std::string_view name = "shader",
                                 std::source_location where = std::source_location::current());

    Type getType() const;
    /// What the shader declares. Empty unless ready.
    const Reflection& getReflection() const;
    /// Optimised SPIR-V. Empty unless ready.
    std::span<const uint32_t> getWords() const;

    /// The same shader compiled anew, from its file if it was loaded from one.
    Shader reloaded(std::source_location where = std::source_location::current()) const;

    /// Global macros, for every shader compiled from now on.
    static void setMacro(std::string_view name, int value);
    static void setMacro(std::string_view name, std::string_view value = {});
    static void removeMacro(std::string_view name);
    static void clearMacros();
    /// A file that #include finds by this name before the disk is asked; empty text removes it.
    static void setInclude(std::string_view name, std::string_view text);
    /// A folder in which shader files and their includes are looked up.
    static void addPath(std::string_view folder);
    /// Folder and bytes of the disk cache; see <glint/shader/shader_compiler.h>.
    static void setCache(std::string_view folder, uint64_t limit = 256ull << 20);
};

}  // namespace glint
