#include <glint/graphics/splat_renderer.h>

#include <glint/base/format_error.h>
#include <glint/parallel/radix_sort.h>

#include <glm/geometric.hpp>
#include <glm/matrix.hpp>

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <map>
#include <string>

namespace glint {

namespace {

constexpr uint32_t block = 128;          ///< splats or entries of a group
constexpr uint64_t footprint_size = 32;  ///< bytes
constexpr uint64_t info_size = 8;
constexpr uint64_t key_size = 8;      ///< key and number
constexpr uint64_t scratch_size = 8;  ///< of RadixSort
constexpr uint32_t least_entries = 1u << 16;

/// The uniform block of shaders/splats/common.h.
struct Frame {
    Vector2f half_size;
    Vector2u size;
    Vector2u tiles;
    float log_cut = 0.0f;
    float stop = 0.0f;
    uint32_t room = 0;
    uint32_t capacity = 0;
    float low_pass = 0.0f;
    float near = 0.0f;
    uint32_t first_depth = 0;
    uint32_t last_key = 0;
    uint32_t antialiased = 0;
    uint32_t key_bits = 0;
};
static_assert(sizeof(Frame) == 64);

/// That of shaders/splats/project.h.
struct ChunkView {
    Vector4f rows[3];
    Vector4f eye_high;
    Vector4f eye_low;
    Vector2f focal;
    Vector2f limits;
    uint32_t first = 0;
    uint32_t count = 0;
    uint32_t reserved[2] = {};
};
static_assert(sizeof(ChunkView) == 112);

/// shaders/splats/state.h.
struct DeviceState {
    uint32_t splats[4];
    uint32_t entries[4];
    uint32_t splat_groups[4];
    uint32_t entry_groups[4];
    uint32_t wanted[2];
    uint32_t most[2];
};
static_assert(sizeof(DeviceState) == 80);

uint64_t wide(const uint32_t (&words)[2]) { return words[0] | uint64_t{words[1]} << 32; }

uint32_t divideUp(uint32_t a, uint32_t b) { return a / b + (a % b != 0 ? 1 : 0); }

bool isTile(uint32_t size) { return std::has_single_bit(size) && size >= 8 && size <= 64; }

Status checkOptions(const SplatRenderer::Options& options) {
    const auto fail = [](const char* what, double value, const char* range) {
        return makeError(ErrorCode::OutOfRange, "splats.options", "splat renderer: {} is {}, it has to be {}", what,
                         value, range);
    };
    if (options.threads != 0 &&
        !(std::has_single_bit(options.threads) && options.threads >= 8 && options.threads <= 256))
        return fail("threads", options.threads, "a power of two from 8 to 256");
    // The negated comparisons refuse NaN.
    if (options.tile_width != 0 || options.tile_height != 0) {
        if (!isTile(options.tile_width)) return fail("tile_width", options.tile_width, "8, 16, 32 or 64");
        if (!isTile(options.tile_height)) return fail("tile_height", options.tile_height, "8, 16, 32 or 64");
    }
    if (!(options.near > 0.0f && std::isfinite(options.near))) return fail("near", options.near, "positive");
    if (!(options.alpha_cut >= 1e-6f && options.alpha_cut <= 0.5f))
        return fail("alpha_cut", options.alpha_cut, "within 1e-6 and 0.5");
    if (!(options.transmittance_stop >= 0.0f && options.transmittance_stop <= 0.5f))
        return fail("transmittance_stop", options.transmittance_stop, "within 0 and 0.5");
    if (!(options.low_pass >= 0.01f && options.low_pass <= 100.0f))
        return fail("low_pass", options.low_pass, "within 0.01 and 100");
    return {};
}

/// The range of the bits of view depths, from the boxes of the centres, wider than the rounding of the depths: so that
/// sorts need no more bits than there are.
void setDepths(Frame& frame, float near, const Camera& camera, std::span<const SplatRenderer::Instance> instances) {
    double least = std::numeric_limits<double>::infinity(), most = near;
    for (const SplatRenderer::Instance& instance : instances) {
        if (instance.model.size() == 0) continue;
        const Matrix4x4d matrix = Matrix4x4d(camera.view()) * Matrix4x4d(instance.transform);
        const BoundBox& box = instance.model.getBounds();
        double low = -matrix[3][2], high = low, magnitude = std::abs(low);
        for (int axis = 0; axis < 3; axis++) {
            const double a = -matrix[axis][2] * box.min[axis], b = -matrix[axis][2] * box.max[axis];
            low += std::min(a, b);
            high += std::max(a, b);
            magnitude += std::max(std::abs(a), std::abs(b));
        }
        least = std::min(least, low - 1e-5 * magnitude);
        most = std::max(most, high + 1e-5 * magnitude);
    }
    const float largest = std::numeric_limits<float>::max();
    const auto bitsOf = [&](double depth) {
        return std::bit_cast<uint32_t>(static_cast<float>(std::clamp<double>(depth, near, largest)));
    };
    frame.first_depth = bitsOf(std::min(least, most));
    frame.last_key = bitsOf(most) - frame.first_depth;
    frame.key_bits = static_cast<uint32_t>(std::bit_width(std::max(frame.last_key, 1u)));
}

/// At least `groups` groups, in two dimensions where one has too few.
void dispatchGroups(Compute& compute, const Kernel& kernel, uint32_t groups, SplatRenderer::Where where) {
    constexpr uint32_t row = 32768;
    compute.dispatch(uint64_t{std::min(groups, row)} * kernel.getGroupSizeX(), divideUp(groups, row), 1, where);
}

}  // namespace

struct SplatRenderer::State {
    Device device;
    Options options;
    bool is_cpu = false;
    bool is_wide = false;     ///< the forms for GPUs
    uint32_t group = 0;       ///< threads of the passes that share sums
    uint32_t scan_group = 0;  ///< of the group that sums up the others
    std::map<std::string, Kernel, std::less<>> kernels;

    uint32_t room = 0;      ///< splats
    uint32_t capacity = 0;  ///< entries
    uint64_t wanted = 0;    ///< entries that there should be room for
    uint32_t tiles = 0;
    Buffer footprints, infos, sums, keys, entries, ranges, state;
    RadixSort splat_sort, entry_sort;
    std::array<Query, PassCount> queries;
    Statistics statistics;

    Status create(Where where);
    Expected<Kernel> kernel(std::string_view file, const std::string& macros, Where where);
    Status reserve(uint64_t splats, uint32_t tiles, Where where);
    Status check(std::span<const Instance> instances, const Outputs& outputs, Where where) const;
    Status record(Compute& compute, const Camera& camera, std::span<const Instance> instances, const Outputs& outputs,
                  Where where);
    Status project(Compute& compute, const Camera& camera, std::span<const Instance> instances, const Frame& frame,
                   Where where);
    Status sort(Compute& compute, const Frame& frame, Where where);
    Status scatter(Compute& compute, const Frame& frame, Where where);
    Status gather(Compute& compute, const Frame& frame, Where where);
    Status blend(Compute& compute, const Frame& frame, const Outputs& outputs, Where where);
};

Status SplatRenderer::State::create(Where where) {
    const Features& features = device.getFeatures();
    is_cpu = device.getInfo().cpu;
    if (options.tile_width == 0) {
        // By measurement: CPUs skip what is empty of larger tiles and sort fewer entries for them.
        options.tile_width = is_cpu && options.method == MethodTiles ? 32 : 16;
        options.tile_height = 16;
    }
    options.max_degree = std::min(options.max_degree, Splats::max_degree);
    const uint32_t pixels = options.tile_width * options.tile_height;
    if (options.threads == 0)
        options.threads = options.method == MethodPlain ? std::min(pixels, 256u)
                          : is_cpu                      ? std::max(pixels / 64, 8u)
                                                        : 4 * std::max(options.tile_width, 16u);
    if (options.threads > std::min(pixels, features.maxGroupThreads) || options.threads < pixels / 64)
        return makeError(where, ErrorCode::OutOfRange, "splats.options",
                         "splat renderer: {} threads for the {} pixels of a tile; there have to be {} to {}",
                         options.threads, pixels, std::max(pixels / 64, 8u),
                         std::min({pixels, features.maxGroupThreads, 256u}));
    if (options.method == MethodTiles && options.threads >= 32 && options.threads < 4 * options.tile_width)
        return makeError(where, ErrorCode::OutOfRange, "splats.options",
                         "splat renderer: {} threads for a tile {} pixels wide; from 32 on there have to be four for "
                         "each column",
                         options.threads, options.tile_width);
    // On CPUs a barrier costs for each subgroup.
    is_wide = options.method == MethodTiles ? options.threads >= 32 : !is_cpu;
    group = is_wide ? block : 8;
    scan_group = is_wide ? std::min(std::bit_floor(features.maxGroupThreads), 1024u) : 8;
    if (options.timed) {
        if (!features.has(FeatureTimestamps))
            return makeError(where, ErrorCode::Unsupported, "device.unsupported", "{} lacks {}", device.getInfo().name,
                             featureNames(FeatureTimestamps));
        for (Query& query : queries) {
            query = device.createQuery(Query::TypeTime, "splats", where);
            if (!query) return query.error();
        }
    }
    const DeviceState zero = {};
    state =
        device.createBuffer(Buffer::FlagStorage | Buffer::FlagIndirect, &zero, sizeof(zero), "splats: state", where);
    return state ? Status() : Status(state.error());
}

Expected<Kernel> SplatRenderer::State::kernel(std::string_view file, const std::string& macros, Where where) {
    const std::string all =
        fmt::format("GLINT_BLOCK={}u; GLINT_TILE_X={}u; GLINT_TILE_Y={}u; GLINT_PLAIN={}; {}", block,
                    options.tile_width, options.tile_height, options.method == MethodPlain ? 1 : 0, macros);
    const std::string key = fmt::format("{} {}", file, macros);
    if (const auto found = kernels.find(key); found != kernels.end()) return found->second;
    Kernel made = device.createKernel(fmt::format("splats: {}", file), where);
    made.createShaderGLSL(fmt::format("#include <glint/splats/{}.h>\n", file), all, where);
    if (Status status = made.create(where); !status) return unexpected(status.error());
    return kernels.emplace(key, std::move(made)).first->second;
}

Status SplatRenderer::State::reserve(uint64_t splats, uint32_t new_tiles, Where where) {
    const Features& features = device.getFeatures();
    const uint64_t most_bytes = std::min(features.maxStorageSize, features.maxBufferSize);
    const uint64_t most_splats = std::min<uint64_t>(most_bytes / footprint_size, UINT32_MAX / 2);
    if (splats > most_splats)
        return makeError(where, ErrorCode::OutOfRange, "splats.too_many", "{} splats in one draw; {} sorts at most {}",
                         splats, device.getInfo().name, most_splats);
    const auto make = [&](Buffer& buffer, uint64_t size, const char* name) {
        buffer = device.createBuffer(Buffer::FlagStorage, size, name, where);
        return buffer ? Status() : Status(buffer.error());
    };
    if (splats > room || room == 0) {
        room = static_cast<uint32_t>(std::max<uint64_t>(splats, 1));
        if (Status status = make(footprints, room * footprint_size, "splats: footprints"); !status) return status;
        if (Status status = make(infos, room * info_size, "splats: infos"); !status) return status;
        if (Status status = make(keys, room * key_size, "splats: order"); !status) return status;
        if (Status status = make(sums, uint64_t{divideUp(room, block)} * 4, "splats: sums"); !status) return status;
        if (Status status = splat_sort.create(device, RadixSort::FlagSingle, room, 0, 1, where); !status) return status;
    }
    const uint64_t most_entries = std::min<uint64_t>(most_bytes / key_size, UINT32_MAX / 2);
    if (capacity == 0) wanted = std::max<uint64_t>({wanted, 4 * splats, least_entries});
    if (const uint64_t next = std::min(wanted, most_entries); next > capacity) {
        capacity = static_cast<uint32_t>(next);
        if (Status status = make(entries, capacity * key_size, "splats: entries"); !status) return status;
        if (Status status = entry_sort.create(device, RadixSort::FlagSingle, capacity, 0, 1, where); !status)
            return status;
    }
    if (new_tiles > tiles) {
        tiles = new_tiles;
        if (Status status = make(ranges, uint64_t{tiles} * 8, "splats: ranges"); !status) return status;
    }
    statistics.splats = splats;
    statistics.capacity = capacity;
    const uint64_t fixed = footprints.getSize() + infos.getSize() + keys.getSize() + sums.getSize() +
                           room * scratch_size + state.getSize();
    statistics.memory = fixed + entries.getSize() + capacity * scratch_size + ranges.getSize();
    statistics.bytes_per_splat = static_cast<double>(fixed) / room;
    return {};
}

Status SplatRenderer::State::check(std::span<const Instance> instances, const Outputs& outputs, Where where) const {
    const auto checkTexture = [&](const char* what, const Texture& texture, std::initializer_list<Format> formats) {
        if (!texture) return Status(texture.error().at(where));
        const bool is_format = std::find(formats.begin(), formats.end(), texture.getFormat()) != formats.end();
        if (is_format && texture.getType() == Texture::Type2D && (texture.getFlags() & Texture::FlagSurface) != 0 &&
            texture.getWidth() == outputs.color.getWidth() && texture.getHeight() == outputs.color.getHeight())
            return Status();
        return Status(makeError(where, ErrorCode::InvalidArgument, "splats.output",
                                "splat renderer: {} '{}' is {} of {}x{}{}; it has to be {} of {}x{} with FlagSurface",
                                what, texture.name(), formatInfo(texture.getFormat()).name, texture.getWidth(),
                                texture.getHeight(),
                                (texture.getFlags() & Texture::FlagSurface) != 0 ? "" : " without FlagSurface",
                                formats.size() > 1 ? "RGBAu8n, RGBAf16 or RGBAf32" : "Rf32", outputs.color.getWidth(),
                                outputs.color.getHeight()));
    };
    Status status = checkTexture("color", outputs.color, {FormatRGBAu8n, FormatRGBAf16, FormatRGBAf32});
    if (status && outputs.depth.state() != ObjectState::Null)
        status = checkTexture("depth", outputs.depth, {FormatRf32});
    if (status && outputs.transmittance.state() != ObjectState::Null)
        status = checkTexture("transmittance", outputs.transmittance, {FormatRf32});
    if (!status) return status;
    for (size_t i = 0; i < instances.size(); i++) {
        const Instance& instance = instances[i];
        if (!instance.model) return instance.model.error().at(where);
        const Matrix4x4d m(instance.transform);
        const double volume = std::abs(glm::determinant(m));
        if (!(volume > 0.0 && std::isfinite(volume)) || m[0][3] != 0 || m[1][3] != 0 || m[2][3] != 0 || m[3][3] != 1)
            return makeError(where, ErrorCode::InvalidArgument, "splats.transform",
                             "the transform of instance {} is not affine, not finite, or makes a plane, a line or a "
                             "point of its splats",
                             i);
    }
    return {};
}

Status SplatRenderer::State::record(Compute& compute, const Camera& camera, std::span<const Instance> instances,
                                    const Outputs& outputs, Where where) {
    if (Status status = check(instances, outputs, where); !status) return status;
    uint64_t splats = 0;
    for (const Instance& instance : instances) splats += instance.model.size();

    Frame frame;
    frame.size = {outputs.color.getWidth(), outputs.color.getHeight()};
    frame.half_size = Vector2f(frame.size) * 0.5f;
    frame.tiles = {divideUp(frame.size.x, options.tile_width), divideUp(frame.size.y, options.tile_height)};
    if (Status status = reserve(splats, frame.tiles.x * frame.tiles.y, where); !status) return status;
    frame.log_cut = std::log2(options.alpha_cut);
    frame.stop = options.transmittance_stop;
    frame.room = room;
    frame.capacity = capacity;
    frame.low_pass = options.low_pass;
    frame.near = options.near;
    setDepths(frame, options.near, camera, instances);
    frame.antialiased = options.antialiased ? 1 : 0;

    const auto pass = [&](Pass which, auto&& play) {
        compute.pushRegion(toString(which), where);
        if (options.timed) compute.beginQuery(queries[which], where);
        const Status status = play();
        if (options.timed) compute.endQuery(queries[which], where);
        compute.popRegion(where);
        return status;
    };
    Status status = pass(PassProject, [&] { return project(compute, camera, instances, frame, where); });
    if (status) status = pass(PassSort, [&] { return sort(compute, frame, where); });
    if (status) status = pass(PassScatter, [&] { return scatter(compute, frame, where); });
    if (status) status = pass(PassGather, [&] { return gather(compute, frame, where); });
    if (status) status = pass(PassBlend, [&] { return blend(compute, frame, outputs, where); });
    return status;
}

Status SplatRenderer::State::project(Compute& compute, const Camera& camera, std::span<const Instance> instances,
                                     const Frame& frame, Where where) {
    const Matrix4x4f projection = camera.projection();
    ChunkView view;
    view.focal = Vector2f(projection[0][0], projection[1][1]) * frame.half_size;
    view.limits = {1.3f / projection[0][0], 1.3f / projection[1][1]};
    for (const Instance& instance : instances) {
        const Matrix4x4d matrix = Matrix4x4d(camera.view()) * Matrix4x4d(instance.transform);
        const Vector3d eye = -(glm::inverse(glm::dmat3(matrix)) * Vector3d(matrix[3]));
        for (int row = 0; row < 3; row++) view.rows[row] = {matrix[0][row], matrix[1][row], matrix[2][row], 0};
        view.eye_high = Vector4f(Vector3f(eye), 0.0f);
        view.eye_low = Vector4f(Vector3f(eye - Vector3d(Vector3f(eye))), 0.0f);

        const SplatModel& model = instance.model;
        const std::string macros = fmt::format("GLINT_GROUP={}; GLINT_HALF={}; GLINT_DEGREE={}", 64,
                                               model.getStorage() == SplatModel::StorageHalf ? 1 : 0,
                                               std::min(model.getDegree(), options.max_degree));
        const Expected<Kernel> kernel = this->kernel("project", macros, where);
        if (!kernel) return kernel.error();
        compute.setKernel(*kernel);
        compute.setUniform(0, frame);
        for (const SplatModel::Chunk& chunk : model.getChunks()) {
            view.count = chunk.size;
            compute.setUniform(1, view);
            compute.setStorageBuffers(0, {chunk.buffer, footprints, infos});
            dispatchGroups(compute, *kernel, divideUp(chunk.size, 64), where);
            view.first += chunk.size;
        }
    }
    return {};
}

Status SplatRenderer::State::sort(Compute& compute, const Frame& frame, Where where) {
    const auto splats = static_cast<uint32_t>(statistics.splats);
    const uint32_t blocks = divideUp(splats, block);
    const auto select = [&](uint32_t stage) -> Status {
        const Expected<Kernel> kernel =
            this->kernel("select", fmt::format("GLINT_GROUP={}; GLINT_STAGE={}", group, stage), where);
        if (!kernel) return kernel.error();
        compute.setKernel(*kernel);
        compute.setUniform(0, frame);
        compute.setStorageBuffers(0, {infos, sums});
        if (stage == 1) compute.setStorageBuffer(2, keys);
        compute.setPushConstants(splats, where);
        dispatchGroups(compute, *kernel, blocks, where);
        return {};
    };
    if (Status status = select(0); !status) return status;
    const Expected<Kernel> scan = kernel("scan", fmt::format("GLINT_GROUP={}; GLINT_STAGE=0", scan_group), where);
    if (!scan) return scan.error();
    compute.setKernel(*scan);
    compute.setUniform(0, frame);
    compute.setStorageBuffers(0, {sums, state});
    compute.setPushConstants(blocks, where);
    compute.dispatch(scan_group, 1, 1, where);
    if (Status status = select(1); !status) return status;
    splat_sort.dispatchIndirect(compute, keys, state, offsetof(DeviceState, splats), frame.key_bits, where);
    return {};
}

Status SplatRenderer::State::scatter(Compute& compute, const Frame& frame, Where where) {
    const auto play = [&](uint32_t stage) -> Status {
        const Expected<Kernel> kernel = this->kernel(
            "scatter", fmt::format("GLINT_GROUP={}; GLINT_STAGE={}; GLINT_WIDE={}", group, stage, is_wide ? 1 : 0),
            where);
        if (!kernel) return kernel.error();
        compute.setKernel(*kernel);
        compute.setUniform(0, frame);
        compute.setStorageBuffers(0, {footprints, state, infos, keys, sums});
        if (stage == 1) compute.setStorageBuffer(5, entries);
        compute.dispatchIndirect(state, offsetof(DeviceState, splat_groups), where);
        return {};
    };
    if (Status status = play(0); !status) return status;
    const Expected<Kernel> scan = kernel("scan", fmt::format("GLINT_GROUP={}; GLINT_STAGE=1", scan_group), where);
    if (!scan) return scan.error();
    compute.setKernel(*scan);
    compute.setUniform(0, frame);
    compute.setStorageBuffers(0, {sums, state});
    compute.setPushConstants(uint32_t{0}, where);
    compute.dispatch(scan_group, 1, 1, where);
    return play(1);
}

Status SplatRenderer::State::gather(Compute& compute, const Frame& frame, Where where) {
    // One value more than there are tiles: that of no tile.
    const auto bits = static_cast<uint32_t>(std::bit_width(frame.tiles.x * frame.tiles.y));
    entry_sort.dispatchIndirect(compute, entries, state, offsetof(DeviceState, entries), bits, where);
    const Expected<Kernel> kernel = this->kernel("ranges", "", where);
    if (!kernel) return kernel.error();
    compute.clearBuffer(ranges, 0, 0, 0, where);
    compute.setKernel(*kernel);
    compute.setUniform(0, frame);
    compute.setStorageBuffers(0, {state, entries, ranges});
    compute.dispatchIndirect(state, offsetof(DeviceState, entry_groups), where);
    return {};
}

Status SplatRenderer::State::blend(Compute& compute, const Frame& frame, const Outputs& outputs, Where where) {
    const bool has_depth = static_cast<bool>(outputs.depth), has_rest = static_cast<bool>(outputs.transmittance);
    const bool is_shared = is_wide && options.method == MethodTiles;
    const uint32_t columns = is_shared ? 1 : std::max(options.tile_width / options.threads, 1u);
    const uint32_t rows = options.tile_width * options.tile_height / options.threads / columns;
    const Expected<Kernel> kernel = this->kernel(
        "blend",
        fmt::format("GLINT_GROUP={}; GLINT_COLUMNS={}; GLINT_ROWS={}; GLINT_SHARED={}; GLINT_DEPTH={}; "
                    "GLINT_TRANSMITTANCE={}",
                    options.threads, columns, rows, is_shared ? 1 : 0, has_depth ? 1 : 0, has_rest ? 1 : 0),
        where);
    if (!kernel) return kernel.error();
    compute.setKernel(*kernel);
    compute.setUniform(0, frame);
    compute.setStorageBuffers(0, {footprints, ranges, entries});
    if (has_depth) compute.setStorageBuffer(3, infos);
    compute.setSurfaceTexture(0, outputs.color);
    if (has_depth) compute.setSurfaceTexture(1, outputs.depth);
    if (has_rest) compute.setSurfaceTexture(has_depth ? 2 : 1, outputs.transmittance);
    dispatchGroups(compute, *kernel, frame.tiles.x * frame.tiles.y, where);
    return {};
}

const char* SplatRenderer::toString(Pass pass) {
    constexpr const char* names[] = {"project", "sort", "scatter", "gather", "blend"};
    return pass < PassCount ? names[pass] : "unknown";
}

Status SplatRenderer::create(const Device& device, const Options& options, Where where) {
    state_ = nullptr;
    if (!device) return device.error().at(where);
    if (Status status = checkOptions(options); !status) return status.error().at(where);
    auto state = std::make_shared<State>();
    state->device = device;
    state->options = options;
    if (Status status = state->create(where); !status) return status;
    state_ = std::move(state);
    return {};
}

const SplatRenderer::Options& SplatRenderer::getOptions() const {
    static const Options none;
    return state_ ? state_->options : none;
}

void SplatRenderer::draw(Compute& compute, const Camera& camera, std::span<const Instance> instances,
                         const Outputs& outputs, Where where) {
    const Status status = state_ ? state_->record(compute, camera, instances, outputs, where)
                                 : Status(makeError(where, ErrorCode::InvalidArgument, "handle.null",
                                                    "SplatRenderer is used before create()"));
    if (!status) compute.fail(status.error());
}

Status SplatRenderer::check(Where where) {
    if (!state_)
        return makeError(where, ErrorCode::InvalidArgument, "handle.null", "SplatRenderer is used before create()");
    State& state = *state_;
    const auto words = state.device.read<DeviceState>(state.state, 0, 1, where);
    if (!words) return words.error();
    const DeviceState& found = words->front();
    state.statistics.visible = found.splats[2];
    state.statistics.entries = wide(found.wanted);
    const uint64_t most = wide(found.most);
    state.device.clearBuffer(state.state, 0, offsetof(DeviceState, most), sizeof(found.most), where);
    if (most <= state.capacity) return {};
    // A quarter more, since a camera that moves would make it grow with each frame.
    state.wanted = most + most / 4;
    return makeError(where, ErrorCode::OutOfRange, "splats.capacity",
                     "the lists of the tiles need {} entries, there was room for {}: the farthest splats are missing",
                     most, state.capacity);
}

SplatRenderer::Statistics SplatRenderer::getStatistics() const { return state_ ? state_->statistics : Statistics(); }

Expected<std::array<uint64_t, SplatRenderer::PassCount>> SplatRenderer::getTimes(Where where) const {
    if (!state_ || !state_->options.timed)
        return unexpected(makeError(where, ErrorCode::InvalidArgument, "splats.options",
                                    "the splat renderer was not created to take times"));
    std::array<uint64_t, PassCount> times = {};
    for (size_t i = 0; i < PassCount; i++) {
        const Expected<uint64_t> time = state_->device.getTime(state_->queries[i], where);
        if (!time) return unexpected(time.error());
        times[i] = *time;
    }
    return times;
}

}  // namespace glint
