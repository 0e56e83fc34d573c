#pragma once

#include <glint/device/program.h>

namespace glint {

/// A compute pipeline. Created by Device::createKernel, configured, then create().
class Kernel : public Program {
public:
    Kernel() = default;
    explicit Kernel(detail::Object* object) : Program(object) {}

    /// Loads and compiles the compute stage. True if that worked; otherwise the error is kept for create().
    bool loadShaderGLSL(std::string_view path, std::string_view macros = {}, Where where = Where::current()) {
        return load(Shader::loadGLSL(Shader::TypeCompute, path, macros, where), where);
    }
    bool createShaderGLSL(std::string_view text, std::string_view macros = {}, Where where = Where::current()) {
        return load(Shader::createGLSL(Shader::TypeCompute, text, macros, "kernel", where), where);
    }
    bool loadShaderSPIRV(std::string_view path, Where where = Where::current()) {
        return load(Shader::loadSPIRV(Shader::TypeCompute, path, where), where);
    }

    /// Optional declarations of slot counts: fix them over macro variants; create() checks that the shader declares no
    /// more ("program.slots").
    Kernel& setUniforms(uint32_t count, Where where = Where::current());
    Kernel& setStorages(uint32_t count, Where where = Where::current());
    Kernel& setTextures(uint32_t count, Where where = Where::current());
    Kernel& setSurfaces(uint32_t count, Where where = Where::current());
    Kernel& setSamplers(uint32_t count, Where where = Where::current());
    Kernel& setTracings(uint32_t count, Where where = Where::current());
    Kernel& setTexels(uint32_t count, Where where = Where::current());

    /// Threads of a group; 1 unless ready.
    uint32_t getGroupSizeX() const;
    uint32_t getGroupSizeY() const;
    uint32_t getGroupSizeZ() const;
};

}  // namespace glint
