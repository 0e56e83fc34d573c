#include <glint/geometry/simplify.h>

#include <glint/base/format_error.h>
#include <glint/geometry/mesh_optimize.h>

#include <meshoptimizer.h>

#include <algorithm>
#include <cmath>

namespace glint {

namespace {

/// Each part, and what lies in none, simplified by itself: their borders are open edges there, and stay.
Mesh simplifyParts(const Mesh& mesh, double ratio, bool keep_border) {
    Mesh result = mesh;
    result.indices.clear();
    const auto add = [&](size_t first, size_t count, unsigned int flags) {
        if (count == 0) return;
        std::vector<uint32_t> fewer(count);
        const auto target = static_cast<size_t>(static_cast<double>(count) / 3.0 * ratio) * 3;
        fewer.resize(meshopt_simplify(fewer.data(), &mesh.indices[first], count, &mesh.positions[0].x,
                                      mesh.positions.size(), sizeof(Vector3f), target, 1.0f, flags, nullptr));
        result.indices.insert(result.indices.end(), fewer.begin(), fewer.end());
    };
    size_t end = 0;
    const bool is_divided = !mesh.parts.empty() && mesh.parts.front().index_count < mesh.indices.size();
    unsigned int flags = 0;
    if (keep_border || is_divided) flags = meshopt_SimplifyLockBorder;
    for (size_t i = 0; i < mesh.parts.size(); i++) {
        add(end, mesh.parts[i].first_index - end, flags);
        result.parts[i].first_index = static_cast<uint32_t>(result.indices.size());
        add(mesh.parts[i].first_index, mesh.parts[i].index_count, flags);
        result.parts[i].index_count = static_cast<uint32_t>(result.indices.size()) - result.parts[i].first_index;
        end = size_t{mesh.parts[i].first_index} + mesh.parts[i].index_count;
    }
    add(end, mesh.indices.size() - end, flags);
    return result;
}

}  // namespace

Expected<SimplifiedMesh> simplify(const Mesh& mesh, const SimplifyOptions& options) {
    if (!(options.ratio >= 0.0 && options.ratio <= 1.0) || !(options.max_error >= 0.0))
        return unexpected(makeError(ErrorCode::InvalidArgument, "simplify.options",
                                    "a ratio of {} (0 to 1 are allowed) and an error of {} (not negative)",
                                    options.ratio, options.max_error));
    if (mesh.indices.size() > UINT32_MAX || mesh.positions.size() > UINT32_MAX)
        return unexpected(makeError(ErrorCode::OutOfRange, "simplify.too_large",
                                    "{} positions and {} indices; at most {} are allowed", mesh.positions.size(),
                                    mesh.indices.size(), UINT32_MAX));
    if (Status status = mesh.validate(); !status) return unexpected(status.error());

    SimplifiedMesh best{mesh, {}};
    const auto attempt = [&](double ratio) {
        SimplifiedMesh tried{simplifyParts(mesh, ratio, options.keep_border), {}};
        if (tried.mesh.indices.empty()) return false;
        tried.distance = hausdorffDistance(mesh, tried.mesh);
        if (!(tried.distance.upper <= options.max_error)) return false;
        if (tried.mesh.indices.size() < best.mesh.indices.size()) best = std::move(tried);
        return true;
    };
    // The library's own error bounds nothing, so the ratio is searched for: bisection of its logarithm, to a fiftieth.
    if (!attempt(options.ratio)) {
        double low = std::max(options.ratio, 3.0 / static_cast<double>(mesh.indices.size())), high = 1.0;
        while (high / low > 1.02) {
            const double middle = std::sqrt(low * high);
            (attempt(middle) ? high : low) = middle;
        }
    }
    optimizeVertexFetch(best.mesh);
    return best;
}

}  // namespace glint
