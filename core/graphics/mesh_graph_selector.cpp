#include <glint/graphics/mesh_graph_selector.h>

#include <glint/base/format_error.h>

#include <algorithm>
#include <cmath>
#include <cstddef>

namespace glint {

namespace {

constexpr uint64_t entry_size = 8;
constexpr uint32_t least_capacity = 1u << 10;
/// Without having seen what is wanted, a list has room for no more: 8 MiB.
constexpr uint64_t first_capacity = 1u << 20;
/// Groups of a dispatch in one row.
constexpr uint64_t row = 32768;

/// The uniform block of shaders/meshes/select.h.
struct Parameters {
    CameraParameters camera;
    Vector2f size;
    float pixels = 0.0f;
    uint32_t cull = 0;
    uint32_t instances = 0;
    uint32_t pieces = 0;
    uint32_t capacity = 0;
    uint32_t reserved = 0;
};
static_assert(sizeof(Parameters) == 288);

/// The storage block of the same.
struct Count {
    uint32_t entries;
    uint32_t wanted;
    uint32_t triangles[2];
    uint32_t outside;
    uint32_t facing_away;
    uint32_t refused;
    uint32_t most;
};
static_assert(sizeof(Count) == 32);

bool isUsable(const CameraParameters& camera) {
    bool result = isFinite(Vector3f(camera.position));
    for (const Matrix4x4f& matrix : {camera.inverse_view, camera.projection})
        for (int i = 0; i < 4; i++) result = result && isFinite(Vector3f(matrix[i])) && std::isfinite(matrix[i].w);
    return result;
}

}  // namespace

struct MeshGraphSelector::State {
    Device device;
    Kernel kernel;
    uint32_t threads = 0;
    Buffer list, count;
    uint32_t capacity = 0;
    uint64_t wanted = 0;  ///< entries that there should be room for
    Statistics statistics;

    Status create(Where where);
    Status check(const MeshGraphModel& model, const Buffer& instances, uint32_t instance_count,
                 const CameraParameters& camera, const Vector2u& size, float pixels, Where where) const;
    Status reserve(uint64_t limit, Where where);
    Status record(Compute& compute, const MeshGraphModel& model, const Buffer& instances, uint32_t instance_count,
                  const CameraParameters& camera, const Vector2u& size, float pixels, Cull cull, Where where);
};

Status MeshGraphSelector::State::create(Where where) {
    // On CPUs a barrier costs for each subgroup.
    threads = device.getInfo().cpu ? 8 : 32;
    kernel = device.createKernel("select clusters", where);
    kernel.createShaderGLSL("#include <glint/meshes/select.h>\n",
                            fmt::format("MESH_GROUP={}u; MESH_PIECE={}u", threads, MeshGraphModel::piece_clusters),
                            where);
    if (Status status = kernel.create(where); !status) return status;
    const Count zero = {};
    count =
        device.createBuffer(Buffer::FlagStorage | Buffer::FlagIndirect, &zero, sizeof(zero), "clusters: count", where);
    return count ? Status() : Status(count.error());
}

Status MeshGraphSelector::State::check(const MeshGraphModel& model, const Buffer& instances, uint32_t instance_count,
                                       const CameraParameters& camera, const Vector2u& size, float pixels,
                                       Where where) const {
    if (!model) return model.error().at(where);
    if (!instances) return instances.error().at(where);
    // The negated comparison refuses NaN.
    if (!isUsable(camera) || size.x == 0 || size.y == 0 || !(pixels >= 0.0f))
        return makeError(where, ErrorCode::InvalidArgument, "selector.view",
                         "select: {}picture of {}x{}, {} pixels; the camera has to be finite, the sizes and the error "
                         "positive or, the error, 0",
                         isUsable(camera) ? "" : "a camera that is not finite, ", size.x, size.y, pixels);
    if (instances.getSize() / sizeof(Transform3x4) < instance_count)
        return makeError(where, ErrorCode::OutOfRange, "selector.instances",
                         "select: {} instances need {} bytes, buffer '{}' has {}", instance_count,
                         uint64_t{instance_count} * sizeof(Transform3x4), instances.name(), instances.getSize());
    const uint64_t groups = uint64_t{instance_count} * model.pieceCount();
    const uint64_t most_groups = row * device.getFeatures().maxGroupCountY;
    if (uint64_t{instance_count} * model.clusterCount() > UINT32_MAX || groups > most_groups)
        return makeError(where, ErrorCode::OutOfRange, "selector.too_many",
                         "select: {} instances of '{}' with {} clusters in {} pieces; at most {} clusters and {} "
                         "pieces are allowed",
                         instance_count, model.name(), model.clusterCount(), model.pieceCount(), UINT32_MAX,
                         most_groups);
    return {};
}

Status MeshGraphSelector::State::reserve(uint64_t limit, Where where) {
    const Features& features = device.getFeatures();
    const uint64_t most = std::min(features.maxStorageSize, features.maxBufferSize) / entry_size;
    const uint64_t next = std::min({std::max(wanted, std::min(limit, first_capacity)), most, uint64_t{UINT32_MAX}});
    if (next <= capacity && list) return {};
    capacity = static_cast<uint32_t>(std::max<uint64_t>(next, least_capacity));
    list = device.createBuffer(Buffer::FlagStorage, capacity * entry_size, "clusters: list", where);
    return list ? Status() : Status(list.error());
}

Status MeshGraphSelector::State::record(Compute& compute, const MeshGraphModel& model, const Buffer& instances,
                                        uint32_t instance_count, const CameraParameters& camera, const Vector2u& size,
                                        float pixels, Cull cull, Where where) {
    if (Status status = check(model, instances, instance_count, camera, size, pixels, where); !status) return status;
    if (Status status = reserve(uint64_t{instance_count} * model.cutLimit(), where); !status) return status;
    statistics.capacity = capacity;
    statistics.bytes = list.getSize();

    compute.pushRegion("select clusters", where);
    compute.clearBuffer(count, 0, 0, offsetof(Count, most), where);
    compute.setKernel(kernel, where);
    compute.setUniform(0, Parameters{.camera = camera,
                                     .size = Vector2f(size),
                                     .pixels = pixels,
                                     .cull = cull,
                                     .instances = instance_count,
                                     .pieces = model.pieceCount(),
                                     .capacity = capacity});
    compute.setStorageBuffers(
        0, {instances, model.getClusters(), model.getGroups(), model.getWalk(), model.getPieces(), list, count});
    const uint64_t groups = uint64_t{instance_count} * model.pieceCount();
    compute.dispatch(std::min(groups, row) * threads, (groups + row - 1) / row, 1, where);
    compute.popRegion(where);
    return {};
}

Status MeshGraphSelector::create(const Device& device, Where where) {
    state_ = nullptr;
    if (!device) return device.error().at(where);
    auto state = std::make_shared<State>();
    state->device = device;
    if (Status status = state->create(where); !status) return status;
    state_ = std::move(state);
    return {};
}

void MeshGraphSelector::select(Compute& compute, const MeshGraphModel& model, const Buffer& instances,
                               uint32_t instance_count, const CameraParameters& camera, const Vector2u& size,
                               float pixels, Cull cull, Where where) {
    const Status status =
        state_ ? state_->record(compute, model, instances, instance_count, camera, size, pixels, cull, where)
               : Status(makeError(where, ErrorCode::InvalidArgument, "handle.null",
                                  "MeshGraphSelector is used before create()"));
    if (!status) compute.fail(status.error());
}

Buffer MeshGraphSelector::getList() const { return state_ ? state_->list : Buffer(); }
Buffer MeshGraphSelector::getCount() const { return state_ ? state_->count : Buffer(); }
uint32_t MeshGraphSelector::getCapacity() const { return state_ ? state_->capacity : 0; }

Status MeshGraphSelector::check(Where where) {
    if (!state_)
        return makeError(where, ErrorCode::InvalidArgument, "handle.null", "MeshGraphSelector is used before create()");
    State& state = *state_;
    const auto words = state.device.read<Count>(state.count, 0, 1, where);
    if (!words) return words.error();
    const Count& found = words->front();
    state.statistics.clusters = found.wanted;
    state.statistics.triangles = found.triangles[0] | uint64_t{found.triangles[1]} << 32;
    state.statistics.outside = found.outside;
    state.statistics.facing_away = found.facing_away;
    state.statistics.refused = found.refused;
    state.device.clearBuffer(state.count, 0, offsetof(Count, most), sizeof(found.most), where);
    if (found.most <= state.capacity) return {};
    // A quarter more, since a camera that moves would make it grow with each frame.
    state.wanted = uint64_t{found.most} + found.most / 4;
    return makeError(where, ErrorCode::OutOfRange, "selector.capacity",
                     "the list of clusters needs {} entries, there was room for {}: clusters are missing", found.most,
                     state.capacity);
}

MeshGraphSelector::Statistics MeshGraphSelector::getStatistics() const {
    return state_ ? state_->statistics : Statistics();
}

}  // namespace glint
