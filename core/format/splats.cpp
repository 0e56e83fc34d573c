#include <glint/format/splats.h>

#include <glint/base/file.h>
#include <glint/base/format_error.h>
#include <glint/format/detail/splat_blocks.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <new>

namespace glint {

namespace {

std::string extension(const std::filesystem::path& path) {
    std::string text = path.extension().string();
    for (char& c : text) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
    return text;
}

Error unknownExtension(const std::filesystem::path& path) {
    return makeError(ErrorCode::Unsupported, "splats.unknown_extension",
                     "'{}': splats end in .ply, .splat or .spz, not in '{}'", path.string(), path.extension().string());
}

Error outOfMemory(const std::filesystem::path& path) {
    return makeError(ErrorCode::OutOfMemory, "splats.out_of_memory", "the host has no memory for '{}'", path.string());
}

}  // namespace

Expected<Splats> Splats::load(const std::filesystem::path& path, uint64_t limit, SplatReport* report) {
    const std::string kind = extension(path);
    try {
        if (kind == ".ply") return detail::loadPlySplats(path, limit, report);
        if (kind == ".splat") return detail::loadDotSplat(path, limit, report);
        if (kind == ".spz") {
            const Expected<std::vector<std::byte>> bytes = readFile(path, limit);
            if (!bytes) return unexpected(bytes.error());
            return parseSpz(*bytes, path.filename().string(), limit, report);
        }
    } catch (const std::bad_alloc&) { return unexpected(outOfMemory(path)); }
    return unexpected(unknownExtension(path));
}

Status Splats::save(const std::filesystem::path& path) const {
    const std::string kind = extension(path);
    if (kind != ".ply" && kind != ".splat" && kind != ".spz") return unknownExtension(path);
    try {
        const Expected<std::vector<std::byte>> bytes = kind == ".ply"     ? encodePlySplats(*this)
                                                       : kind == ".splat" ? encodeDotSplat(*this)
                                                                          : encodeSpz(*this);
        if (!bytes) return bytes.error();
        return writeFile(path, *bytes);
    } catch (const std::bad_alloc&) { return outOfMemory(path); }
}

Status Splats::validate() const {
    if (degree > max_degree)
        return makeError(ErrorCode::OutOfRange, "splats.degree", "splats: harmonics of degree {}; 0 to {} are known",
                         degree, max_degree);
    const auto checkCount = [this](const char* what, size_t count, size_t expected) -> Status {
        if (count == expected) return {};
        return makeError(ErrorCode::InvalidArgument, "splats.count", "splats: {} {} for {} positions; {} are needed",
                         count, what, positions.size(), expected);
    };
    if (Status status = checkCount("scales", scales.size(), size()); !status) return status;
    if (Status status = checkCount("rotations", rotations.size(), size()); !status) return status;
    if (Status status = checkCount("opacities", opacities.size(), size()); !status) return status;
    if (Status status = checkCount("harmonics", harmonics.size(), size() * coefficientCount()); !status) return status;

    const auto fail = [](size_t splat, const char* what) {
        return makeError(ErrorCode::InvalidArgument, "splats.value", "splats: splat {}: {}", splat, what);
    };
    for (size_t i = 0; i < size(); i++) {
        if (!isFinite(positions[i])) return fail(i, "a coordinate of its position is not finite");
        const Vector3f& s = scales[i];
        if (!isFinite(s) || s.x < 0 || s.y < 0 || s.z < 0) return fail(i, "a scale is negative or not finite");
        if (!(opacities[i] >= 0.0f && opacities[i] <= 1.0f)) return fail(i, "its opacity is not within 0 and 1");
        const Vector4f& q = rotations[i];
        if (!(std::abs(q.x * q.x + q.y * q.y + q.z * q.z + q.w * q.w - 1.0f) <= 2e-3f))
            return fail(i, "its quaternion is not of length 1");
        const auto first = harmonics.begin() + static_cast<std::ptrdiff_t>(i * coefficientCount());
        if (!std::all_of(first, first + coefficientCount(), isFinite)) return fail(i, "a harmonic is not finite");
    }
    return {};
}

void Splats::reduceDegree(uint32_t to) {
    if (to >= degree) return;
    const size_t from_count = coefficientCount();
    degree = to;
    const size_t count = coefficientCount();
    for (size_t i = 1; i < size(); i++)
        std::copy_n(harmonics.data() + i * from_count, count, harmonics.data() + i * count);
    harmonics.resize(size() * count);
}

}  // namespace glint
