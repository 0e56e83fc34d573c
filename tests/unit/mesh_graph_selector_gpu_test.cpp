// MeshGraphModel and MeshGraphSelector: the device's list is the host's cut.

#include "support/device_fixture.h"
#include "support/reference.h"

#include <glint/geometry/mesh_graph_builder.h>
#include <glint/geometry/primitives.h>
#include <glint/geometry/refine.h>
#include <glint/graphics/mesh_graph_selector.h>

#include <glm/geometric.hpp>

#include <algorithm>
#include <cmath>
#include <limits>
#include <set>

namespace glint::test {

namespace {

using Entry = std::array<uint32_t, 2>;

/// The tutorials' torus with 22,528 triangles.
const MeshGraph& torus() {
    static const MeshGraph graph = *createMeshGraph(
        *toTriangles(*refine(createTorusQuads(1.07208f, 0.77792f, 16, 11), Subdivision::CatmullClark, 3)));
    return graph;
}

/// A graph of many clusters of one triangle each, in a ring: at each level four neighbours become two, so that the two
/// parents of a group go into different groups. 2^levels clusters of the mesh as it was.
MeshGraph ring(uint32_t levels) {
    MeshGraphArrays arrays;
    const auto placeOf = [&](uint32_t level, double i) {
        const double angle = 6.283185307 * (i + 0.5) / (1u << (levels - level));
        return Vector3f(Vector3d(std::cos(angle), std::sin(angle), 0.0));
    };
    // Group g of level l has the clusters 4 g + 1 to 4 g + 4 of level l as children, 2 g and 2 g + 1 of level l + 1 as
    // parents. The arrays begin with the highest level.
    const auto groupsOf = [&](uint32_t level) { return (1u << (levels - level)) / 4; };
    const uint32_t top = levels - 1;  // of two clusters, the roots
    std::vector<uint32_t> first_group(top + 1, 0), first_cluster(top + 1, 0);
    for (uint32_t level = top, groups = 0, clusters = 0; level <= top; level--) {
        first_cluster[level] = clusters;
        clusters += 1u << (levels - level);
        if (level < top) {
            first_group[level] = groups;
            groups += groupsOf(level);
        }
    }
    // Clusters of a level are stored group by group: cluster i at place (i - 1) mod n.
    const auto numberOf = [&](uint32_t level, uint32_t i) {
        const uint32_t count = 1u << (levels - level);
        return first_cluster[level] + (level == top ? i : (i + count - 1) % count);
    };
    arrays.parts = {{"ring", UINT32_MAX}};
    arrays.root_count = 2;
    arrays.clusters.resize((1u << (levels + 1)) - 2);
    arrays.groups.resize(first_group[0] + groupsOf(0));
    for (uint32_t level = 0; level <= top; level++)
        for (uint32_t i = 0; i < (1u << (levels - level)); i++) {
            MeshCluster& cluster = arrays.clusters[numberOf(level, i)];
            cluster.center = placeOf(level, i);
            cluster.radius = 0.1f;
            cluster.box_min = cluster.center - 0.05f;
            cluster.box_max = cluster.center + 0.05f;
            cluster.counts = 3 | 1u << 16;
            if (level > 0) cluster.source = first_group[level - 1] + i / 2;
            const uint32_t count = 1u << (levels - level);
            if (level < top) cluster.group = first_group[level] + (i + count - 1) % count / 4;
        }
    for (uint32_t level = 0; level < top; level++)
        for (uint32_t g = 0; g < groupsOf(level); g++) {
            MeshClusterGroup& group = arrays.groups[first_group[level] + g];
            group.first_child = numberOf(level, 4 * g + 1);
            group.child_count = 4;
            group.level = level;
            group.error = 1e-4f * static_cast<float>(1u << 2 * level);
            group.center = placeOf(level, 4.0 * g + 2.5);
            double radius = 0.0;
            for (uint32_t k = 0; k < 4; k++) {
                const MeshCluster& child = arrays.clusters[group.first_child + k];
                const MeshClusterGroup* inner = level > 0 ? &arrays.groups[child.source] : nullptr;
                const Vector3f center = inner ? inner->center : child.center;
                radius = std::max<double>(radius, glm::distance(Vector3d(center), Vector3d(group.center)) +
                                                      (inner ? inner->radius : child.radius));
            }
            group.radius = static_cast<float>(radius * 1.0001);
        }
    for (MeshClusterGroup& group : arrays.groups) {
        group.first_parent = static_cast<uint32_t>(arrays.parents.size());
        group.parent_count = 2;
        const auto g = static_cast<uint32_t>(&group - arrays.groups.data()) - first_group[group.level];
        for (uint32_t k = 0; k < 2; k++) arrays.parents.push_back(numberOf(group.level + 1, 2 * g + k));
    }
    for (MeshCluster& cluster : arrays.clusters) {
        cluster.first_vertex = static_cast<uint32_t>(arrays.cluster_vertices.size());
        cluster.first_triangle = static_cast<uint32_t>(arrays.cluster_triangles.size());
        for (int k = 0; k < 3; k++) {
            arrays.cluster_vertices.push_back(static_cast<uint32_t>(arrays.positions.size()));
            arrays.positions.push_back(cluster.center + Vector3f(k == 1 ? 0.05f : 0.0f, k == 2 ? 0.05f : 0.0f, 0.0f));
        }
        arrays.cluster_triangles.push_back(0 | 1u << 10 | 2u << 20);
    }
    const Expected<MeshGraph> graph = MeshGraph::create(arrays);
    EXPECT_TRUE(graph) << graph.error().text();
    return graph ? *graph : MeshGraph();
}

/// Random triangles between few points: many roots, edges of many triangles.
const MeshGraph& soup() {
    static const MeshGraph graph = [] {
        Random random(3);
        Mesh mesh;
        for (int i = 0; i < 400; i++) mesh.positions.emplace_back(random.direction());
        for (int i = 0; i < 3 * 2000; i++) mesh.indices.push_back(static_cast<uint32_t>(random.below(400)));
        return *createMeshGraph(mesh);
    }();
    return graph;
}

Matrix4x4f randomTurn(Random& random) {
    return rotateX(static_cast<float>(random.uniform(0, 360))) * rotateY(static_cast<float>(random.uniform(0, 360))) *
           rotateZ(static_cast<float>(random.uniform(0, 360)));
}

struct View {
    Camera camera;
    Vector2u size = {1600, 900};
};

View randomView(Random& random, double nearest, double farthest) {
    View view;
    const double distance = std::exp(random.uniform(std::log(nearest), std::log(farthest)));
    view.camera.lookAt(Vector3f(random.direction() * distance), Vector3f(random.direction() * 0.3))
        .perspective(60.0f, 16.0f / 9.0f, 0.01f);
    return view;
}

class MeshGraphSelectorTest : public DeviceTest {
protected:
    void SetUp() override {
        DeviceTest::SetUp();
        ASSERT_TRUE(device);
        ASSERT_THAT(selector.create(device), IsOk());
    }
    void TearDown() override {
        selector = {};
        DeviceTest::TearDown();
    }

    Buffer upload(const std::vector<Transform3x4>& transforms) {
        return device.createBuffer(Buffer::FlagStorage, std::span(transforms), "instances");
    }

    Status select(const MeshGraphModel& model, const std::vector<Transform3x4>& transforms, const View& view,
                  float pixels, MeshGraphSelector::Cull cull) {
        Compute compute = device.createCompute();
        selector.select(compute, model, upload(transforms), static_cast<uint32_t>(transforms.size()),
                        view.camera.parameters(), view.size, pixels, cull);
        return device.submit(compute);
    }

    /// The clusters of each instance, ascending; draws once more if the list was too small.
    std::vector<std::vector<uint32_t>> listOf(const MeshGraphModel& model, const std::vector<Transform3x4>& transforms,
                                              const View& view, float pixels,
                                              MeshGraphSelector::Cull cull = MeshGraphSelector::CullNone) {
        EXPECT_THAT(select(model, transforms, view, pixels, cull), IsOk());
        if (!selector.check()) {
            EXPECT_THAT(select(model, transforms, view, pixels, cull), IsOk());
            EXPECT_THAT(selector.check(), IsOk());
        }
        std::vector<std::vector<uint32_t>> result(transforms.size());
        const auto counts = device.read<uint32_t>(selector.getCount());
        const auto list = device.read<Entry>(selector.getList());
        EXPECT_TRUE(counts && list);
        if (!counts || !list) return result;
        EXPECT_EQ(counts->front(), selector.getStatistics().clusters);
        for (uint32_t i = 0; i < counts->front(); i++) {
            const Entry& entry = (*list)[i];
            EXPECT_TRUE(entry[0] < transforms.size() && entry[1] < model.clusterCount()) << entry[0] << " " << entry[1];
            if (entry[0] >= transforms.size()) return result;
            result[entry[0]].push_back(entry[1]);
        }
        for (std::vector<uint32_t>& clusters : result) std::sort(clusters.begin(), clusters.end());
        return result;
    }

    MeshGraphSelector selector;
};

/// The decisions that a list stands for: which groups it refines. False if it is no cut: something is drawn twice, or
/// not at all.
bool decisionsOf(const MeshGraph& graph, const std::vector<uint32_t>& list, std::vector<bool>& refined) {
    const std::set<uint32_t> drawn(list.begin(), list.end());
    if (drawn.size() != list.size()) return false;
    refined.assign(graph.groups().size(), false);
    // A group is refined if some cluster of its own is drawn, or one within; those above come first.
    for (size_t i = graph.groups().size(); i-- > 0;) {
        const MeshClusterGroup& group = graph.groups()[i];
        for (uint32_t k = group.first_child; k < group.first_child + group.child_count; k++) {
            const uint32_t source = graph.clusters()[k].source;
            if (drawn.contains(k) || (source != UINT32_MAX && refined[source])) refined[i] = true;
        }
    }
    // The rule of a cut, for every cluster; and no group within one that is not refined.
    for (uint32_t i = 0; i < graph.clusters().size(); i++) {
        const MeshCluster& cluster = graph.clusters()[i];
        const bool source = cluster.source != UINT32_MAX && refined[cluster.source];
        const bool group = cluster.group == UINT32_MAX || refined[cluster.group];
        if (source && !group) return false;
        if (drawn.contains(i) != (!source && group)) return false;
    }
    return true;
}

/// How a list differs from what the host says of each group, for a transform that stretches by at most 2^`stretches`
/// more along one way than along another.
void expectTheHostsCut(const MeshGraph& graph, const std::vector<uint32_t>& list, const View& view,
                       const Transform3x4& transform, double ratio, float pixels, uint32_t& others) {
    const MeshGraphView on_host(view.camera.parameters(), view.size, transform);
    std::vector<bool> refined;
    ASSERT_TRUE(decisionsOf(graph, list, refined));
    for (size_t k = 0; k < refined.size(); k++) {
        const MeshClusterGroup& group = graph.groups()[k];
        const float error = on_host.error(group);
        if (refined[k] == !(error <= pixels)) continue;
        others++;
        // The device has stretches to 2^-17 of the largest, widened by as much, and by 2^-18 for the rest. Its eye is
        // within the doubt, 2^-20 ratio of its distance, of where it is, and counts as if it were as much nearer.
        const double depth = static_cast<double>(group.error) * on_host.scale / error;
        const double doubt = 0x1p-19 * ratio * ratio * glm::length(Vector3d(on_host.eye));
        EXPECT_NEAR(error, pixels, pixels * (0x1p-15 * ratio + 2.0 * doubt * on_host.stretch / depth)) << k;
    }
}

}  // namespace

TEST_F(MeshGraphSelectorTest, ListsTheHostsCut) {
    const MeshGraph big_ring = ring(12);
    const std::array graphs = {&torus(), &soup(), &big_ring};
    Random random(7);
    uint32_t others = 0, lists_seen = 0, clusters = 0;
    for (const MeshGraph* graph : graphs) {
        const MeshGraphModel model(device, *graph, "graph");
        ASSERT_TRUE(model) << model.error().text();
        EXPECT_EQ(model.pieceCount() > 1, graph == &big_ring);
        for (int round = 0; round < 10; round++) {
            const View view = randomView(random, 0.5, 200.0);
            std::vector<Transform3x4> transforms;
            std::vector<double> ratios;
            for (int i = 0; i < 12; i++) {
                // As they are; stretched, mirrored; small, large; far away.
                Vector3f factors(1.0f);
                if (i % 4 == 1) factors = {0.3f, -3.0f, 1.0f};
                if (i % 4 == 2) factors = Vector3f(random.below(2) == 0 ? 1e-4f : 1e4f);
                const double away = i % 4 == 3 ? 1e4 : 40.0;
                ratios.push_back(i % 4 == 1 ? 10.0 : 1.0);
                transforms.emplace_back(translate(Vector3f(random.direction() * random.uniform(0, away))) *
                                        randomTurn(random) * scale(factors) * randomTurn(random));
            }
            const auto pixels = static_cast<float>(std::exp2(random.uniform(-4, 4)));
            const auto lists = listOf(model, transforms, view, pixels);
            for (size_t i = 0; i < transforms.size(); i++) {
                SCOPED_TRACE(testing::Message() << round << " " << i);
                expectTheHostsCut(*graph, lists[i], view, transforms[i], ratios[i], pixels, others);
                lists_seen++;
                clusters += static_cast<uint32_t>(lists[i].size());
            }
        }
    }
    // So near to the threshold are few of them; and lists are neither all roots nor all leaves.
    EXPECT_LE(others, lists_seen / 10);
    EXPECT_GT(clusters, 10 * lists_seen);
    EXPECT_LT(clusters, 1000 * lists_seen);
}

TEST_F(MeshGraphSelectorTest, FullAtNoPixels) {
    const MeshGraphModel model(device, torus());
    std::vector<uint32_t> leaves;
    for (uint32_t i = 0; i < torus().clusters().size(); i++)
        if (torus().clusters()[i].source == UINT32_MAX) leaves.push_back(i);
    View view;
    view.camera.lookAt({0, 0, 1e4f}, {0, 0, 0}, {0, 1, 0});
    // A flat one, too, and one that is nearly flat: they are drawn in full whatever the error may be.
    const std::vector<Transform3x4> transforms = {Transform3x4(), Transform3x4(scale({1, 1, 0})),
                                                  Transform3x4(scale({1, 1e-6f, 1}))};
    const auto full = listOf(model, transforms, view, 0.0f);
    for (const std::vector<uint32_t>& list : full) EXPECT_EQ(list, leaves);
    EXPECT_EQ(selector.getStatistics().triangles, 3 * model.triangleCount());
    const auto coarse = listOf(model, transforms, view, 1e6f);
    EXPECT_LT(coarse[0].size(), leaves.size() / 4);
    EXPECT_EQ(coarse[1], leaves);
    EXPECT_EQ(coarse[2], leaves);
}

TEST_F(MeshGraphSelectorTest, LeavesOutOnlyWhatCannotBeSeen) {
    const MeshGraph& graph = torus();
    const MeshGraphModel model(device, graph);
    Random random(11);
    uint32_t all = 0, outside = 0, facing_away = 0;
    for (int round = 0; round < 8; round++) {
        const View view = randomView(random, 1.0, 20.0);
        std::vector<Transform3x4> transforms;
        for (int i = 0; i < 20; i++)
            transforms.emplace_back(translate(Vector3f(random.direction() * random.uniform(0, 20))) *
                                    randomTurn(random) * scale(i % 2 ? Vector3f(1.0f) : Vector3f(0.5f, -2.0f, 1.0f)));
        const float pixels = 2.0f;
        const auto whole = listOf(model, transforms, view, pixels);
        const auto inside = listOf(model, transforms, view, pixels, MeshGraphSelector::CullFrustum);
        EXPECT_GT(selector.getStatistics().outside, 0u);
        const auto front = listOf(model, transforms, view, pixels, MeshGraphSelector::CullCone);
        EXPECT_GT(selector.getStatistics().facing_away, 0u);
        const auto seen = listOf(model, transforms, view, pixels, MeshGraphSelector::CullAll);
        const Matrix4x4d to_clip = Matrix4x4d(view.camera.projection()) * Matrix4x4d(view.camera.view());
        for (size_t i = 0; i < transforms.size(); i++) {
            std::vector<uint32_t> both;
            std::set_intersection(inside[i].begin(), inside[i].end(), front[i].begin(), front[i].end(),
                                  std::back_inserter(both));
            EXPECT_EQ(seen[i], both);
            const Matrix4x4d to_world(transforms[i].matrix());
            const Vector3d eye(glm::inverse(to_world) * Vector4d(Vector3d(view.camera.position()), 1.0));
            all += static_cast<uint32_t>(whole[i].size());
            for (const uint32_t c : whole[i]) {
                const MeshCluster& cluster = graph.clusters()[c];
                const auto vertex = [&](uint32_t k) {
                    return Vector3d(graph.positions()[graph.clusterVertices()[cluster.first_vertex + k]]);
                };
                if (!std::binary_search(inside[i].begin(), inside[i].end(), c)) {
                    // All vertices are beyond one plane.
                    outside++;
                    std::array<bool, 5> beyond = {true, true, true, true, true};
                    for (uint32_t k = 0; k < cluster.vertexCount(); k++) {
                        const Vector4d clip = to_clip * to_world * Vector4d(vertex(k), 1.0);
                        const std::array inner = {clip.w + clip.x, clip.w - clip.x, clip.w + clip.y, clip.w - clip.y,
                                                  clip.w - clip.z};
                        for (size_t plane = 0; plane < 5; plane++) beyond[plane] &= inner[plane] < 0.0;
                    }
                    EXPECT_TRUE(std::ranges::any_of(beyond, [](bool b) { return b; })) << round << " " << i << " " << c;
                }
                if (!std::binary_search(front[i].begin(), front[i].end(), c)) {
                    facing_away++;
                    for (const uint32_t packed :
                         graph.clusterTriangles().subspan(cluster.first_triangle, cluster.triangleCount())) {
                        const Vector3d a = vertex(packed & 0x3ff), b = vertex(packed >> 10 & 0x3ff),
                                       d = vertex(packed >> 20 & 0x3ff);
                        EXPECT_GE(glm::dot(glm::cross(b - a, d - a), a - eye), 0.0) << round << " " << i << " " << c;
                    }
                }
            }
        }
    }
    // The tests are worth while: most of what is outside goes, and some of what faces away.
    EXPECT_GT(outside, all / 4);
    EXPECT_LT(outside, all);
    EXPECT_GT(facing_away, all / 50);
}

TEST_F(MeshGraphSelectorTest, InstancesThatCannotBeDrawn) {
    const MeshGraphModel model(device, torus());
    const float nan = std::numeric_limits<float>::quiet_NaN(), infinity = std::numeric_limits<float>::infinity();
    std::vector<Transform3x4> transforms(7);
    transforms[1] = Transform3x4(scale(Vector3f(0.0f)));
    transforms[2].rows[5] = nan;
    transforms[3].rows[3] = infinity;
    transforms[4] = Transform3x4(scale(Vector3f(1e30f)));
    transforms[5] = Transform3x4(scale(Vector3f(1e-30f)));
    transforms[6] = Transform3x4(translate({1, 0, 0}));
    View view;
    view.camera.lookAt({0, 0, 8}, {0, 0, 0}, {0, 1, 0});
    for (const MeshGraphSelector::Cull cull : {MeshGraphSelector::CullNone, MeshGraphSelector::CullAll}) {
        const auto lists = listOf(model, transforms, view, 1.0f, cull);
        for (size_t i = 0; i < lists.size(); i++) EXPECT_EQ(lists[i].empty(), i != 0 && i != 6) << i;
        EXPECT_EQ(selector.getStatistics().refused, 5u);
    }
    // None at all.
    Compute compute = device.createCompute();
    selector.select(compute, model, upload(transforms), 0, view.camera.parameters(), view.size, 1.0f);
    EXPECT_THAT(device.submit(compute), IsOk());
    EXPECT_THAT(selector.check(), IsOk());
    EXPECT_EQ(selector.getStatistics().clusters, 0u);
}

TEST_F(MeshGraphSelectorTest, GrowsWhenTheListIsTooShort) {
    const MeshGraph graph = ring(10);
    const MeshGraphModel model(device, graph);
    EXPECT_EQ(model.cutLimit(), 1024u);
    View view;
    view.camera.lookAt({0, 0, 8}, {0, 0, 0}, {0, 1, 0});
    const std::vector<Transform3x4> transforms(1100);
    ASSERT_THAT(select(model, transforms, view, 0.0f, MeshGraphSelector::CullNone), IsOk());
    const uint32_t capacity = selector.getCapacity();
    ASSERT_LT(capacity, 1100u * 1024u);
    EXPECT_EQ(errorOf(selector.check()).id(), "selector.capacity");
    EXPECT_EQ(selector.getStatistics().clusters, 1100u * 1024u);
    EXPECT_EQ(selector.getStatistics().capacity, capacity);
    // What fits is there, each entry once, and no more.
    const auto counts = device.read<uint32_t>(selector.getCount());
    const auto list = device.read<uint64_t>(selector.getList());
    ASSERT_TRUE(counts && list);
    EXPECT_EQ(counts->front(), capacity);
    ASSERT_EQ(list->size(), capacity);
    std::vector<uint64_t> sorted = *list;
    std::sort(sorted.begin(), sorted.end());
    EXPECT_EQ(std::unique(sorted.begin(), sorted.end()), sorted.end());
    // It has been told once.
    EXPECT_THAT(selector.check(), IsOk());

    ASSERT_THAT(select(model, transforms, view, 0.0f, MeshGraphSelector::CullNone), IsOk());
    EXPECT_THAT(selector.check(), IsOk());
    EXPECT_GE(selector.getCapacity(), 1100u * 1024u);
    EXPECT_EQ(device.read<uint32_t>(selector.getCount())->front(), 1100u * 1024u);
}

TEST_F(MeshGraphSelectorTest, ModelsHoldTheGraph) {
    const MeshGraph with_normals = *createMeshGraph(createTorus(2.0f, 0.7f, 60, 40));
    EXPECT_FALSE(with_normals.normals().empty());
    for (const MeshGraph& graph : {torus(), ring(13), with_normals}) {
        const MeshGraphModel model(device, graph, "a graph");
        ASSERT_TRUE(model) << model.error().text();
        EXPECT_EQ(model.name(), "a graph");
        EXPECT_EQ(model.getClusters().name(), "a graph clusters");
        EXPECT_EQ(*device.read<MeshCluster>(model.getClusters()),
                  std::vector(graph.clusters().begin(), graph.clusters().end()));
        EXPECT_EQ(*device.read<MeshClusterGroup>(model.getGroups()),
                  std::vector(graph.groups().begin(), graph.groups().end()));
        EXPECT_EQ(*device.read<Vector3f>(model.getPositions()),
                  std::vector(graph.positions().begin(), graph.positions().end()));
        EXPECT_EQ(*device.read<uint32_t>(model.getParents()),
                  std::vector(graph.parents().begin(), graph.parents().end()));
        EXPECT_EQ(*device.read<uint32_t>(model.getClusterVertices()),
                  std::vector(graph.clusterVertices().begin(), graph.clusterVertices().end()));
        EXPECT_EQ(*device.read<uint32_t>(model.getClusterTriangles()),
                  std::vector(graph.clusterTriangles().begin(), graph.clusterTriangles().end()));
        EXPECT_EQ(model.vertexCount(), graph.positions().size());
        EXPECT_EQ(model.rootCount(), graph.rootCount());
        EXPECT_EQ(model.groupCount(), graph.groups().size());

        // The mesh's own, or what its finest triangles have.
        const std::vector<Vector3f> normals = *device.read<Vector3f>(model.getNormals());
        ASSERT_EQ(normals.size(), graph.positions().size());
        for (const MeshCluster& cluster : graph.clusters()) {
            if (cluster.source != UINT32_MAX) continue;
            const uint32_t packed = graph.clusterTriangles()[cluster.first_triangle];
            std::array<Vector3f, 3> corners;
            for (uint32_t k = 0; k < 3; k++) {
                const uint32_t vertex = graph.clusterVertices()[cluster.first_vertex + (packed >> 10 * k & 0x3ff)];
                corners[k] = graph.positions()[vertex];
                EXPECT_NEAR(glm::length(normals[vertex]), 1.0f, 1e-6f);
                if (!graph.normals().empty()) { EXPECT_EQ(normals[vertex], graph.normals()[vertex]); }
            }
            const uint32_t vertex = graph.clusterVertices()[cluster.first_vertex + (packed & 0x3ff)];
            EXPECT_GT(glm::dot(normals[vertex], glm::cross(corners[1] - corners[0], corners[2] - corners[0])), 0.0f);
        }
        EXPECT_EQ(model.getTexcoords().state() == ObjectState::Null, graph.texcoords().empty());

        // Pieces: every cluster is in one, below the group that the piece names; none has more than it may.
        const auto pieces = *device.read<std::array<uint32_t, 4>>(model.getPieces());
        const auto walk = *device.read<std::array<uint32_t, 2>>(model.getWalk());
        EXPECT_EQ(pieces.size(), model.pieceCount());
        EXPECT_GT(model.cutLimit(), 0u);
        std::vector<uint32_t> visits(model.clusterCount(), 0);
        for (const auto& piece : pieces) {
            std::vector<uint32_t> open;
            for (uint32_t i = 0; i < piece[2]; i++) {
                open.push_back(piece[1] + i);
                EXPECT_EQ(graph.clusters()[piece[1] + i].group, piece[0]);
            }
            uint32_t count = 0;
            while (!open.empty()) {
                const uint32_t i = open.back();
                open.pop_back();
                visits[i]++;
                count++;
                for (uint32_t k = 0; k < walk[i][1]; k++) {
                    open.push_back(walk[i][0] + k);
                    EXPECT_EQ(graph.clusters()[walk[i][0] + k].group, graph.clusters()[i].source);
                }
            }
            EXPECT_LE(count, MeshGraphModel::piece_clusters);
        }
        EXPECT_EQ(visits, std::vector<uint32_t>(model.clusterCount(), 1));
        // 16,382 clusters of the ring need eight pieces at least.
        EXPECT_LE(model.pieceCount(), 1 + 3 * graph.clusters().size() / MeshGraphModel::piece_clusters);
        EXPECT_GT(model.bytes(), graph.clusters().size() * (80 + 8));
    }
}

TEST_F(MeshGraphSelectorTest, RefusesModels) {
    expectError("model.empty", [&] { return MeshGraphModel(device, MeshGraph(), "nothing").error(); });
    EXPECT_EQ(MeshGraphModel().error().id(), "handle.null");
    EXPECT_EQ(MeshGraphModel(Device(), torus()).error().id(), "handle.null");
    EXPECT_FALSE(MeshGraphModel());

    // One storage binding of the null device has 128 MiB.
    DeviceDesc desc;
    desc.api = "null";
    MessageLog messages;
    desc.message = messages.callback();
    const Device null = Device::create(desc);
    ASSERT_TRUE(null);
    MeshGraphArrays arrays;
    arrays.positions.resize((128u << 20) / sizeof(Vector3f) + 1, Vector3f(0.0f));
    arrays.clusters = {MeshCluster{.counts = 3 | 1u << 16}};
    arrays.cluster_vertices = {0, 1, 2};
    arrays.cluster_triangles = {0 | 1u << 10 | 2u << 20};
    arrays.parts = {{"part", UINT32_MAX}};
    arrays.root_count = 1;
    const Expected<MeshGraph> graph = MeshGraph::create(arrays);
    ASSERT_TRUE(graph) << graph.error().text();
    const MeshGraphModel model(null, *graph, "large");
    EXPECT_EQ(model.error().id(), "model.too_large");
    ASSERT_EQ(messages.take().size(), 1u);
}

TEST_F(MeshGraphSelectorTest, RefusesSelections) {
    const float nan = std::numeric_limits<float>::quiet_NaN();
    const MeshGraphModel model(device, torus());
    const Buffer instances = upload(std::vector<Transform3x4>(4));
    View view;
    const auto recorded = [&](const MeshGraphModel& m, const Buffer& buffer, uint32_t count, const View& v,
                              float pixels, CameraParameters camera) {
        return [&, count, pixels, camera] {
            Compute compute = device.createCompute();
            selector.select(compute, m, buffer, count, camera, v.size, pixels);
            return compute.end();
        };
    };
    const CameraParameters camera = view.camera.parameters();
    expectError("selector.instances", recorded(model, instances, 5, view, 1.0f, camera));
    expectError("selector.view", recorded(model, instances, 4, view, -1.0f, camera));
    expectError("selector.view", recorded(model, instances, 4, view, nan, camera));
    CameraParameters bad = camera;
    bad.inverse_view[1][1] = nan;
    expectError("selector.view", recorded(model, instances, 4, view, 1.0f, bad));
    bad = camera;
    bad.position.x = std::numeric_limits<float>::infinity();
    expectError("selector.view", recorded(model, instances, 4, view, 1.0f, bad));
    View flat;
    flat.size.y = 0;
    expectError("selector.view", recorded(model, instances, 4, flat, 1.0f, camera));
    expectError("handle.null", recorded(MeshGraphModel(), instances, 4, view, 1.0f, camera));
    expectError("handle.null", recorded(model, Buffer(), 4, view, 1.0f, camera));
    const Buffer plain = device.createBuffer(Buffer::FlagUniform, 192);
    expectError("buffer.flag", recorded(model, plain, 4, view, 1.0f, camera));
    // 16,382 clusters each.
    const MeshGraph large = ring(13);
    const MeshGraphModel large_model(device, large);
    const uint32_t many = UINT32_MAX / 16382 + 1;
    const Buffer crowd = device.createBuffer(Buffer::FlagStorage, uint64_t{many} * 48);
    expectError("selector.too_many", recorded(large_model, crowd, many, view, 1.0f, camera));

    MeshGraphSelector none;
    EXPECT_FALSE(none);
    EXPECT_EQ(errorOf(none.check()).id(), "handle.null");
    EXPECT_EQ(errorOf(none.create(Device())).id(), "handle.null");
    expectError("handle.null", [&] {
        Compute compute = device.createCompute();
        none.select(compute, model, instances, 4, camera, view.size, 1.0f);
        return compute.end();
    });
    EXPECT_FALSE(none.getList());
    EXPECT_EQ(none.getCapacity(), 0u);
}

}  // namespace glint::test
