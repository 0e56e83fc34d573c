#include <glint/tracing/detail/device_build.h>

#include <glint/base/format_error.h>
#include <glint/tracing/detail/node.h>
#include <glint/tracing/detail/primitives.h>

#include <algorithm>
#include <bit>

namespace glint::detail {

namespace {

// As in shaders/tracing/build.
constexpr uint32_t group_size = 64;
constexpr uint32_t state_words = 256;
constexpr uint32_t sort_tile = group_size * 32;
constexpr uint32_t scan_tile = group_size * 16;
constexpr uint32_t digits = 64;
constexpr uint32_t digit_bits = 6;
constexpr uint32_t code_bits = 30;
constexpr uint32_t max_threads = 1u << 20;

/// A source's name below shaders/tracing/build, and the macro that tells it from others of that name.
struct Program {
    const char* name;
    const char* macros;
    bool heap;
};

const Program& program(BuildKernel kernel) {
    static constexpr Program programs[build_kernels] = {
        {"begin", "", false},
        {"boxes", "#define GLINT_BUILD_INPUT 0\n", false},
        {"boxes", "#define GLINT_BUILD_INPUT 1\n", false},
        {"instances", "", true},
        {"codes", "", false},
        {"sort", "#define GLINT_BUILD_SORT 0\n", false},
        {"sort", "#define GLINT_BUILD_SORT 1\n", false},
        {"sort", "#define GLINT_BUILD_SORT 2\n", false},
        {"tree", "", false},
        {"collapse", "", false},
        {"scan", "#define GLINT_BUILD_SCAN 0\n", false},
        {"scan", "#define GLINT_BUILD_SCAN 1\n", false},
        {"place", "", false},
        {"header", "#define GLINT_BUILD_REFIT 0\n", true},
        {"nodes", "", true},
        {"records", "#define GLINT_BUILD_INPUT 0\n#define GLINT_BUILD_REFIT 0\n", true},
        {"records", "#define GLINT_BUILD_INPUT 1\n#define GLINT_BUILD_REFIT 0\n", true},
        {"refit", "#define GLINT_BUILD_REFIT 0\n", true},
        {"refit", "#define GLINT_BUILD_REFIT 1\n", true},
        {"records", "#define GLINT_BUILD_INPUT 0\n#define GLINT_BUILD_REFIT 1\n", true},
        {"records", "#define GLINT_BUILD_INPUT 1\n#define GLINT_BUILD_REFIT 1\n", true},
        {"header", "#define GLINT_BUILD_REFIT 1\n", true},
        {"refit", "#define GLINT_BUILD_REFIT 2\n", true},
    };
    return programs[static_cast<uint32_t>(kernel)];
}

constexpr uint32_t widthOf(NodeForm form) { return form == NodeForm::Packed ? Node::width : FullNode::width; }
/// By how many binary levels a node lowers the height if it opens its highest children.
constexpr uint32_t heightPerLevel(NodeForm form) { return std::bit_width(widthOf(form)) - 1; }

uint32_t tiles(uint32_t count, uint32_t size) { return (count + size - 1) / size; }

class Planner {
public:
    Planner(const DeviceInput& input, uint32_t primitives, uint32_t texel, uint32_t alignment)
        : input_(input), primitives_(primitives), alignment_(alignment) {
        common_.hierarchy = texel;
        common_.kind = static_cast<uint32_t>(input.kind);
        common_.primitives = primitives;
    }

    /// Room in scratch memory for some words for each primitive.
    uint32_t take(uint64_t words) {
        const auto place = static_cast<uint32_t>(words_);
        words_ += (words + 3) / 4 * 4;
        return place;
    }

    BuildPlan build(uint32_t nodes) {
        const uint32_t sort_tiles = tiles(primitives_, sort_tile);
        const uint32_t scan_tiles = tiles(primitives_, scan_tile);
        common_.boxes = take(6 * uint64_t(primitives_));
        uint32_t keys = take(2 * std::max<uint64_t>(primitives_, 1));
        uint32_t other = take(2 * std::max<uint64_t>(primitives_, 1));
        common_.nodes = take(16 * std::max<uint64_t>(primitives_, 1));
        common_.list = take(nodes);
        common_.counts = take(std::max(digits * uint64_t(sort_tiles), 2 * uint64_t(scan_tiles)));
        common_.tie_bits = static_cast<uint32_t>(std::bit_width(std::max(primitives_, 1u) - 1));
        common_.levels = tiles(code_bits + common_.tie_bits, heightPerLevel(input_.form));
        if (input_.kind == Hierarchy::Kind::Instances)
            common_.instances = texelsOf(input_.form) * (nodes + 1) + 3 * primitives_;

        add(BuildKernel::Begin, state_words);
        addBoxes();
        if (primitives_ > 0) {
            common_.keys_out = keys;
            add(BuildKernel::Codes, primitives_);
            common_.count = sort_tiles;
            for (common_.step = 0; common_.step < code_bits; common_.step += digit_bits) {
                common_.keys = keys;
                common_.keys_out = other;
                addGroups(BuildKernel::SortCount, sort_tiles);
                addGroups(BuildKernel::SortScan, digits);
                addGroups(BuildKernel::SortScatter, sort_tiles);
                std::swap(keys, other);
            }
        }
        common_.keys = keys;
        // What the last pass has read from is free.
        common_.sums = other;
        add(BuildKernel::Tree, primitives_);
        if (primitives_ > 1) {
            for (common_.step = 0; common_.step < common_.levels; common_.step++)
                add(BuildKernel::Collapse, std::min(nodes, levelThreads(common_.step * heightPerLevel(input_.form))));
            common_.count = scan_tiles;
            addGroups(BuildKernel::ScanSum, scan_tiles);
            addGroups(BuildKernel::SortScan, 2);
            addGroups(BuildKernel::ScanApply, scan_tiles);
        }
        add(BuildKernel::Place, primitives_);
        add(BuildKernel::Header, 1);
        add(BuildKernel::Nodes, nodes);
        addRecords(BuildKernel::TriangleRecords, BuildKernel::BoxRecords, false);
        return finish();
    }

    BuildPlan refit(uint32_t nodes) {
        const bool one = input_.geometries.size() == 1;
        if (input_.kind == Hierarchy::Kind::Instances) common_.boxes = take(6 * uint64_t(primitives_));
        if (!one) common_.keys = take(2 * uint64_t(primitives_));
        common_.nodes = take(8 * uint64_t(nodes));
        common_.count = one ? 0 : primitives_;
        add(BuildKernel::Begin, std::max(state_words, common_.count));
        if (input_.kind == Hierarchy::Kind::Instances) addBoxes();
        add(BuildKernel::RefitParents, nodes);
        if (!one) add(BuildKernel::RefitPlaces, primitives_);
        addRecords(BuildKernel::RefitTriangles, BuildKernel::RefitBoxes, one);
        add(BuildKernel::RefitHeader, 1);
        add(BuildKernel::RefitNodes, nodes);
        return finish();
    }

private:
    /// Threads for a level of nodes, below so many binary levels. How many nodes it has is not known here: the first
    /// levels have up to as many times those of the one above as a node has children; the last ones are seldom reached,
    /// and each thread takes several if they are.
    static uint32_t levelThreads(uint32_t height) { return height <= 27 ? 1u << std::min(height, 16u) : 1u << 12; }

    BuildPass& add(BuildKernel kernel, uint32_t threads) {
        BuildPass& pass = plan_.passes.emplace_back();
        pass.kernel = kernel;
        pass.threads = std::clamp(threads, 1u, max_threads);
        pass.constants = common_;
        return pass;
    }
    void addGroups(BuildKernel kernel, uint32_t groups) { add(kernel, 1).threads = groups * group_size; }

    /// A binding that begins at `offset` or up to an alignment before it. Returns by how many bytes.
    uint32_t bind(BuildPass& pass, BuildBinding::Buffer buffer, uint32_t geometry, uint64_t offset, uint64_t size) {
        const auto rest = static_cast<uint32_t>(offset % alignment_);
        pass.inputs[pass.input_count++] = {buffer, geometry, offset - rest, (rest + size + 3) / 4 * 4};
        return rest;
    }

    /// A pass over one geometry.
    void addGeometry(BuildKernel kernel, uint32_t g, uint32_t first, bool gathers) {
        const DeviceGeometry& geometry = input_.geometries[g];
        BuildPass& pass = add(kernel, geometry.primitives);
        BuildConstants& constants = pass.constants;
        constants.count = gathers ? 0 : geometry.primitives;
        constants.first = first;
        constants.geometry = g | (geometry.opaque ? Record::opaque_bit : 0);
        if (input_.kind == Hierarchy::Kind::Instances && kernel != BuildKernel::InstanceBoxes) {
            // The boxes that the pass before has made.
            constants.data = 0;
            constants.stride = 6;
            constants.geometry = Record::opaque_bit;
            bind(pass, BuildBinding::Buffer::Scratch, 0, 4 * uint64_t(common_.boxes), 24 * uint64_t(primitives_));
            return;
        }
        const bool triangles = input_.kind == Hierarchy::Kind::Triangles;
        const uint32_t elements = triangles ? geometry.vertices : geometry.primitives;
        const uint32_t element_size = triangles ? 12 : input_.kind == Hierarchy::Kind::Boxes ? 24 : 64;
        const uint64_t size = elements == 0 ? 4 : (elements - 1) * uint64_t(geometry.stride) + element_size;
        constants.data = bind(pass, BuildBinding::Buffer::Data, g, geometry.offset, size) / 4;
        constants.stride = geometry.stride / 4;
        constants.vertices = geometry.vertices;
        if (!triangles) return;
        if (geometry.index == TriangleGeometry::Index::None) {
            // Something has to be bound.
            bind(pass, BuildBinding::Buffer::Data, g, geometry.offset, size);
            return;
        }
        constants.index_size = geometry.index == TriangleGeometry::Index::Uint16 ? 1 : 2;
        const uint64_t bytes = 6 * uint64_t(constants.index_size) * geometry.primitives;
        constants.index = bind(pass, BuildBinding::Buffer::Indices, g, geometry.index_offset, bytes) / 2;
    }

    void addGeometries(BuildKernel kernel, bool gathers) {
        uint32_t first = 0;
        for (uint32_t g = 0; g < input_.geometries.size(); g++) {
            const uint32_t count = input_.geometries[g].primitives;
            if (count > 0) addGeometry(kernel, g, first, gathers);
            first += count;
        }
    }

    void addBoxes() {
        const BuildKernel kernels[] = {BuildKernel::TriangleBoxes, BuildKernel::BoxBoxes, BuildKernel::InstanceBoxes};
        addGeometries(kernels[static_cast<uint32_t>(input_.kind)], false);
    }
    void addRecords(BuildKernel triangles, BuildKernel boxes, bool gathers) {
        addGeometries(input_.kind == Hierarchy::Kind::Triangles ? triangles : boxes, gathers);
    }

    BuildPlan finish() {
        plan_.scratch = 4 * words_;
        return std::move(plan_);
    }

    const DeviceInput& input_;
    const uint32_t primitives_;
    const uint32_t alignment_;
    BuildConstants common_ = {};
    uint64_t words_ = state_words;
    BuildPlan plan_;
};

Expected<uint32_t> countPrimitives(const DeviceInput& input) {
    uint64_t count = 0;
    for (const DeviceGeometry& geometry : input.geometries) count += geometry.primitives;
    if (count > max_primitives) {
        return unexpected(makeError(ErrorCode::OutOfRange, "tracing.too_large",
                                    "{} primitives in a structure, at most {} are possible", count, max_primitives));
    }
    return static_cast<uint32_t>(count);
}

/// A node that has inner children has as many as it can; docs/tracing.md, "Building on the device".
uint32_t mostNodes(NodeForm form, uint32_t primitives) {
    const uint32_t width = widthOf(form);
    return primitives < 2 ? 1 : width / 2 * (primitives - 2) / (width - 1) + 1;
}

}  // namespace

std::string kernelSource(BuildKernel kernel) {
    const Program& each = program(kernel);
    return std::string(each.macros) + "#include <glint/tracing/build/" + each.name + ".h>\n";
}

bool usesHeap(BuildKernel kernel) { return program(kernel).heap; }

Expected<DeviceSizes> deviceSizes(const DeviceInput& input) {
    const Expected<uint32_t> primitives = countPrimitives(input);
    if (!primitives) return unexpected(primitives.error());
    DeviceSizes sizes;
    sizes.nodes = mostNodes(input.form, *primitives);
    sizes.texels = texelsOf(input.form) * (uint64_t(sizes.nodes) + 1) + 3 * uint64_t(*primitives);
    if (input.kind == Hierarchy::Kind::Instances) sizes.texels += 8 * uint64_t(*primitives);
    sizes.build_scratch = Planner(input, *primitives, 0, 4).build(sizes.nodes).scratch;
    return sizes;
}

Expected<BuildPlan> planBuild(const DeviceInput& input, uint32_t texel, uint32_t alignment) {
    const Expected<uint32_t> primitives = countPrimitives(input);
    if (!primitives) return unexpected(primitives.error());
    return Planner(input, *primitives, texel, alignment).build(mostNodes(input.form, *primitives));
}

Expected<BuildPlan> planRefit(const DeviceInput& input, uint32_t nodes, uint32_t texel, uint32_t alignment) {
    const Expected<uint32_t> primitives = countPrimitives(input);
    if (!primitives) return unexpected(primitives.error());
    return Planner(input, *primitives, texel, alignment).refit(nodes);
}

}  // namespace glint::detail
