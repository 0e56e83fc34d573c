#include "shader_cache.h"

#include <cstring>
#include <type_traits>

namespace glint::shader {

namespace {

template <class T>
concept Plain = std::is_arithmetic_v<T> || std::is_enum_v<T>;

class Writer {
public:
    template <class... Items>
    void operator()(const Items&... items) {
        (put(items), ...);
    }

    std::vector<std::byte> take() { return std::move(bytes_); }

private:
    void raw(const void* data, size_t size) {
        const auto* first = static_cast<const std::byte*>(data);
        bytes_.insert(bytes_.end(), first, first + size);
    }

    template <Plain T>
    void put(const T& value) {
        raw(&value, sizeof(T));
    }
    void put(const std::string& text) {
        put(static_cast<uint32_t>(text.size()));
        raw(text.data(), text.size());
    }
    template <class T, size_t N>
    void put(const std::array<T, N>& values) {
        for (const T& value : values) put(value);
    }
    template <class T>
    void put(const std::vector<T>& values) {
        put(static_cast<uint32_t>(values.size()));
        for (const T& value : values) put(value);
    }
    void put(const std::vector<uint32_t>& words) {
        put(static_cast<uint32_t>(words.size()));
        raw(words.data(), words.size() * sizeof(uint32_t));
    }
    template <class T>
    void put(const T& value) {
        visit(*this, value);
    }

    std::vector<std::byte> bytes_;
};

class ByteReader {
public:
    explicit ByteReader(std::span<const std::byte> bytes) : bytes_(bytes) {}

    template <class... Items>
    void operator()(Items&... items) {
        (get(items), ...);
    }

    /// All bytes were there and none is left.
    bool complete() const { return good_ && bytes_.empty(); }

private:
    void raw(void* data, size_t size) {
        good_ = good_ && size <= bytes_.size();
        if (!good_ || size == 0) return;
        std::memcpy(data, bytes_.data(), size);
        bytes_ = bytes_.subspan(size);
    }

    /// A number of things of `size` bytes at least.
    uint32_t length(size_t size) {
        uint32_t count = 0;
        get(count);
        good_ = good_ && count <= bytes_.size() / size;
        return good_ ? count : 0;
    }

    template <Plain T>
    void get(T& value) {
        raw(&value, sizeof(T));
    }
    void get(bool& value) {
        uint8_t byte = 0;
        raw(&byte, 1);
        value = byte != 0;
    }
    void get(std::string& text) {
        text.resize(length(1));
        raw(text.data(), text.size());
    }
    template <class T, size_t N>
    void get(std::array<T, N>& values) {
        for (T& value : values) get(value);
    }
    template <class T>
    void get(std::vector<T>& values) {
        values.resize(length(1));
        for (T& value : values) get(value);
    }
    void get(std::vector<uint32_t>& words) {
        words.resize(length(sizeof(uint32_t)));
        raw(words.data(), words.size() * sizeof(uint32_t));
    }
    template <class T>
    void get(T& value) {
        visit(*this, value);
    }

    std::span<const std::byte> bytes_;
    bool good_ = true;
};

// One list of members for both directions: `Value` is the type itself to read it, the constant type to write it.

template <class T, class Of>
concept Is = std::is_same_v<std::remove_const_t<T>, Of>;

template <class Archive, Is<ShaderResource> Value>
void visit(Archive& archive, Value& v) {
    archive(v.kind, v.element, v.descriptor, v.name, v.instance, v.set, v.binding, v.count, v.size, v.stride, v.read,
            v.write, v.combined, v.texel_storage, v.has_lone_matrix, v.has_row_major, v.dimension, v.stages, v.aliases);
}

template <class Archive, Is<SpecializationConstant> Value>
void visit(Archive& archive, Value& v) {
    archive(v.id, v.name, v.type, v.default_value);
}

template <class Archive, Is<ShaderVariable> Value>
void visit(Archive& archive, Value& v) {
    archive(v.location, v.name, v.type, v.components);
}

template <class Archive, Is<RayVariable> Value>
void visit(Archive& archive, Value& v) {
    archive(v.kind, v.name, v.size);
}

template <class Archive, Is<RayCall> Value>
void visit(Archive& archive, Value& v) {
    archive(v.is_callable, v.record);
}

template <class Archive, Is<Reflection> Value>
void visit(Archive& archive, Value& v) {
    archive(v.stage, v.entry, v.resources, v.hidden, v.constants, v.inputs, v.outputs, v.ray_variables, v.ray_calls,
            v.record_size, v.push_size, v.group_size, v.group_constants, v.uses_ray_query, v.uses_addresses,
            v.uses_float64, v.uses_int64, v.uses_subgroups, v.uses_layer, v.payload_size, v.mesh_vertices,
            v.mesh_primitives);
}

}  // namespace

std::vector<std::byte> encodeShader(const CompiledShader& shader) {
    Writer writer;
    writer(shader.words, shader.reflection);
    return writer.take();
}

std::optional<CompiledShader> decodeShader(std::span<const std::byte> bytes) {
    ByteReader reader(bytes);
    CompiledShader shader;
    reader(shader.words, shader.reflection);
    if (!reader.complete()) return {};
    return shader;
}

}  // namespace glint::shader
