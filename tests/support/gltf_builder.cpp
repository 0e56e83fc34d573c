#include "gltf_builder.h"

#include <map>

namespace glint::test {

namespace {

void append(std::vector<std::byte>& bytes, uint32_t word) {
    for (int shift = 0; shift < 32; shift += 8) bytes.push_back(static_cast<std::byte>(word >> shift));
}

template <class Bytes, class Byte>
void pad(Bytes& bytes, Byte filler) {
    while (bytes.size() % 4 != 0) bytes.push_back(filler);
}

}  // namespace

GltfBuilder::GltfBuilder() : json({{"asset", {{"version", "2.0"}}}}) {}

int GltfBuilder::view(std::span<const std::byte> bytes) {
    pad(buffer_, std::byte(0));
    json["bufferViews"].push_back({{"buffer", 0}, {"byteOffset", buffer_.size()}, {"byteLength", bytes.size()}});
    buffer_.insert(buffer_.end(), bytes.begin(), bytes.end());
    return static_cast<int>(json["bufferViews"].size()) - 1;
}

int GltfBuilder::accessor(std::span<const std::byte> bytes, int code, size_t size, const std::string& type,
                          bool is_normalized) {
    const std::map<std::string, size_t> components = {
        {"SCALAR", 1}, {"VEC2", 2}, {"VEC3", 3}, {"VEC4", 4}, {"MAT4", 16}};
    nlohmann::json accessor = {{"bufferView", view(bytes)},
                               {"componentType", code},
                               {"count", bytes.size() / size / components.at(type)},
                               {"type", type}};
    if (is_normalized) accessor["normalized"] = true;
    json["accessors"].push_back(std::move(accessor));
    return static_cast<int>(json["accessors"].size()) - 1;
}

int GltfBuilder::mesh(const std::vector<float>& positions, nlohmann::json more) {
    more["attributes"]["POSITION"] = accessor(positions, "VEC3");
    json["meshes"].push_back({{"primitives", {std::move(more)}}});
    return static_cast<int>(json["meshes"].size()) - 1;
}

int GltfBuilder::node(nlohmann::json node) {
    json["nodes"].push_back(std::move(node));
    return static_cast<int>(json["nodes"].size()) - 1;
}

std::string GltfBuilder::text() const {
    nlohmann::json document = json;
    if (!buffer_.empty())
        document["buffers"] = {
            {{"byteLength", buffer_.size()}, {"uri", "data:application/octet-stream;base64," + base64(buffer_)}}};
    return document.dump();
}

std::vector<std::byte> GltfBuilder::glb() const {
    nlohmann::json document = json;
    document["buffers"] = {{{"byteLength", buffer_.size()}}};
    return makeGlb(document.dump(), buffer_);
}

std::vector<std::byte> makeGlb(std::string text, std::span<const std::byte> binary) {
    std::vector<std::byte> padded(binary.begin(), binary.end());
    pad(text, ' ');
    pad(padded, std::byte(0));
    std::vector<std::byte> bytes;
    append(bytes, 0x46546c67);
    append(bytes, 2);
    append(bytes, static_cast<uint32_t>(28 + text.size() + padded.size()));
    append(bytes, static_cast<uint32_t>(text.size()));
    append(bytes, 0x4e4f534a);
    for (const char c : text) bytes.push_back(static_cast<std::byte>(c));
    append(bytes, static_cast<uint32_t>(padded.size()));
    append(bytes, 0x004e4942);
    bytes.insert(bytes.end(), padded.begin(), padded.end());
    return bytes;
}

std::string base64(std::span<const std::byte> bytes) {
    constexpr char letters[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    std::string text;
    for (size_t i = 0; i < bytes.size(); i += 3) {
        uint32_t group = 0;
        for (size_t k = 0; k < 3; k++)
            group = group << 8 | (i + k < bytes.size() ? static_cast<uint32_t>(bytes[i + k]) : 0);
        for (size_t k = 0; k < 4; k++) text += i + k <= bytes.size() ? letters[group >> (18 - 6 * k) & 63] : '=';
    }
    return text;
}

}  // namespace glint::test
