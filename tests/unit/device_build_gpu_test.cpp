// Hierarchies built and refitted by kernels: against those of the host.

#include "support/device_builder.h"
#include "support/device_fixture.h"
#include "support/hierarchies.h"
#include "support/hierarchy_walk.h"
#include "support/reference.h"

#include <glint/geometry/primitives.h>
#include <glint/graphics/ray_caster.h>
#include <glint/tracing/detail/header.h>
#include <glint/tracing/detail/instances.h>

#include <fmt/format.h>

#include <cmath>
#include <cstring>

namespace glint::test {

namespace {

using namespace glint::detail;

/// Towards what is in the bounds, from outside and inside.
std::vector<Ray> raysAt(const BoundBox& bounds, uint32_t count, uint64_t seed) {
    Random random(seed);
    const Vector3d center(bounds.center());
    const double radius = 0.5 * glm::length(Vector3d(bounds.size()));
    std::vector<Ray> rays;
    for (uint32_t i = 0; i < count; i++) {
        Ray ray;
        ray.origin = Vector3f(center + radius * (i % 4 == 0 ? 0.3 : 1.6) * random.direction());
        ray.direction = Vector3f(center + radius * 0.6 * random.direction() - Vector3d(ray.origin));
        if (i % 5 == 0) ray.direction[i / 5 % 3] = 0.0f;
        rays.push_back(ray);
    }
    return rays;
}

bool sameTexels(const Hierarchy& a, const Hierarchy& b) {
    return a.bytes() == b.bytes() && std::memcmp(a.texels.data(), b.texels.data(), a.bytes()) == 0;
}

/// Every test runs with every form of nodes.
class DeviceBuild : public DeviceTest, public ::testing::WithParamInterface<NodeForm> {
protected:
    static constexpr uint32_t texel = 5;  // hierarchies need not begin at the heap's

    static void TearDownTestSuite() {
        for (auto& form : builders) {
            for (auto& each : form) each.reset();
        }
    }
    /// Kernels are compiled once.
    DeviceBuilder& builder(HeapForm form = HeapForm::Texels) {
        std::unique_ptr<DeviceBuilder>& each = builders[static_cast<uint32_t>(GetParam())][static_cast<uint32_t>(form)];
        if (!each) each = std::make_unique<DeviceBuilder>(device, form, GetParam());
        return *each;
    }

    uint32_t alignment() const { return device.getFeatures().storageAlignment; }

    template <class T>
    Buffer storage(const std::vector<T>& values) {
        return builder().createStorage(std::as_bytes(std::span(values)));
    }
    static DeviceInput inputOf(Hierarchy::Kind kind, const DeviceGeometry& geometry) {
        return {kind, {geometry}, GetParam()};
    }
    static Hierarchy hostHierarchyOf(const Mesh& mesh, BuildMode mode = BuildMode::Quality) {
        return hierarchyOf(mesh, mode, nullptr, GetParam());
    }
    GeometryBuffers buffersOf(const Mesh& mesh) { return {storage(mesh.positions), storage(mesh.indices)}; }

    /// Builds on the device, twice: the same bits. Checks what the traversal relies on.
    Hierarchy build(const DeviceInput& input, std::span<const GeometryBuffers> buffers,
                    HeapForm form = HeapForm::Texels) {
        Hierarchy results[2];
        for (Hierarchy& result : results) result = readBuilt(input, buffers, form);
        EXPECT_TRUE(sameTexels(results[0], results[1])) << "two builds differ";
        return std::move(results[0]);
    }
    Hierarchy readBuilt(const DeviceInput& input, std::span<const GeometryBuffers> buffers, HeapForm form) {
        const DeviceSizes sizes = *deviceSizes(input);
        heap = builder(form).createHeap(texel + sizes.texels);
        device.clearBuffer(heap, 0xdeadbeefu);
        const BuildPlan plan = *planBuild(input, texel, alignment());
        EXPECT_EQ(plan.scratch, sizes.build_scratch);
        builder(form).play(plan, heap, buffers);
        Hierarchy result = builder().read(heap, texel);
        const HierarchyWalk walk(result);
        EXPECT_LE(result.nodes, sizes.nodes);
        return result;
    }
    Hierarchy build(const Mesh& mesh, HeapForm form = HeapForm::Texels) {
        const GeometryBuffers buffers = buffersOf(mesh);
        return build(inputOf(Hierarchy::Kind::Triangles, deviceGeometryOf(mesh)), std::span(&buffers, 1), form);
    }

    static std::string macros() {
        return fmt::format("GLINT_TRACING_MEMORY=0;GLINT_TRACING_NODES={}", static_cast<int>(GetParam()));
    }

    std::vector<RayHit> trace(const Hierarchy& hierarchy, const std::vector<Ray>& rays) {
        if (!batch) {
            batch = device.createKernel();
            batch.createShaderGLSL("#include <glint/tracing/batch.h>\n", macros());
            EXPECT_TRUE(batch.create()) << batch.error().text();
        }
        const Buffer texels = device.createBuffer(Buffer::FlagTexel, hierarchy.texels.data(), hierarchy.bytes());
        const Buffer ray_buffer = device.createBuffer(Buffer::FlagStorage, std::span(rays));
        const Buffer hits = device.createBuffer(Buffer::FlagStorage, rays.size() * sizeof(RayHit));
        device.clearBuffer(hits);
        const auto count = static_cast<uint32_t>(rays.size());
        Compute compute = device.createCompute();
        compute.setKernel(batch);
        compute.setUniform(0, std::array<uint32_t, 4>{count, 0, 0, 0});
        compute.setTexelBuffer(0, texels, FormatRGBAu32);
        compute.setStorageBuffers(0, {ray_buffer, hits});
        compute.dispatch(count);
        EXPECT_TRUE(device.submit(compute));
        return *device.read<RayHit>(hits);
    }

    /// The same hits bit for bit, and some.
    void expectSameHits(const Hierarchy& a, const Hierarchy& b, uint32_t rays = 2000) {
        const BoundBox bounds = boundsOf(b);
        const std::vector<Ray> all = raysAt(bounds, rays, 17);
        const std::vector<RayHit> hits = trace(a, all);
        EXPECT_EQ(hits, trace(b, all));
        EXPECT_GT(std::count_if(hits.begin(), hits.end(), [](const RayHit& each) { return each.isHit(); }), rays / 50);
    }

    /// Full nodes of the same bits, but for planes that are one float farther out: the host gives the next float on the
    /// outer side of the exact difference, the kernels the one beyond the next on either side.
    static void expectPlanesAFloatApart(const Hierarchy& ours, const Hierarchy& theirs) {
        ASSERT_EQ(ours.bytes(), theirs.bytes());
        EXPECT_EQ(std::memcmp(ours.texels.data(), theirs.texels.data(), sizeof(Header)), 0);
        const Texel* records[] = {&ours.texels[ours.firstRecord()], &theirs.texels[ours.firstRecord()]};
        EXPECT_EQ(std::memcmp(records[0], records[1], 3 * sizeof(Texel) * ours.records), 0);
        for (uint32_t i = 1; i <= ours.nodes; i++) {
            FullNode a;
            FullNode b;
            std::memcpy(&a, &ours.texels[texelsOf(FullNode::form) * size_t(i)], sizeof(a));
            std::memcpy(&b, &theirs.texels[texelsOf(FullNode::form) * size_t(i)], sizeof(b));
            for (uint32_t word = 0; word < std::size(a.words); word++) {
                const bool is_plane = word >= 4 && word < 28 && word % 4 < b.children();
                const bool is_low = word / 4 % 2 == 1;
                const uint32_t out = is_low ? b.words[word] - a.words[word] : a.words[word] - b.words[word];
                EXPECT_LE(out, is_plane ? 1u : 0u) << "node " << i << " word " << word;
            }
        }
    }

    /// Records of the same bits, and boxes that hold the host's and are little larger.
    static void expectSameInstances(const Hierarchy& ours, const Hierarchy& theirs,
                                    const std::vector<HierarchyInstance>& instances) {
        const uint32_t first = readHeader(ours).first_instance;
        const uint32_t host_first = readHeader(theirs).first_instance;
        uint32_t inverses = 0;
        for (uint32_t i = 0; i < instances.size(); i++) {
            InstanceRecord a;
            InstanceRecord b;
            std::memcpy(&a, &ours.texels[first + 8 * i], sizeof(a));
            std::memcpy(&b, &theirs.texels[host_first + 8 * i], sizeof(b));
            EXPECT_EQ(std::memcmp(a.to_world, b.to_world, sizeof(a.to_world)), 0) << i;
            EXPECT_EQ(a.texel, b.texel) << i;
            EXPECT_EQ(a.custom_index_mask, b.custom_index_mask) << i;
            EXPECT_EQ(a.offset_flags, b.offset_flags) << i;
        }
        for (uint32_t i = 0; i < ours.records; i++) {
            Record record;
            std::memcpy(&record, &ours.texels[ours.firstRecord() + 3 * size_t(i)], sizeof(record));
            InstanceRecord a;
            InstanceRecord b;
            std::memcpy(&a, &ours.texels[first + 8 * record.primitive], sizeof(a));
            std::memcpy(&b, &theirs.texels[host_first + 8 * record.primitive], sizeof(b));
            for (int k = 0; k < 12; k++) {
                inverses += a.to_object[k] != b.to_object[k] ? 1 : 0;
                EXPECT_LE(std::abs(a.to_object[k] - b.to_object[k]), 0x1p-23f * std::abs(b.to_object[k])) << k;
            }
            const BoundBox exact = worldBounds(instances[record.primitive]);
            for (int axis = 0; axis < 3; axis++) {
                const float* rows = instances[record.primitive].transform.rows.data() + 4 * axis;
                double size = std::abs(rows[3]);
                for (int k = 0; k < 3; k++) {
                    size += std::abs(double(rows[k])) * std::max(std::abs(instances[record.primitive].bounds.min[k]),
                                                                 std::abs(instances[record.primitive].bounds.max[k]));
                }
                // The margin's 9 u, and what it is for, 6 u.
                EXPECT_LE(record.values[axis], exact.min[axis]);
                EXPECT_GE(record.values[axis], exact.min[axis] - 16 * 0x1p-24 * size);
                EXPECT_GE(record.values[3 + axis], exact.max[axis]);
                EXPECT_LE(record.values[3 + axis], exact.max[axis] + 16 * 0x1p-24 * size);
            }
        }
        // What has 46 bits or more is seldom rounded to another float than float64 is.
        EXPECT_LE(inverses, instances.size() / 100) << "numbers of inverse matrices differ";
    }

    /// The same answers from the top level on the heap and from one that the host has built behind it.
    void expectSameQueries(const Hierarchy& reference, uint32_t top) {
        Kernel kernel = device.createKernel();
        kernel.createShaderGLSL(R"(
#include <glint/tracing/query.h>
layout(local_size_x = 32) in;
struct Ray { vec3 origin; float t_min; vec3 direction; float t_max; };
layout(set = 0, binding = 1) uniform Parameters { uint ray_count, top; };
layout(set = 0, binding = 2) readonly buffer Rays { Ray rays[]; };
layout(set = 0, binding = 3) writeonly buffer Hits { uvec4 hits[]; };
void main() {
    const uint index = gl_GlobalInvocationID.x;
    if (index >= ray_count) return;
    GlintQuery q;
    glintQueryInitialize(q, 0u, top, 1u, 0xffu, rays[index].origin, 0.0, rays[index].direction, 1e9);
    while (glintQueryProceed(q)) {}
    const bool met = glintQueryType(q, true) != 0u;
    hits[index] = met ? uvec4(floatBitsToUint(glintQueryT(q, true)), glintQueryInstanceId(q, true),
                              glintQueryPrimitiveIndex(q, true), glintQueryInstanceCustomIndex(q, true))
                      : uvec4(0xffffffffu);
})",
                                macros());
        ASSERT_TRUE(kernel.create()) << kernel.error().text();
        const std::vector<Ray> rays = raysAt(BoundBox(Vector3f(-1.0f), Vector3f(1.0f)), 4000, 33);
        const auto count = static_cast<uint32_t>(rays.size());
        const uint64_t heap_size = heap.getSize();
        const Buffer both = builder().createHeap(heap_size / sizeof(Texel) + reference.texels.size());
        device.copyBuffer(both, 0, heap, 0, heap_size);
        device.setBuffer(both, heap_size, reference.texels.data(), reference.bytes());
        const Buffer ray_buffer = device.createBuffer(Buffer::FlagStorage, std::span(rays));
        std::vector<std::array<uint32_t, 4>> results[2];
        for (int i = 0; i < 2; i++) {
            const Buffer hits = device.createBuffer(Buffer::FlagStorage, 16 * rays.size());
            const auto first = i == 0 ? top : static_cast<uint32_t>(heap_size / sizeof(Texel));
            Compute compute = device.createCompute();
            compute.setKernel(kernel);
            compute.setUniform(0, std::array<uint32_t, 4>{count, first, 0, 0});
            compute.setTexelBuffer(0, both, FormatRGBAu32);
            compute.setStorageBuffers(0, {ray_buffer, hits});
            compute.dispatch(count);
            ASSERT_TRUE(device.submit(compute));
            results[i] = *device.read<std::array<uint32_t, 4>>(hits);
        }
        uint32_t met = 0;
        uint32_t differ = 0;
        for (uint32_t i = 0; i < count; i++) {
            met += results[1][i][0] != 0xffffffffu ? 1 : 0;
            differ += results[0][i] != results[1][i] ? 1 : 0;
        }
        EXPECT_GT(met, count / 20);
        EXPECT_EQ(differ, 0u);
    }

    Buffer heap;
    Kernel batch;

private:
    inline static std::unique_ptr<DeviceBuilder> builders[2][3];
};

TEST_P(DeviceBuild, HoldsItsPrimitivesForAllSizes) {
    for (const uint32_t count : {0u, 1u, 2u, 3u, 4u, 5u, 7u, 8u, 9u, 63u, 64u, 65u, 511u, 513u, 4097u}) {
        SCOPED_TRACE(count);
        const Mesh mesh = soup(count, count + 1);
        const Hierarchy hierarchy = build(mesh);
        EXPECT_EQ(hierarchy.records, count);
        if (count > 60) expectSameHits(hierarchy, hostHierarchyOf(mesh));
    }
}

TEST_P(DeviceBuild, FindsWhatTheHostsHierarchiesFind) {
    const Mesh torus = createTorus(1.0f, 0.4f, 250, 200);
    ASSERT_EQ(torus.triangleCount(), 100000u);
    const Hierarchy hierarchy = build(torus);
    expectSameHits(hierarchy, hostHierarchyOf(torus), 20000);
    // About what the host's builder makes of the same curve, but for how equal codes and costs are told apart: 0.04 and
    // 0.05 % more area, 0.8 and 1.0 % more nodes. A wrong choice of children costs 4 % of the area and more.
    EXPECT_LE(hierarchy.nodes, hostHierarchyOf(torus, BuildMode::Fast).nodes * 1.02);
    const HierarchyWalk device_walk(hierarchy);
    const HierarchyWalk host_walk(hostHierarchyOf(torus, BuildMode::Fast));
    EXPECT_LE(device_walk.area, host_walk.area * 1.01);
}

TEST_P(DeviceBuild, ReachesTheHeapInAllForms) {
    const Mesh mesh = soup(700, 3);
    const Hierarchy texels = build(mesh);
    EXPECT_TRUE(sameTexels(texels, build(mesh, HeapForm::Storage)));
    GLINT_NEED_FEATURE(FeatureBufferAddress);
    EXPECT_TRUE(sameTexels(texels, build(mesh, HeapForm::Address)));
}

TEST_P(DeviceBuild, StandsWhatBuildersStumbleOver) {
    Mesh one_place = soup(1, 3);
    for (uint32_t i = 0; i < 1000; i++) {
        for (uint32_t c = 0; c < 3; c++) one_place.indices.push_back(c);
    }
    // Each triangle half as far as the one before.
    Mesh chain;
    for (int i = 0; i < 200; i++) {
        for (int c = 0; c < 3; c++) {
            chain.indices.push_back(static_cast<uint32_t>(chain.positions.size()));
            const float scale = std::ldexp(1.0f, 99 - i);
            chain.positions.push_back(Vector3f(c == 0 ? 1.0f : 1.1f, c == 1 ? 1.0f : 0.1f, 0.2f) * scale);
        }
    }
    Mesh flat = soup(1000, 4);
    for (Vector3f& p : flat.positions) p.z = 7.0f;
    Mesh line = soup(1000, 5);
    for (Vector3f& p : line.positions) p.y = p.z = -3.0f;
    // In a row that doubles: heights of the binary tree that only the bits of places bound.
    Mesh same_code = soup(3000, 13, 1e-6);
    for (uint32_t c = 0; c < 3; c++) {
        same_code.indices.push_back(static_cast<uint32_t>(same_code.positions.size()));
        same_code.positions.push_back(Vector3f(1.0f, 1.0f, c == 0 ? 1.0f : 1.1f));
    }
    const std::pair<const char*, Mesh> cases[] = {
        {"one place", one_place},
        {"chain", chain},
        {"plane", flat},
        {"line", line},
        {"one code", same_code},
        {"1e18", soup(1000, 6, 1e18)},
        {"1e30", soup(1000, 6, 1e30)},
        {"3e38", soup(1000, 7, 3e38)},
        {"1e-30", soup(1000, 8, 1e-30)},
        {"denormal", soup(1000, 9, 1e-42)},
        {"far away", soup(1000, 10, 1.0, 1e6)},
        {"small and far away", soup(1000, 10, 1e-3, -1e4)},
        {"both signs, huge", soup(1000, 11, 1e30, -5e29)},
    };
    for (const auto& [name, mesh] : cases) {
        SCOPED_TRACE(name);
        const Hierarchy hierarchy = build(mesh);
        EXPECT_EQ(hierarchy.records, hostHierarchyOf(mesh).records);
    }
}

TEST_P(DeviceBuild, HoldsBoxesOfEverySize) {
    // Boxes from 2^-60 to 2^60 at places from 2^-60 to 2^60, in groups of a few, so that all scales of planes occur.
    Random random(6);
    for (const int magnitude : {-40, 0, 40}) {
        for (uint32_t group = 0; group < 6; group++) {
            SCOPED_TRACE(fmt::format("2^{}, group {}", magnitude, group));
            std::vector<float> boxes;
            const Vector3d middle = random.direction() * std::exp2(random.uniform(-20, 20));
            for (uint32_t i = 0; i < 200; i++) {
                const Vector3d at = middle + random.direction() * std::exp2(random.uniform(-20, 10));
                const double size = std::exp2(random.uniform(-30, 5)) * (i % 7 == 0 ? 0.0 : 1.0);
                const Vector3f low(at * std::exp2(magnitude));
                const Vector3f high((at + Vector3d(size, size * random.uniform(), 0.0)) * std::exp2(magnitude));
                for (int k = 0; k < 3; k++) boxes.push_back(low[k]);
                for (int k = 0; k < 3; k++) boxes.push_back(std::max(low[k], high[k]));
            }
            DeviceGeometry geometry;
            geometry.primitives = 200;
            geometry.stride = 24;
            const GeometryBuffers buffers = {storage(boxes), {}};
            EXPECT_EQ(build(inputOf(Hierarchy::Kind::Boxes, geometry), std::span(&buffers, 1)).records, 200u);
        }
    }
}

TEST_P(DeviceBuild, KeepsToTheLevelsOfTheStack) {
    // A chain of binary nodes, each with a sibling of seven groups of eight boxes: given seven children of a node, such
    // a sibling takes a node less. Boxes are larger the higher they are, so by cost one node takes but one step along
    // the chain, more than there are levels. Nodes of four children: three groups of four. The cells of the curve are
    // of size 1.
    const bool packed = GetParam() == NodeForm::Packed;
    const int group_bits = packed ? 3 : 2;
    const int copies = packed ? 8 : 4;
    std::vector<float> boxes;
    const auto add = [&](const Vector3d& center, double size) {
        for (const double side : {-0.5, 0.5}) {
            for (int axis = 0; axis < 3; axis++) boxes.push_back(static_cast<float>(center[axis] + side * size));
        }
    };
    add(Vector3d(0.5), 1.0);
    add(Vector3d(1023.5), 1.0);
    double size = 500.0;
    for (int step = 0; step < (packed ? 18 : 22); step++) {
        size *= 0.9;
        for (int group = 0; group < copies - 1; group++) {
            Vector3d center(256.5);
            // The code's bits from this step's on: x, y, z of bit 7, of bit 6 and so on.
            for (int bit = 0; bit <= group_bits; bit++) {
                if (bit == 0 || (group >> (bit - 1) & 1) != 0) center[(step + bit) % 3] += 1 << (7 - (step + bit) / 3);
            }
            for (int copy = 0; copy < copies; copy++) add(center, size);
        }
    }
    DeviceGeometry geometry;
    geometry.primitives = static_cast<uint32_t>(boxes.size() / 6);
    geometry.stride = 24;
    const GeometryBuffers buffers = {storage(boxes), {}};
    // `build` walks through all nodes and expects that no record is missing.
    const Hierarchy hierarchy = build(inputOf(Hierarchy::Kind::Boxes, geometry), std::span(&buffers, 1));
    EXPECT_EQ(hierarchy.records, geometry.primitives);
}

TEST_P(DeviceBuild, LeavesOutWhatTheHostLeavesOut) {
    constexpr float infinity = std::numeric_limits<float>::infinity();
    constexpr float nan = std::numeric_limits<float>::quiet_NaN();
    Mesh mesh = soup(300, 2);
    mesh.positions[3 * 10].x = nan;
    mesh.positions[3 * 20 + 1].y = infinity;
    mesh.positions[3 * 30 + 2].z = -infinity;
    mesh.positions[3 * 40].x = 1.3e30f;
    const Hierarchy hierarchy = build(mesh);
    EXPECT_EQ(hierarchy.records, 296u);
    expectSameHits(hierarchy, hostHierarchyOf(mesh));
    // An index that names no vertex.
    Mesh wrong = soup(300, 2);
    wrong.indices[30] = 900;
    wrong.indices[61] = 0xffffffffu;
    EXPECT_EQ(build(wrong).records, 298u);
    for (Vector3f& p : mesh.positions) p.x = nan;
    EXPECT_EQ(build(mesh).records, 0u);
    // One that is left out must not take another one's place.
    Mesh copies = soup(1, 1);
    for (uint32_t i = 0; i < 30; i++) copies.indices.insert(copies.indices.end(), {0, 1, 2});
    copies.indices.insert(copies.indices.end(), {4, 4, 4});
    copies.indices.insert(copies.indices.begin() + 60, {3, 3, 3});
    copies.positions.insert(copies.positions.end(), {Vector3f(nan), Vector3f(1e6f)});
    const Hierarchy without = build(copies);
    EXPECT_EQ(without.records, 32u);
    for (uint32_t i = 0; i < without.records; i++) {
        Record record;
        std::memcpy(&record, &without.texels[without.firstRecord() + 3 * size_t(i)], sizeof(record));
        EXPECT_TRUE(allInRange(record.values, 9)) << i;
    }
    std::vector<float> boxes;
    for (uint32_t i = 0; i < 20; i++) {
        const float x = static_cast<float>(i);
        for (const float value :
             {x, 0.0f, i == 5 ? nan : 0.0f, x + (i == 3 ? -0.5f : 0.5f), i == 7 ? infinity : 1.0f, 1.0f})
            boxes.push_back(value);
    }
    DeviceGeometry geometry;
    geometry.primitives = 20;
    geometry.stride = 24;
    const GeometryBuffers buffers = {storage(boxes), {}};
    EXPECT_EQ(build(inputOf(Hierarchy::Kind::Boxes, geometry), std::span(&buffers, 1)).records, 17u);
}

/// Four geometries of one mesh: as it is; a third of it with 16-bit indices; nothing; without indices, with a stride,
/// at an odd place of its buffer.
struct Geometries {
    std::vector<std::byte> shorts;
    std::vector<std::byte> spread;
    std::vector<TriangleGeometry> host;
    DeviceInput device;

    Geometries(const Mesh& mesh, NodeForm form)
        : host(4), device{Hierarchy::Kind::Triangles, std::vector<DeviceGeometry>(4), form} {
        set(mesh);
    }
    /// Corners of triangle i are 3i .. 3i + 2.
    void set(const Mesh& mesh) {
        const auto triangles = static_cast<uint32_t>(mesh.triangleCount());
        host[0] = geometryOf(mesh);
        host[0].opaque = false;
        device.geometries[0] = deviceGeometryOf(mesh);
        device.geometries[0].opaque = false;

        const std::vector<uint16_t> indices(mesh.indices.begin(), mesh.indices.begin() + triangles / 3 * 3);
        shorts.assign(6 + 2 * indices.size(), std::byte(0xff));
        std::memcpy(shorts.data() + 6, indices.data(), 2 * indices.size());
        host[1] = host[0];
        host[1].opaque = true;
        host[1].indices = shorts.data() + 6;
        host[1].index = TriangleGeometry::Index::Uint16;
        host[1].triangles = triangles / 3;
        device.geometries[1] = device.geometries[0];
        device.geometries[1].opaque = true;
        device.geometries[1].index = TriangleGeometry::Index::Uint16;
        device.geometries[1].index_offset = 6;
        device.geometries[1].primitives = triangles / 3;

        constexpr uint32_t stride = 20;
        constexpr uint32_t offset = 36;
        spread.assign(offset + stride * mesh.positions.size(), std::byte(0xff));
        for (size_t i = 0; i < mesh.positions.size(); i++)
            std::memcpy(spread.data() + offset + stride * i, &mesh.positions[i], 12);
        host[3].positions = spread.data() + offset;
        host[3].stride = stride;
        host[3].vertices = static_cast<uint32_t>(mesh.positions.size());
        host[3].triangles = triangles;
        device.geometries[3].primitives = triangles;
        device.geometries[3].vertices = host[3].vertices;
        device.geometries[3].stride = stride;
        device.geometries[3].offset = offset;
    }
};

TEST_P(DeviceBuild, TakesSeveralGeometriesAndFormsOfIndices) {
    const Mesh mesh = soup(301, 12);
    const Geometries geometries(mesh, GetParam());
    const Buffer positions = storage(mesh.positions);
    const GeometryBuffers buffers[4] = {{positions, storage(mesh.indices)},
                                        {positions, storage(geometries.shorts)},
                                        {},
                                        {storage(geometries.spread), {}}};
    const Hierarchy hierarchy = build(geometries.device, buffers);
    EXPECT_EQ(hierarchy.records, 702u);
    const Expected<Hierarchy> host = buildHierarchy(geometries.host, BuildMode::Quality, nullptr, GetParam());
    ASSERT_TRUE(host);
    expectSameHits(hierarchy, *host);
    // Records as the host writes them, in whatever order.
    const auto records = [](const Hierarchy& from) {
        std::vector<Record> all(from.records);
        std::memcpy(all.data(), &from.texels[from.firstRecord()], all.size() * sizeof(Record));
        std::sort(all.begin(), all.end(), [](const Record& a, const Record& b) { return a.row < b.row; });
        return all;
    };
    const std::vector<Record> ours = records(hierarchy);
    const std::vector<Record> theirs = records(*host);
    EXPECT_EQ(std::memcmp(ours.data(), theirs.data(), ours.size() * sizeof(Record)), 0);
}

Mesh deformed(Mesh mesh) {
    for (Vector3f& p : mesh.positions) p = p * (1.0f + 0.3f * std::sin(5.0f * p.x)) + Vector3f(0.0f, 0.5f * p.x, 2.0f);
    return mesh;
}

TEST_P(DeviceBuild, RefitsWhatTheDeviceOrTheHostHasBuilt) {
    const Mesh mesh = soup(1500, 21, 2.0, -1.0);
    Mesh moved = deformed(mesh);
    moved.positions[3 * 77].y = std::numeric_limits<float>::quiet_NaN();
    const DeviceInput input = inputOf(Hierarchy::Kind::Triangles, deviceGeometryOf(mesh));
    const GeometryBuffers before = buffersOf(mesh);
    const GeometryBuffers after = buffersOf(moved);
    const Hierarchy fresh = hostHierarchyOf(moved);
    for (const HeapForm form : {HeapForm::Texels, HeapForm::Storage}) {
        const Hierarchy built = build(input, std::span(&before, 1), form);
        const uint32_t nodes = deviceSizes(input)->nodes;
        builder(form).play(*planRefit(input, nodes, texel, alignment()), heap, std::span(&before, 1));
        // With the same coordinates, the same bits.
        EXPECT_TRUE(sameTexels(built, builder().read(heap, texel)));
        builder(form).play(*planRefit(input, nodes, texel, alignment()), heap, std::span(&after, 1));
        const Hierarchy refitted = builder().read(heap, texel);
        EXPECT_EQ(refitted.records, built.records);
        const HierarchyWalk walk(refitted);
        expectSameHits(refitted, fresh);
    }
    for (const BuildMode mode : {BuildMode::Quality, BuildMode::Fast}) {
        const Hierarchy built = hostHierarchyOf(mesh, mode);
        heap = builder().createHeap(texel + built.texels.size());
        device.setBuffer(heap, texel * sizeof(Texel), built.texels.data(), built.bytes());
        builder().play(*planRefit(input, built.nodes, texel, alignment()), heap, std::span(&before, 1));
        if (GetParam() == NodeForm::Full) expectPlanesAFloatApart(builder().read(heap, texel), built);
        builder().play(*planRefit(input, built.nodes, texel, alignment()), heap, std::span(&after, 1));
        const Hierarchy refitted = builder().read(heap, texel);
        const HierarchyWalk walk(refitted);
        expectSameHits(refitted, fresh);
    }
}

TEST_P(DeviceBuild, RefitsSeveralGeometries) {
    Mesh mesh = soup(301, 12);
    mesh.positions[3 * 50].x = std::numeric_limits<float>::infinity();
    Geometries geometries(mesh, GetParam());
    const auto buffersFor = [&](const Mesh& each) {
        const Buffer positions = storage(each.positions);
        return std::vector<GeometryBuffers>{{positions, storage(each.indices)},
                                            {positions, storage(geometries.shorts)},
                                            {},
                                            {storage(geometries.spread), {}}};
    };
    const Hierarchy built = build(geometries.device, buffersFor(mesh));
    const Mesh moved = deformed(mesh);
    geometries.set(moved);
    builder().play(*planRefit(geometries.device, built.nodes, texel, alignment()), heap, buffersFor(moved));
    const Hierarchy refitted = builder().read(heap, texel);
    const HierarchyWalk walk(refitted);
    const Expected<Hierarchy> fresh = buildHierarchy(geometries.host, BuildMode::Quality, nullptr, GetParam());
    ASSERT_TRUE(fresh);
    EXPECT_EQ(fresh->records, refitted.records);
    expectSameHits(refitted, *fresh);
}

/// Instances of two hierarchies: at any angle, mirrored, stretched, singular, of nothing, and beyond what is possible.
std::vector<DeviceInstance> someInstances(uint32_t count, const uint32_t texels[2], uint64_t seed) {
    Random random(seed);
    std::vector<DeviceInstance> instances(count);
    for (uint32_t i = 0; i < count; i++) {
        DeviceInstance& instance = instances[i] = {};
        Vector3d axes[3] = {random.direction(), random.direction(), random.direction()};
        if (i % 5 == 0) axes[1] = axes[1] * 1000.0;
        if (i % 7 == 0) axes[2] = axes[2] * -1e-4;
        const double scale = std::exp2(random.uniform(-6, -2)) * (i % 11 == 0 ? 1e4 : 1.0) * (i % 5 == 0 ? 1e-3 : 1.0);
        for (int row = 0; row < 3; row++) {
            for (int column = 0; column < 3; column++)
                instance.transform[4 * row + column] = static_cast<float>(axes[column][row] * scale);
            instance.transform[4 * row + 3] = static_cast<float>(random.uniform(-1, 1) * (i % 13 == 0 ? 1e4 : 1.0));
        }
        instance.texel = texels[i % 2];
        instance.custom_index_mask = (i * 3 & 0xffffffu) | 0xffu << 24;
        instance.offset_flags = (i * 5 & 0xffffffu) | (i % 3) << 24;
        if (i % 50 == 17) instance.texel = DeviceInstance::none;
        if (i % 50 == 18) instance.transform[0] = std::numeric_limits<float>::quiet_NaN();
        if (i % 50 == 19) std::fill(instance.transform + 4, instance.transform + 7, 0.0f);
        if (i % 50 == 20) instance.transform[3] = 2e30f;
    }
    return instances;
}

TEST_P(DeviceBuild, BuildsAndRefitsTopLevels) {
    // Two bottom levels at the heap's begin, the top level behind.
    const Hierarchy bottoms[2] = {hostHierarchyOf(createTorus(1.0f, 0.4f, 24, 12)),
                                  hostHierarchyOf(soup(200, 9, 2.0, -1.0))};
    const uint32_t places[2] = {3, 3 + static_cast<uint32_t>(bottoms[0].texels.size())};
    const auto top = static_cast<uint32_t>(places[1] + bottoms[1].texels.size());
    for (const uint32_t count : {1u, 9u, 400u}) {
        SCOPED_TRACE(count);
        DeviceGeometry geometry;
        geometry.primitives = count;
        geometry.stride = 64;
        const DeviceInput input = inputOf(Hierarchy::Kind::Instances, geometry);
        const DeviceSizes sizes = *deviceSizes(input);
        heap = builder().createHeap(top + sizes.texels);
        for (int i = 0; i < 2; i++)
            device.setBuffer(heap, places[i] * sizeof(Texel), bottoms[i].texels.data(), bottoms[i].bytes());
        for (const bool refits : {false, true}) {
            const std::vector<DeviceInstance> instances = someInstances(count, places, refits ? 31 : 30);
            const GeometryBuffers buffers = {storage(instances), {}};
            builder().play(refits ? *planRefit(input, sizes.nodes, top, alignment())
                                  : *planBuild(input, top, alignment()),
                           heap, std::span(&buffers, 1));
            const Hierarchy result = builder().read(heap, top);
            const HierarchyWalk walk(result);

            std::vector<HierarchyInstance> host(count);
            for (uint32_t i = 0; i < count; i++) {
                std::copy_n(instances[i].transform, 12, host[i].transform.rows.begin());
                host[i].texel = instances[i].texel;
                if (instances[i].texel != DeviceInstance::none) host[i].bounds = boundsOf(bottoms[i % 2]);
                host[i].custom_index = instances[i].custom_index_mask & 0xffffffu;
                host[i].offset = instances[i].offset_flags & 0xffffffu;
                host[i].flags = instances[i].offset_flags >> 24;
            }
            const Expected<Hierarchy> reference = buildHierarchy(host, BuildMode::Quality, nullptr, GetParam());
            ASSERT_TRUE(reference);
            EXPECT_EQ(result.records, reference->records);
            expectSameInstances(result, *reference, host);
            if (count == 400) expectSameQueries(*reference, top);
        }
    }
}

INSTANTIATE_TEST_SUITE_P(Nodes, DeviceBuild, ::testing::Values(NodeForm::Packed, NodeForm::Full),
                         [](const auto& each) { return each.param == NodeForm::Packed ? "Packed" : "Full"; });

}  // namespace

}  // namespace glint::test
