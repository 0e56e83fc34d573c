#include <glint/format/detail/splat_blocks.h>

#include <glint/base/format_error.h>
#include <glint/format/ply.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstring>

namespace glint {

namespace {

static_assert(std::endian::native == std::endian::little, "values are copied as they are");

// In the order of detail::FileSplat, whose quaternions end in w, then the harmonics' first coefficient.
constexpr std::array<const char*, 14> head_names = {"x",       "y",      "z",      "scale_0", "scale_1",
                                                    "scale_2", "rot_1",  "rot_2",  "rot_3",   "rot_0",
                                                    "opacity", "f_dc_0", "f_dc_1", "f_dc_2"};
constexpr size_t head_count = 11;  // of them, what makes a FileSplat
static_assert(sizeof(detail::FileSplat) == head_count * sizeof(float));

/// What of a file's vertices makes splats.
struct Columns {
    const PlyElement* vertices = nullptr;
    uint32_t degree = 0;
    std::vector<const PlyProperty*> properties;  ///< as head_names, then f_rest as Splats::harmonics has them
};

Expected<Columns> findColumns(const PlyHeader& header, const std::string& name) {
    const auto fail = [&name](const char* id, std::string text) {
        return unexpected(Error::inFile(ErrorCode::Io, id, std::move(text), name, 0));
    };
    Columns columns;
    columns.vertices = header.find("vertex");
    if (!columns.vertices) return fail("splats.property", "the file has no element 'vertex'");
    const PlyElement& vertices = *columns.vertices;
    for (const char* each : head_names) {
        const PlyProperty* property = vertices.find(each);
        if (!property || property->is_list)
            return fail("splats.property", fmt::format("element 'vertex' has no number '{}', and splats have", each));
        columns.properties.push_back(property);
    }
    const auto rest_count =
        static_cast<uint32_t>(std::count_if(vertices.properties.begin(), vertices.properties.end(),
                                            [](const PlyProperty& each) { return each.name.starts_with("f_rest_"); }));
    uint32_t coefficients = 1;  // of a channel
    while (columns.degree <= Splats::max_degree && 3 * (coefficients - 1) != rest_count) {
        columns.degree++;
        coefficients = (columns.degree + 1) * (columns.degree + 1);
    }
    if (columns.degree > Splats::max_degree)
        return fail("splats.rest", fmt::format("element 'vertex' has {} numbers 'f_rest_*'; harmonics of degrees 0 to "
                                               "3 have 0, 9, 24 and 45",
                                               rest_count));
    for (uint32_t k = 0; k + 1 < coefficients; k++)
        for (uint32_t channel = 0; channel < 3; channel++) {
            const std::string each = fmt::format("f_rest_{}", channel * (coefficients - 1) + k);
            const PlyProperty* property = vertices.find(each);
            if (!property || property->is_list)
                return fail("splats.property",
                            fmt::format("element 'vertex' has {} numbers 'f_rest_*', and not '{}'", rest_count, each));
            columns.properties.push_back(property);
        }
    return columns;
}

/// Where the float32 numbers of splats lie in bytes.
struct Rows {
    uint64_t begin = 0;  ///< of the first row
    uint32_t stride = 0;
    std::vector<uint32_t> offsets;  ///< within a row, as Columns::properties
};

void decodeRows(const std::byte* bytes, uint32_t count, const Rows& rows, detail::SplatBlock& block) {
    auto* head = reinterpret_cast<std::byte*>(block.splats.data());
    auto* harmonics = reinterpret_cast<std::byte*>(block.harmonics.data());
    const auto gather = [](const std::byte* row, std::span<const uint32_t> offsets, std::byte*& to) {
        for (const uint32_t offset : offsets) {
            std::memcpy(to, row + offset, sizeof(float));
            to += sizeof(float);
        }
    };
    const std::span<const uint32_t> offsets(rows.offsets);
    for (uint32_t i = 0; i < count; i++) {
        const std::byte* row = bytes + size_t{i} * rows.stride;
        gather(row, offsets.first(head_count), head);
        gather(row, offsets.subspan(head_count), harmonics);
    }
}

detail::SplatSource sourceOf(const Columns& columns, const std::string& name) {
    return {.name = name, .count = columns.vertices->count, .degree = columns.degree, .is_logarithmic = true};
}

Expected<Splats> readRows(std::span<const std::byte> bytes, const Rows& rows, detail::SplatSource source,
                          uint64_t limit, SplatReport* report) {
    source.read = [&](uint64_t first, uint32_t count, detail::SplatBlock& block) -> Status {
        decodeRows(bytes.data() + rows.begin + first * rows.stride, count, rows, block);
        return {};
    };
    return detail::readSplats(source, limit, report);
}

/// Where the rows lie in the file itself, if they are of float32 in this machine's byte order.
bool findRows(const PlyHeader& header, const Columns& columns, Rows& rows) {
    if (header.encoding != PlyEncoding::LittleEndian) return false;
    rows.begin = header.size;
    for (const PlyElement& element : header.elements) {
        if (element.has_list) return false;
        if (&element == columns.vertices) break;
        rows.begin += element.count * element.stride;
    }
    rows.stride = columns.vertices->stride;
    for (const PlyProperty* property : columns.properties) {
        if (property->type != PlyType::Float32) return false;
        rows.offsets.push_back(property->offset);
    }
    return true;
}

}  // namespace

Expected<Splats> parsePlySplats(std::span<const std::byte> file, const std::string& name, uint64_t limit,
                                SplatReport* report) {
    const Expected<PlyHeader> header = parsePlyHeader(file, name);
    if (!header) return unexpected(header.error());
    const Expected<Columns> columns = findColumns(*header, name);
    if (!columns) return unexpected(columns.error());
    const detail::SplatSource source = sourceOf(*columns, name);
    Rows rows;
    if (findRows(*header, *columns, rows)) return readRows(file, rows, source, limit, report);

    // Anything else is brought to that form first.
    if (Status status = detail::checkSplatBytes(source, limit); !status) return unexpected(status.error());
    PlyReader reader(file, *header, name);
    for (const PlyElement& element : header->elements) {
        if (&element == columns->vertices) break;
        if (Status status = reader.skip(element); !status) return unexpected(status.error());
    }
    const size_t width = columns->properties.size();
    std::vector<float> values(columns->vertices->count * width);
    std::vector<PlyReader::Column> places;
    rows = {.begin = 0, .stride = static_cast<uint32_t>(width * sizeof(float)), .offsets = {}};
    for (size_t i = 0; i < width && !values.empty(); i++) {
        places.push_back({columns->properties[i], &values[i], width});
        rows.offsets.push_back(static_cast<uint32_t>(i * sizeof(float)));
    }
    if (Status status = reader.readColumns(*columns->vertices, places); !status) return unexpected(status.error());
    return readRows(std::as_bytes(std::span(values)), rows, source, limit, report);
}

Expected<Splats> detail::loadPlySplats(const std::filesystem::path& path, uint64_t limit, SplatReport* report) {
    const Expected<InputFile> file = InputFile::open(path);
    if (!file) return unexpected(file.error());
    const std::string name = path.filename().string();
    // Most files can be read in blocks. Whatever is unusual about another one is found when all of it is read.
    std::vector<std::byte> bytes(std::min<uint64_t>(file->size(), 1u << 16));
    if (Status status = file->read(0, bytes); !status) return unexpected(status.error());
    const Expected<PlyHeader> header = parsePlyHeader(bytes, name, file->size());
    if (header) {
        const Expected<Columns> columns = findColumns(*header, name);
        if (!columns) return unexpected(columns.error());
        SplatSource source = sourceOf(*columns, name);
        Rows rows;
        if (findRows(*header, *columns, rows)) {
            source.read = [&](uint64_t first, uint32_t count, SplatBlock& block) -> Status {
                block.bytes.resize(size_t{SplatBlock::capacity} * rows.stride);
                const std::span<std::byte> part = std::span(block.bytes).first(size_t{count} * rows.stride);
                if (Status status = file->read(rows.begin + first * rows.stride, part); !status) return status;
                decodeRows(part.data(), count, rows, block);
                return {};
            };
            return readSplats(source, limit, report);
        }
    }
    const Expected<std::vector<std::byte>> all = readFile(path, limit);
    if (!all) return unexpected(all.error());
    return parsePlySplats(*all, name, limit, report);
}

Expected<std::vector<std::byte>> encodePlySplats(const Splats& splats) {
    if (Status status = splats.validate(); !status) return unexpected(status.error());
    std::string header = fmt::format("ply\nformat binary_little_endian 1.0\nelement vertex {}\n", splats.size());
    const auto addProperty = [&](std::string_view property) { header += fmt::format("property float {}\n", property); };
    const uint32_t coefficients = splats.coefficientCount();
    for (const char* each : {"x", "y", "z", "nx", "ny", "nz", "f_dc_0", "f_dc_1", "f_dc_2"}) addProperty(each);
    for (uint32_t i = 0; i < 3 * (coefficients - 1); i++) addProperty(fmt::format("f_rest_{}", i));
    for (const char* each : {"opacity", "scale_0", "scale_1", "scale_2", "rot_0", "rot_1", "rot_2", "rot_3"})
        addProperty(each);
    header += "end_header\n";

    // Logarithms of 0 and of opacities of 0 and 1 are infinite, which not every program takes. In float32 exp(-110) is
    // 0 and 1 / (1 + exp(-20)) is 1.
    const auto logarithm = [](float x) { return x > 0.0f ? std::log(x) : -110.0f; };
    const auto logit = [&](float x) { return x < 1.0f ? logarithm(x) - std::log1p(-x) : 20.0f; };
    const size_t width = 14 + 3 * size_t{coefficients};
    std::vector<std::byte> file(header.size() + splats.size() * width * sizeof(float));
    std::memcpy(file.data(), header.data(), header.size());
    std::vector<float> row(width);
    for (size_t i = 0; i < splats.size(); i++) {
        float* at = row.data();
        const auto put = [&at](std::initializer_list<float> values) {
            at = std::copy(values.begin(), values.end(), at);
        };
        const Vector3f& p = splats.positions[i];
        const Vector3f* harmonics = splats.harmonics.data() + i * coefficients;
        put({p.x, p.y, p.z, 0, 0, 0, harmonics->x, harmonics->y, harmonics->z});
        for (int channel = 0; channel < 3; channel++)
            for (uint32_t k = 1; k < coefficients; k++) put({harmonics[k][channel]});
        const Vector3f& s = splats.scales[i];
        const Vector4f& q = splats.rotations[i];
        put({logit(splats.opacities[i]), logarithm(s.x), logarithm(s.y), logarithm(s.z), q.w, q.x, q.y, q.z});
        std::memcpy(file.data() + header.size() + i * width * sizeof(float), row.data(), width * sizeof(float));
    }
    return file;
}

}  // namespace glint
