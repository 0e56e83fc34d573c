#include <glint/format/splats.h>

#include <glint/base/format_error.h>
#include <glint/format/ply.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstring>

namespace glint {

namespace {

constexpr std::array<const char*, 14> names = {"x",     "y",     "z",     "scale_0", "scale_1", "scale_2", "rot_0",
                                               "rot_1", "rot_2", "rot_3", "opacity", "f_dc_0",  "f_dc_1",  "f_dc_2"};

Error failure(ErrorCode code, const char* id, const std::string& name, std::string text) {
    return Error::inFile(code, id, std::move(text), name, 0);
}

float logistic(float x) { return 1.0f / (1.0f + std::exp(-x)); }

}  // namespace

Expected<Splats> parsePlySplats(std::span<const std::byte> file, const std::string& name, uint64_t limit,
                                SplatReport* report) {
    const Expected<PlyHeader> header = parsePlyHeader(file, name);
    if (!header) return unexpected(header.error());
    const PlyElement* vertex = header->find("vertex");
    if (!vertex) return unexpected(failure(ErrorCode::Io, "splats.property", name, "the file has no element 'vertex'"));
    std::vector<const PlyProperty*> properties;
    for (const char* each : names) {
        const PlyProperty* property = vertex->find(each);
        if (!property || property->is_list)
            return unexpected(failure(ErrorCode::Io, "splats.property", name,
                                      fmt::format("element 'vertex' has no property '{}', which splats have", each)));
        properties.push_back(property);
    }
    uint32_t rest = 0;
    while (const PlyProperty* property = vertex->find(fmt::format("f_rest_{}", rest))) {
        properties.push_back(property);
        rest++;
    }
    Splats splats;
    while (splats.degree <= Splats::max_degree && rest != 3 * (splats.coefficientCount() - 1)) splats.degree++;
    if (splats.degree > Splats::max_degree)
        return unexpected(
            failure(ErrorCode::Io, "splats.rest", name,
                    fmt::format("{} properties 'f_rest_*'; harmonics have 0, 9, 24 or 45 of them", rest)));
    const uint32_t coefficients = splats.coefficientCount();
    if (vertex->count > limit / (sizeof(float) * (11 + 3 * coefficients)))
        return unexpected(failure(ErrorCode::OutOfRange, "splats.too_large", name,
                                  fmt::format("{} splats take more than the limit of {} bytes", vertex->count, limit)));

    PlyReader reader(file, *header, name);
    for (const PlyElement& element : header->elements) {
        if (&element == vertex) break;
        if (Status status = reader.skip(element); !status) return unexpected(status.error());
    }
    const size_t width = properties.size();
    std::vector<float> values(vertex->count * width);
    std::vector<PlyReader::Column> columns;
    for (size_t i = 0; i < width; i++) columns.push_back({properties[i], values.data() + i, width});
    if (Status status = reader.readColumns(*vertex, columns); !status) return unexpected(status.error());

    SplatReport counted;
    counted.splats = vertex->count;
    for (uint64_t i = 0; i < vertex->count; i++) {
        const float* v = values.data() + i * width;
        splats.positions.emplace_back(v[0], v[1], v[2]);
        splats.scales.emplace_back(std::exp(v[3]), std::exp(v[4]), std::exp(v[5]));
        const float length = std::sqrt(v[6] * v[6] + v[7] * v[7] + v[8] * v[8] + v[9] * v[9]);
        splats.rotations.emplace_back(v[7] / length, v[8] / length, v[9] / length, v[6] / length);
        splats.opacities.push_back(logistic(v[10]));
        splats.harmonics.emplace_back(v[11], v[12], v[13]);
        for (uint32_t k = 0; k + 1 < coefficients; k++)
            splats.harmonics.emplace_back(v[14 + k], v[14 + k + coefficients - 1], v[14 + k + 2 * (coefficients - 1)]);
    }
    if (report) *report = counted;
    return splats;
}

Expected<std::vector<std::byte>> encodePlySplats(const Splats& splats) {
    static_assert(std::endian::native == std::endian::little, "values are copied as they are");
    if (Status status = splats.validate(); !status) return unexpected(status.error());
    std::string header = fmt::format("ply\nformat binary_little_endian 1.0\nelement vertex {}\n", splats.size());
    const auto add = [&](std::string_view property) { header += fmt::format("property float {}\n", property); };
    const uint32_t coefficients = splats.coefficientCount();
    for (const char* each : {"x", "y", "z", "nx", "ny", "nz", "f_dc_0", "f_dc_1", "f_dc_2"}) add(each);
    for (uint32_t i = 0; i < 3 * (coefficients - 1); i++) add(fmt::format("f_rest_{}", i));
    for (const char* each : {"opacity", "scale_0", "scale_1", "scale_2", "rot_0", "rot_1", "rot_2", "rot_3"}) add(each);
    header += "end_header\n";

    const size_t width = 14 + 3 * size_t{coefficients};
    std::vector<std::byte> file(header.size() + splats.size() * width * sizeof(float));
    std::memcpy(file.data(), header.data(), header.size());
    std::vector<float> row(width);
    for (size_t i = 0; i < splats.size(); i++) {
        float* at = row.data();
        const auto put = [&at](std::initializer_list<float> values) {
            at = std::copy(values.begin(), values.end(), at);
        };
        const Vector3f* harmonics = splats.harmonics.data() + i * coefficients;
        const Vector3f& p = splats.positions[i];
        put({p.x, p.y, p.z, 0, 0, 0, harmonics->x, harmonics->y, harmonics->z});
        for (int channel = 0; channel < 3; channel++)
            for (uint32_t k = 1; k < coefficients; k++) put({harmonics[k][channel]});
        // Logarithms of 0 would be infinite; exp(-110) is 0 in float32, and 1 / (1 + exp(-20)) is 1.
        const auto logarithm = [](float x) { return std::max(std::log(x), -110.0f); };
        const float opacity = splats.opacities[i];
        put({std::min(logarithm(opacity) - std::log1p(-opacity), 20.0f)});
        const Vector3f& s = splats.scales[i];
        put({logarithm(s.x), logarithm(s.y), logarithm(s.z)});
        const Vector4f& q = splats.rotations[i];
        put({q.w, q.x, q.y, q.z});
        std::memcpy(file.data() + header.size() + i * width * sizeof(float), row.data(), width * sizeof(float));
    }
    return file;
}

}  // namespace glint
