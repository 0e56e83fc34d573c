#pragma once

#include <glint/math/math.h>

#include <nlohmann/json.hpp>

#include <cstddef>
#include <span>
#include <string>
#include <vector>

namespace glint::test {

/// Makes glTF documents with one buffer. Fill `json` as you like; accessors and views are added to it.
class GltfBuilder {
public:
    GltfBuilder();

    nlohmann::json json;

    /// Adds a view of the bytes, beginning at a multiple of 4; gives its number.
    int view(std::span<const std::byte> bytes);

    /// Adds an accessor of whole elements of `type` ("VEC3"), and a view of its own; gives the accessor's number.
    template <class T>
    int accessor(const std::vector<T>& components, const char* type, bool is_normalized = false) {
        return accessor(std::as_bytes(std::span(components)), codeOf(T()), sizeof(T), type, is_normalized);
    }

    /// Adds a mesh of one primitive, which has what `more` says besides its positions; gives its number.
    int mesh(const std::vector<float>& positions, nlohmann::json more = nlohmann::json::object());

    /// Adds a node; gives its number.
    int node(nlohmann::json node);

    /// The document as JSON, its buffer a data URI.
    std::string text() const;
    /// The document as GLB.
    std::vector<std::byte> glb() const;

private:
    static int codeOf(int8_t) { return 5120; }
    static int codeOf(uint8_t) { return 5121; }
    static int codeOf(int16_t) { return 5122; }
    static int codeOf(uint16_t) { return 5123; }
    static int codeOf(uint32_t) { return 5125; }
    static int codeOf(float) { return 5126; }
    int accessor(std::span<const std::byte> bytes, int code, size_t size, const std::string& type, bool is_normalized);

    std::vector<std::byte> buffer_;
};

/// A GLB of two chunks; their sizes and the file's are what they should be.
std::vector<std::byte> makeGlb(std::string text, std::span<const std::byte> binary);

std::string base64(std::span<const std::byte> bytes);

}  // namespace glint::test
