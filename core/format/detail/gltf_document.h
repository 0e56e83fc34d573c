#pragma once

#include <glint/base/format_error.h>
#include <glint/base/status.h>

#include <nlohmann/json_fwd.hpp>

#include <string>
#include <string_view>

namespace glint::detail {

/// Where an element stands in a document: "nodes[3].children[1]". Lives on the stack; text only if there is an error.
struct GltfPath {
    const GltfPath* parent = nullptr;
    std::string_view
        name;  ///< of a property, empty for an element of an array; of the document where there is no parent
    size_t index = 0;

    GltfPath operator/(std::string_view property) const& { return {this, property, 0}; }
    GltfPath operator/(size_t element) const& { return {this, {}, element}; }
    GltfPath operator/(std::string_view) const&& = delete;  // the path would outlive its parent
    GltfPath operator/(size_t) const&& = delete;
    std::string text() const;
    std::string_view document() const { return parent ? parent->document() : name; }
};

/// An error that begins with the place.
template <class... Args>
Error gltfError(const GltfPath& path, ErrorCode code, const char* id, fmt::format_string<Args...> format,
                Args&&... args) {
    const std::string place = path.text();
    return makeError(code, id, "{}{}{}", place, place.empty() ? "" : ": ",
                     fmt::format(format, std::forward<Args>(args)...));
}

/// What is left of the caller's limit.
class GltfBudget {
public:
    explicit GltfBudget(uint64_t limit) : limit_(limit), left_(limit) {}

    uint64_t left() const { return left_; }
    /// Error: "gltf.too_large".
    Status take(const GltfPath& path, uint64_t count, uint64_t size) {
        if (size != 0 && count > left_ / size)
            return gltfError(path, ErrorCode::OutOfRange, "gltf.too_large",
                             "{} elements of {} bytes: {} bytes are left of the limit of {}", count, size, left_,
                             limit_);
        left_ -= count * size;
        return {};
    }

private:
    uint64_t limit_;
    uint64_t left_;
};

/// Holds a document to what parseGltf() reads: checks types, ranges, choices and references of every property that is
/// read, takes all others out, and writes integers that are spelt as fractions (1.0) as integers. tinygltf passes over
/// what has the wrong type, and hands on every number. Errors: "gltf.type", "gltf.missing", "gltf.value", "gltf.index",
/// "gltf.version", "gltf.extension", "gltf.too_large".
Status checkGltf(nlohmann::json& document, GltfBudget& budget);

}  // namespace glint::detail
