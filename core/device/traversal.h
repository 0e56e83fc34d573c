#pragma once

#include <glint/device/program.h>
#include <glint/device/types.h>

#include <cstdint>
#include <span>
#include <type_traits>

namespace glint {

/// A ray-tracing pipeline and its binding table. Created by Device::createTraversal, configured, then create(); played
/// by Compute::setTraversal and dispatch.
///
/// Shaders form groups in the order in which they are loaded: ray-generation, miss and callable shaders one each, in
/// three tables of their own; hit shaders in a fourth. A hit shader (TypeClosest, TypeFirstHit, TypeIntersection) joins
/// the last hit group, unless that has one of its kind already: then it begins the next. A hit group with an
/// intersection shader is for boxes, any other for triangles.
///
/// A table holds one record a group, in order, until records are added to it: then exactly those. traceRayEXT names the
/// miss record; the hit record is instance.offset + geometry * stride + offset, with the two of traceRayEXT;
/// executeCallableEXT names the callable record.
class Traversal : public Program {
public:
    Traversal() = default;
    explicit Traversal(detail::Object* object) : Program(object) {}

    /// Loads and compiles one stage, which joins or begins a group. True if that worked; otherwise the error is kept
    /// for create().
    bool loadShaderGLSL(Shader::Type type, std::string_view path, std::string_view macros = {},
                        Where where = Where::current()) {
        return load(Shader::loadGLSL(type, path, macros, where), where);
    }
    bool createShaderGLSL(Shader::Type type, std::string_view text, std::string_view macros = {},
                          Where where = Where::current()) {
        return load(Shader::createGLSL(type, text, macros, "traversal", where), where);
    }
    bool loadShaderSPIRV(Shader::Type type, std::string_view path, Where where = Where::current()) {
        return load(Shader::loadSPIRV(type, path, where), where);
    }

    /// Begins the next hit group, empty so far. If it stays empty, hits there run nothing, and boxes are never hit.
    Traversal& addHitGroup(Where where = Where::current());

    /// How deep traceRayEXT may nest: 1 traces from ray-generation shaders alone. More than Features::recursionDepth
    /// fails create() with "traversal.recursion"; deeper nesting in the shaders is undefined.
    Traversal& setRecursionDepth(uint32_t depth, Where where = Where::current());
    /// How deep executeCallableEXT may nest, 2 unless it is said: 1 calls callable shaders that call none. More than
    /// max_callable_depth fails create() with "traversal.callable_depth"; deeper nesting in the shaders is undefined.
    Traversal& setCallableDepth(uint32_t depth, Where where = Where::current());
    static constexpr uint32_t max_callable_depth = 31;  ///< of either engine

    /// Adds a record to a table: the group counts as above, `data` is what its shaders read in their shaderRecordEXT
    /// block, copied. Returns the record's index in its table. create() checks groups ("traversal.record_group") and
    /// sizes ("traversal.record_size").
    uint32_t addHitRecord(uint32_t group, const void* data, uint64_t size, Where where = Where::current());
    uint32_t addMissRecord(uint32_t group, const void* data, uint64_t size, Where where = Where::current());
    uint32_t addCallableRecord(uint32_t group, const void* data, uint64_t size, Where where = Where::current());
    template <class Data>
    uint32_t addHitRecord(uint32_t group, const Data& data, Where where = Where::current()) {
        return addHitRecord(group, bytes(data), sizeOf(data), where);
    }
    template <class Data>
    uint32_t addMissRecord(uint32_t group, const Data& data, Where where = Where::current()) {
        return addMissRecord(group, bytes(data), sizeOf(data), where);
    }
    template <class Data>
    uint32_t addCallableRecord(uint32_t group, const Data& data, Where where = Where::current()) {
        return addCallableRecord(group, bytes(data), sizeOf(data), where);
    }
    /// Without data.
    uint32_t addHitRecord(uint32_t group, Where where = Where::current()) {
        return addHitRecord(group, nullptr, 0, where);
    }
    uint32_t addMissRecord(uint32_t group, Where where = Where::current()) {
        return addMissRecord(group, nullptr, 0, where);
    }
    uint32_t addCallableRecord(uint32_t group, Where where = Where::current()) {
        return addCallableRecord(group, nullptr, 0, where);
    }

    /// So far, or of what create() made.
    uint32_t getGenerations() const;
    uint32_t getHitGroups() const;
    uint32_t getHitRecords() const;
    uint32_t getMissRecords() const;
    uint32_t getCallableRecords() const;
    uint32_t getRecursionDepth() const;
    uint32_t getCallableDepth() const;

private:
    template <class Data>
    static const void* bytes(const Data& data) {
        static_assert(std::is_trivially_copyable_v<Data> && !std::is_pointer_v<Data>);
        return &data;
    }
    template <class Data>
    static uint64_t sizeOf(const Data&) {
        return sizeof(Data);
    }
    template <class Data, size_t N>
    static const void* bytes(const std::span<Data, N>& data) {
        static_assert(std::is_trivially_copyable_v<Data>);
        return data.data();
    }
    template <class Data, size_t N>
    static uint64_t sizeOf(const std::span<Data, N>& data) {
        return data.size_bytes();
    }
};

}  // namespace glint
