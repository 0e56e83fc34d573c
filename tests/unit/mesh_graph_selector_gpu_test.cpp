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

Matrix4x4f randomTurn(Random& random) {
    return rotateX(static_cast<float>(random.uniform(0, 360))) * rotateY(static_cast<float>(random.uniform(0, 360))) *
           rotateZ(static_cast<float>(random.uniform(0, 360)));
}

struct View {
    Camera camera;
    Vector2u size = {1600, 900};
};

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
        uint64_t triangles = 0;
        for (uint32_t i = 0; i < counts->front(); i++) {
            const Entry& entry = (*list)[i];
            EXPECT_TRUE(entry[0] < transforms.size() && entry[1] < model.clusterCount()) << entry[0] << " " << entry[1];
            if (entry[0] >= transforms.size()) return result;
            result[entry[0]].push_back(entry[1]);
        }
        (void)triangles;
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

}  // namespace

TEST_F(MeshGraphSelectorTest, ListsTheHostsCut) {
    const MeshGraph& graph = torus();
    const MeshGraphModel model(device, graph, "torus");
    ASSERT_TRUE(model) << model.error().text();
    Random random(7);
    uint32_t near_ones = 0, groups = 0;
    for (int round = 0; round < 12; round++) {
        View view;
        const Vector3f eye = Vector3f(random.direction()) * static_cast<float>(std::exp2(random.uniform(-1, 7)));
        view.camera.lookAt(eye, Vector3f(random.direction())).perspective(60.0f, 16.0f / 9.0f);
        std::vector<Transform3x4> transforms;
        for (int i = 0; i < 20; i++)
            transforms.emplace_back(translate(Vector3f(random.direction() * random.uniform(0, 40))) *
                                    randomTurn(random));
        const auto pixels = static_cast<float>(std::exp2(random.uniform(-4, 4)));
        const auto lists = listOf(model, transforms, view, pixels);
        for (size_t i = 0; i < transforms.size(); i++) {
            const MeshGraphView on_host(view.camera.parameters(), view.size, transforms[i]);
            std::vector<bool> refined;
            ASSERT_TRUE(decisionsOf(graph, lists[i], refined)) << round << " " << i;
            const double distance = glm::length(Vector3d(on_host.eye));
            for (size_t k = 0; k < refined.size(); k++) {
                const MeshClusterGroup& group = graph.groups()[k];
                const float error = on_host.error(group);
                groups++;
                if (refined[k] == !(error <= pixels)) continue;
                near_ones++;
                const double depth = group.error * on_host.scale / error;
                EXPECT_NEAR(error, pixels, pixels * (0x1p-14 + 0x1p-18 * distance * on_host.stretch / depth))
                    << round << " " << i << " " << k;
            }
        }
    }
    EXPECT_LT(near_ones, groups / 1000);
    std::printf("%u of %u groups\n", near_ones, groups);
}

}  // namespace glint::test
