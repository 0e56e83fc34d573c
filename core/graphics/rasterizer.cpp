#include <glint/graphics/rasterizer.h>

#include <glint/base/format_error.h>
#include <glint/graphics/mesh_graph_model.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <map>
#include <string>

namespace glint {

namespace {

using Where = Rasterizer::Where;

constexpr uint64_t large_size = 64;  ///< bytes of a place in the list of large triangles
constexpr uint32_t most_capacity = 1u << 22;
constexpr uint32_t unit = 256;  ///< fixed point's for each pixel
constexpr uint64_t entry_size = 8;

/// The uniform block of shaders/raster/common.h.
struct Frame {
    Matrix4x4f matrix;
    Vector2f scale;
    Vector2f guard;
    Vector2i middle;
    Vector2i size;
    uint32_t cull = 3;
    uint32_t first_id = 0;
    uint32_t triangles = 0;
    uint32_t vertices = 0;
    uint32_t position_first = 0;
    uint32_t position_stride = 0;
    uint32_t index_first = 0;
    uint32_t is_indexed = 0;
    uint32_t small_pixels = 0;
    uint32_t capacity = 0;
    uint32_t instances = 0;
    uint32_t clusters = 0;
    uint32_t entries = 0;
    uint32_t padding[3] = {};
};
static_assert(sizeof(Frame) == 160);

/// That of State there.
struct DeviceState {
    uint32_t taken[2];
    uint32_t cut;
    uint32_t clips;
    uint32_t missing;
    uint32_t polygons;
    uint32_t most_places;
    uint32_t most_clips;
    uint32_t is_crowded;
    uint32_t padding;
};
static_assert(sizeof(DeviceState) == 40);
constexpr uint64_t draw_state = offsetof(DeviceState, most_places);  ///< bytes that each draw begins with

uint64_t divideUp(uint64_t a, uint64_t b) { return a / b + (a % b != 0 ? 1 : 0); }

/// A range of a buffer as it can be bound, and where in it the range begins.
struct Binding {
    uint64_t offset = 0;
    uint64_t size = 0;
    uint32_t first = 0;  ///< word
};

uint32_t kept(Rasterizer::Cull cull) {
    return cull == Rasterizer::CullBack ? 1u : cull == Rasterizer::CullFront ? 2u : 3u;
}

bool isFinite(const Matrix4x4f& matrix) {
    for (int column = 0; column < 4; column++)
        for (int row = 0; row < 4; row++)
            if (!std::isfinite(matrix[column][row])) return false;
    return true;
}

}  // namespace

struct Rasterizer::State {
    Device device;
    Options options;
    bool is_cpu = false;
    bool is_wide = false;  ///< 64-bit atomics
    uint32_t capacity = 0;
    uint32_t wanted = 0;
    Vector2u size = {0, 0};
    std::map<std::string, Kernel, std::less<>> kernels;
    Buffer picture, larges, clips, state;
    Statistics statistics;

    /// What a kind of draw reads, and its first kernel.
    struct Source {
        const char* kernel = nullptr;
        uint32_t group = 0;
        uint64_t groups = 0;
        bool is_clusters = false;
        std::vector<std::pair<Buffer, Binding>> buffers;  ///< from slot 4 on
    };

    Status create(Where where);
    Expected<Kernel> kernel(std::string_view file, const std::string& macros, uint32_t group, Where where);
    Status begin(Compute& compute, const Vector2u& size, Where where);
    Status draw(Compute& compute, const Mesh& mesh, const Matrix4x4f& matrix, uint32_t first_id, Cull cull,
                Where where);
    Status drawClusters(Compute& compute, const MeshGraphModel& model, const Buffer& instances, const Buffer& list,
                        const Buffer& count, const CameraParameters& camera, Cull cull, Where where);
    Status record(Compute& compute, Frame frame, const Source& source, Where where);
    Status makeLists(uint32_t places, Where where);
    Status prepare(Frame& frame, const Matrix4x4f& matrix, Cull cull, Where where) const;
    Expected<Binding> bind(const char* id, const char* what, const Buffer& buffer, uint64_t offset, uint64_t least,
                           Where where) const;
};

Status Rasterizer::State::create(Where where) {
    const auto fail = [&](const char* what, uint64_t value, const char* range) {
        return makeError(where, ErrorCode::OutOfRange, "raster.options", "rasterizer: {} is {}, it has to be {}", what,
                         value, range);
    };
    if (options.output > OutputCounts) return fail("output", options.output, "one of Rasterizer::Output");
    if (options.capacity < 16 || options.capacity > most_capacity)
        return fail("capacity", options.capacity, "within 16 and 2^22");
    is_cpu = device.getInfo().cpu;
    if (!options.small_pixels) options.small_pixels = is_cpu ? 256 : 128;
    if (*options.small_pixels > 1024) return fail("small_pixels", *options.small_pixels, "at most 1024");
    is_wide = !options.narrow && device.getFeatures().has(FeatureAtomicBufferu64 | FeatureShaderu64);
    options.narrow = !is_wide;
    const DeviceState zero = {};
    state = device.createBuffer(Buffer::FlagStorage, &zero, sizeof(zero), "raster: state", where);
    if (!state) return state.error();
    return makeLists(options.capacity, where);
}

Status Rasterizer::State::makeLists(uint32_t places, Where where) {
    const Features& features = device.getFeatures();
    const uint64_t most = std::min(features.maxStorageSize, features.maxBufferSize) / large_size;
    places = static_cast<uint32_t>(std::min<uint64_t>({places, most, most_capacity}));
    if (places <= capacity) return {};
    const Buffer new_larges =
        device.createBuffer(Buffer::FlagStorage, places * large_size, "raster: large triangles", where);
    if (!new_larges) return new_larges.error();
    const Buffer new_clips = device.createBuffer(Buffer::FlagStorage, places * uint64_t{4}, "raster: cut", where);
    if (!new_clips) return new_clips.error();
    larges = new_larges;
    clips = new_clips;
    capacity = places;
    return {};
}

Expected<Kernel> Rasterizer::State::kernel(std::string_view file, const std::string& macros, uint32_t group,
                                           Where where) {
    const std::string key = fmt::format("{} {}", file, macros);
    if (const auto found = kernels.find(key); found != kernels.end()) return found->second;
    Kernel made = device.createKernel(fmt::format("raster: {}", file), where);
    made.createShaderGLSL(
        fmt::format("#include <glint/raster/{}.h>\n", file),
        fmt::format("GLINT_GROUP={}; GLINT_WIDE={}; GLINT_PEEK={}; {}", group, is_wide ? 1 : 0, is_cpu ? 0 : 1, macros),
        where);
    if (Status status = made.create(where); !status) return unexpected(status.error());
    return kernels.emplace(key, std::move(made)).first->second;
}

Status Rasterizer::State::begin(Compute& compute, const Vector2u& new_size, Where where) {
    const Features& features = device.getFeatures();
    const uint64_t bytes = uint64_t{new_size.x} * new_size.y * 8;
    const uint64_t most = std::min(features.maxStorageSize, features.maxBufferSize);
    if (new_size.x == 0 || new_size.y == 0 || new_size.x > max_size || new_size.y > max_size || bytes > most)
        return makeError(where, ErrorCode::OutOfRange, "raster.size",
                         "rasterizer: a picture of {}x{} pixels of 8 bytes; sides are 1 to {}, and {} binds {} bytes",
                         new_size.x, new_size.y, max_size, device.getInfo().name, most);
    if (wanted > capacity) {
        if (Status status = makeLists(wanted, where); !status) return status;
        wanted = 0;
    }
    if (!picture || picture.getSize() < bytes) {
        picture = device.createBuffer(Buffer::FlagStorage, bytes, "raster: picture", where);
        if (!picture) return picture.error();
    }
    size = new_size;
    statistics.capacity = capacity;
    statistics.memory = picture.getSize() + larges.getSize() + clips.getSize() + state.getSize();
    compute.clearBuffer(picture, 0, 0, bytes, where);
    return {};
}

Status Rasterizer::State::prepare(Frame& frame, const Matrix4x4f& matrix, Cull cull, Where where) const {
    if (!picture)
        return makeError(where, ErrorCode::InvalidArgument, "raster.begin",
                         "rasterizer: a draw before begin(), which says how large the picture is");
    if (!isFinite(matrix))
        return makeError(where, ErrorCode::InvalidArgument, "raster.matrix",
                         "rasterizer: the matrix to clip space has an element that is not finite");
    frame.matrix = matrix;
    frame.size = Vector2i(size);
    frame.middle = frame.size * static_cast<int>(unit / 2);
    frame.scale = Vector2f(frame.middle) * Vector2f(1, -1);
    // Fixed point holds 2^15 pixels either way from the middle.
    for (int axis = 0; axis < 2; axis++) frame.guard[axis] = static_cast<float>(std::bit_floor(65536u / size[axis]));
    frame.cull = kept(cull);
    frame.small_pixels = *options.small_pixels;
    frame.capacity = capacity;
    return {};
}

Expected<Binding> Rasterizer::State::bind(const char* id, const char* what, const Buffer& buffer, uint64_t offset,
                                          uint64_t least, Where where) const {
    if (!buffer) return unexpected(buffer.error().at(where));
    const Features& features = device.getFeatures();
    Binding binding;
    binding.offset = offset / features.storageAlignment * features.storageAlignment;
    binding.size = buffer.getSize() - std::min(buffer.getSize(), binding.offset);
    binding.first = static_cast<uint32_t>((offset - binding.offset) / 4);
    if (offset % 4 != 0 || offset > buffer.getSize() || buffer.getSize() - offset < least ||
        binding.size > features.maxStorageSize || (buffer.getFlags() & Buffer::FlagStorage) == 0)
        return unexpected(makeError(where, ErrorCode::InvalidArgument, id,
                                    "rasterizer: {}: {} bytes from byte {} of buffer '{}', which has {}{}; offsets are "
                                    "multiples of 4, and {} binds {} bytes",
                                    what, least, offset, buffer.name(), buffer.getSize(),
                                    (buffer.getFlags() & Buffer::FlagStorage) == 0 ? " and no FlagStorage" : "",
                                    device.getInfo().name, features.maxStorageSize));
    return binding;
}

Status Rasterizer::State::draw(Compute& compute, const Mesh& mesh, const Matrix4x4f& matrix, uint32_t first_id,
                               Cull cull, Where where) {
    Frame frame;
    if (Status status = prepare(frame, matrix, cull, where); !status) return status;
    if (uint64_t{first_id} + mesh.triangles > UINT32_MAX)
        return makeError(where, ErrorCode::OutOfRange, "raster.ids",
                         "rasterizer: {} triangles from number {} on; numbers are less than 2^32 - 1", mesh.triangles,
                         first_id);
    if (mesh.position_stride % 4 != 0 || mesh.position_stride < 12)
        return makeError(where, ErrorCode::InvalidArgument, "raster.mesh",
                         "rasterizer: a stride of {} bytes; it has to be a multiple of 4, and 12 or more",
                         mesh.position_stride);
    const auto positions = bind("raster.mesh", "positions", mesh.positions, mesh.position_offset, 12, where);
    if (!positions) return positions.error();
    const bool is_indexed = mesh.indices.state() != ObjectState::Null;
    const auto indices = is_indexed ? bind("raster.mesh", "indices", mesh.indices, mesh.index_offset,
                                           uint64_t{mesh.triangles} * 12, where)
                                    : positions;
    if (!indices) return indices.error();
    if (mesh.triangles == 0) return {};
    frame.first_id = first_id;
    frame.triangles = mesh.triangles;
    frame.vertices =
        static_cast<uint32_t>((mesh.positions.getSize() - mesh.position_offset - 12) / mesh.position_stride + 1);
    frame.position_first = positions->first;
    frame.position_stride = mesh.position_stride / 4;
    frame.index_first = indices->first;
    frame.is_indexed = is_indexed ? 1 : 0;
    Source source;
    source.kernel = "draw";
    source.group = 64;
    source.groups = divideUp(mesh.triangles, source.group);
    source.buffers = {{mesh.positions, *positions}, {is_indexed ? mesh.indices : mesh.positions, *indices}};
    return record(compute, frame, source, where);
}

Status Rasterizer::State::drawClusters(Compute& compute, const MeshGraphModel& model, const Buffer& instances,
                                       const Buffer& list, const Buffer& count, const CameraParameters& camera,
                                       Cull cull, Where where) {
    if (!model) return model.error().at(where);
    const Matrix4x4f matrix(Matrix4x4d(camera.projection) * Matrix4x4d(camera.view));
    Frame frame;
    if (Status status = prepare(frame, matrix, cull, where); !status) return status;
    Source source;
    const auto add = [&](const char* what, const Buffer& buffer, uint64_t least) -> Status {
        const auto binding = bind("raster.list", what, buffer, 0, least, where);
        if (!binding) return binding.error();
        source.buffers.emplace_back(buffer, *binding);
        return {};
    };
    for (const Buffer& buffer :
         {model.getPositions(), model.getClusters(), model.getClusterVertices(), model.getClusterTriangles()})
        if (Status status = add("the model", buffer, 4); !status) return status;
    if (Status status = add("instances", instances, sizeof(Transform3x4)); !status) return status;
    if (Status status = add("the list", list, entry_size); !status) return status;
    if (Status status = add("the count", count, 4); !status) return status;
    const uint64_t instance_count = instances.getSize() / sizeof(Transform3x4);
    if (instance_count * model.clusterCount() > UINT32_MAX / MeshCluster::max_triangles)
        return makeError(where, ErrorCode::OutOfRange, "raster.ids",
                         "rasterizer: {} instances of {} clusters of {} triangles; numbers are less than 2^32 - 1",
                         instance_count, model.clusterCount(), MeshCluster::max_triangles);
    frame.instances = static_cast<uint32_t>(instance_count);
    frame.clusters = model.clusterCount();
    frame.entries = static_cast<uint32_t>(std::min<uint64_t>(list.getSize() / entry_size, UINT32_MAX));
    source.kernel = "draw_clusters";
    source.group = is_cpu ? 8 : 64;
    source.groups = std::min<uint64_t>(frame.entries, is_cpu ? 256 : 8192);
    source.is_clusters = true;
    return record(compute, frame, source, where);
}

Status Rasterizer::State::record(Compute& compute, Frame frame, const Source& source, Where where) {
    struct Pass {
        const char* file;
        std::string macros;
        uint32_t group;
        uint64_t groups;
    };
    const auto tiles = [&](int output, int polygons) {
        return Pass{"tiles", fmt::format("GLINT_OUTPUT={}; GLINT_LIST=0; GLINT_POLYGONS={}", output, polygons),
                    is_cpu ? 8u : 64u, is_cpu ? 256u : 4096u};
    };
    const auto draw = [&](int output, int list) {
        return Pass{source.kernel, fmt::format("GLINT_OUTPUT={}; GLINT_LIST={}", output, list), source.group,
                    source.groups};
    };
    const int output = options.output == OutputCounts ? 3 : is_wide ? 0 : 1;
    std::vector<Pass> passes;
    passes.push_back(draw(output, 1));
    passes.push_back(
        {"clip", fmt::format("GLINT_OUTPUT={}; GLINT_LIST=1; GLINT_CLUSTERS={}", output, source.is_clusters ? 1 : 0),
         is_cpu ? 8u : 64u, is_cpu ? 32u : 256u});
    if (!is_wide) passes.push_back({"sums", fmt::format("GLINT_OUTPUT={}", output), is_cpu ? 8u : 256u, 1});
    passes.push_back(tiles(output, 0));
    passes.push_back(tiles(output, 1));
    if (output == 1) passes.insert(passes.end(), {draw(2, 0), tiles(2, 0), tiles(2, 1)});

    compute.clearBuffer(state, 0, 0, draw_state, where);
    for (const Pass& pass : passes) {
        const Expected<Kernel> kernel = this->kernel(pass.file, pass.macros, pass.group, where);
        if (!kernel) return kernel.error();
        compute.setKernel(*kernel, where);
        if (&pass == passes.data()) {
            // They stay for the other kernels, which have the same slots or fewer.
            compute.setUniform(0, frame);
            compute.setStorageBuffers(0, {state, picture, larges, clips});
            int slot = 4;
            for (const auto& [buffer, binding] : source.buffers)
                compute.setStorageBuffer(slot++, buffer, binding.offset, binding.size);
        }
        // In two dimensions where one has too few.
        constexpr uint64_t row = 32768;
        compute.dispatch(std::min(pass.groups, row) * pass.group, divideUp(pass.groups, row), 1, where);
    }
    return {};
}

Status Rasterizer::create(const Device& device, const Options& options, Where where) {
    state_ = nullptr;
    if (!device) return device.error().at(where);
    auto state = std::make_shared<State>();
    state->device = device;
    state->options = options;
    if (Status status = state->create(where); !status) return status;
    state_ = std::move(state);
    return {};
}

const Rasterizer::Options& Rasterizer::getOptions() const {
    static const Options none;
    return state_ ? state_->options : none;
}

namespace {

Error uncreated(Where where) {
    return makeError(where, ErrorCode::InvalidArgument, "handle.null", "Rasterizer is used before create()");
}

}  // namespace

void Rasterizer::begin(Compute& compute, const Vector2u& size, Where where) {
    const Status status = state_ ? state_->begin(compute, size, where) : Status(uncreated(where));
    if (!status) compute.fail(status.error());
}

void Rasterizer::draw(Compute& compute, const Mesh& mesh, const Matrix4x4f& clip_from_mesh, uint32_t first_id,
                      Cull cull, Where where) {
    const Status status =
        state_ ? state_->draw(compute, mesh, clip_from_mesh, first_id, cull, where) : Status(uncreated(where));
    if (!status) compute.fail(status.error());
}

void Rasterizer::drawClusters(Compute& compute, const MeshGraphModel& model, const Buffer& instances,
                              const Buffer& list, const Buffer& count, const CameraParameters& camera, Cull cull,
                              Where where) {
    const Status status = state_ ? state_->drawClusters(compute, model, instances, list, count, camera, cull, where)
                                 : Status(uncreated(where));
    if (!status) compute.fail(status.error());
}

Buffer Rasterizer::getVisibility() const { return state_ ? state_->picture : Buffer(); }

Vector2u Rasterizer::getSize() const { return state_ ? state_->size : Vector2u(0, 0); }

Status Rasterizer::check(Where where) {
    if (!state_) return uncreated(where);
    State& state = *state_;
    const auto words = state.device.read<DeviceState>(state.state, 0, 1, where);
    if (!words) return words.error();
    const DeviceState& found = words->front();
    state.statistics.large = found.most_places;
    state.statistics.clipped = found.most_clips;
    state.device.clearBuffer(state.state, 0, draw_state, sizeof(DeviceState) - draw_state, where);
    if (found.is_crowded != 0)
        return makeError(where, ErrorCode::OutOfRange, "raster.tiles",
                         "the large triangles of one draw touch 2^32 tiles or more: triangles are missing");
    const uint32_t most = std::max(found.most_places, found.most_clips);
    if (most <= state.capacity) return {};
    // A quarter more, since a camera that moves would make it grow with each frame.
    state.wanted = static_cast<uint32_t>(std::min<uint64_t>(uint64_t{most} + most / 4, most_capacity));
    return makeError(
        where, ErrorCode::OutOfRange, "raster.capacity",
        "{} large triangles and {} cut ones in one draw, there was room for {} each: triangles are missing",
        found.most_places, found.most_clips, state.capacity);
}

Rasterizer::Statistics Rasterizer::getStatistics() const { return state_ ? state_->statistics : Statistics(); }

}  // namespace glint
