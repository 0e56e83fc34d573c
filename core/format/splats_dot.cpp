#include <glint/format/detail/splat_blocks.h>

#include <glint/base/format_error.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstring>

namespace glint {

namespace {

static_assert(std::endian::native == std::endian::little, "values are copied as they are");

constexpr size_t row_size = 32;
constexpr float harmonic_0 = 0.28209479177387814f;  // Y_0

/// A splat as it stands in the file.
struct Row {
    Vector3f position;
    Vector3f scale;
    std::array<uint8_t, 4> color;       // red, green, blue, opacity
    std::array<uint8_t, 4> quaternion;  // w, x, y, z
};
static_assert(sizeof(Row) == row_size);

void decodeRows(const std::byte* bytes, uint32_t count, detail::SplatBlock& block) {
    for (uint32_t i = 0; i < count; i++) {
        Row row;
        std::memcpy(&row, bytes + i * row_size, row_size);
        const auto color = [&row](size_t k) { return (static_cast<float>(row.color[k]) / 255.0f - 0.5f) / harmonic_0; };
        const auto turn = [&row](size_t k) { return (static_cast<float>(row.quaternion[k]) - 128.0f) / 128.0f; };
        block.splats[i] = {
            row.position, row.scale, {turn(1), turn(2), turn(3), turn(0)}, static_cast<float>(row.color[3]) / 255.0f};
        block.harmonics[i] = {color(0), color(1), color(2)};
    }
}

Expected<detail::SplatSource> sourceOf(uint64_t file_size, const std::string& name) {
    if (file_size % row_size != 0)
        return unexpected(Error::inFile(
            ErrorCode::Io, "splats.truncated",
            fmt::format("{} bytes are no whole number of splats of {} bytes each", file_size, row_size), name, 0));
    return detail::SplatSource{.name = name, .count = file_size / row_size};
}

uint8_t toByte(float value) { return static_cast<uint8_t>(std::clamp(std::round(value), 0.0f, 255.0f)); }

}  // namespace

Expected<Splats> parseDotSplat(std::span<const std::byte> file, const std::string& name, uint64_t limit,
                               SplatReport* report) {
    Expected<detail::SplatSource> source = sourceOf(file.size(), name);
    if (!source) return unexpected(source.error());
    source->read = [&](uint64_t first, uint32_t count, detail::SplatBlock& block) -> Status {
        decodeRows(file.data() + first * row_size, count, block);
        return {};
    };
    return detail::readSplats(*source, limit, report);
}

Expected<Splats> detail::loadDotSplat(const std::filesystem::path& path, uint64_t limit, SplatReport* report) {
    const Expected<InputFile> file = InputFile::open(path);
    if (!file) return unexpected(file.error());
    Expected<SplatSource> source = sourceOf(file->size(), path.filename().string());
    if (!source) return unexpected(source.error());
    source->read = [&](uint64_t first, uint32_t count, SplatBlock& block) -> Status {
        block.bytes.resize(SplatBlock::capacity * row_size);
        const std::span<std::byte> part = std::span(block.bytes).first(count * row_size);
        if (Status status = file->read(first * row_size, part); !status) return status;
        decodeRows(part.data(), count, block);
        return {};
    };
    return readSplats(*source, limit, report);
}

Expected<std::vector<std::byte>> encodeDotSplat(const Splats& splats) {
    if (Status status = splats.validate(); !status) return unexpected(status.error());
    std::vector<std::byte> file(splats.size() * row_size);
    for (size_t i = 0; i < splats.size(); i++) {
        const Vector3f color = splats.harmonics[i * splats.coefficientCount()] * harmonic_0 + 0.5f;
        const Vector4f& q = splats.rotations[i];
        const auto turn = [](float component) { return toByte(component * 128.0f + 128.0f); };
        const Row row = {splats.positions[i],
                         splats.scales[i],
                         {toByte(color.x * 255.0f), toByte(color.y * 255.0f), toByte(color.z * 255.0f),
                          toByte(splats.opacities[i] * 255.0f)},
                         {turn(q.w), turn(q.x), turn(q.y), turn(q.z)}};
        std::memcpy(file.data() + i * row_size, &row, row_size);
    }
    return file;
}

}  // namespace glint
