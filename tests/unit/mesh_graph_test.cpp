// Graphs of levels of detail: no crack, no error beyond the bound, no cluster outside of what encloses it.

#include "support/files.h"
#include "support/hard_meshes.h"
#include "support/matchers.h"
#include "support/reference.h"
#include "support/surface_reference.h"

#include <glint/geometry/mesh_graph_builder.h>
#include <glint/geometry/primitives.h>

#include <glm/geometric.hpp>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <set>

using namespace glint;
using namespace glint::test;

namespace {

/// 22,528 triangles.
const Mesh& torus() {
    static const Mesh mesh = tutorialTorus(3);
    return mesh;
}

struct Case {
    const char* name;
    Mesh mesh;
    MeshGraph graph;
};

const std::vector<Case>& cases() {
    static const std::vector<Case> list = [] {
        std::vector<Case> all;
        const auto add = [&](const char* name, Mesh mesh) {
            Expected<MeshGraph> graph = createMeshGraph(mesh);
            EXPECT_THAT(graph, IsOk()) << name;
            if (graph) all.push_back({name, std::move(mesh), *graph});
        };
        add("torus", torus());
        add("sheet", tornSheet());
        add("two parts", twoParts());
        add("not manifold", nonManifold());
        add("soup", soup(5, 300, 4000));
        add("box", createBox({1, 2, 3}));
        add("spheres", spheres());
        return all;
    }();
    return list;
}

/// The mesh's triangles that a graph keeps: not those with two corners at one place.
Mesh withoutDegenerate(const Mesh& mesh) {
    Mesh result = mesh;
    result.indices.clear();
    for (size_t i = 0; i < mesh.indices.size(); i += 3) {
        const Vector3f &a = mesh.positions[mesh.indices[i]], &b = mesh.positions[mesh.indices[i + 1]],
                       &c = mesh.positions[mesh.indices[i + 2]];
        if (a != b && b != c && c != a)
            result.indices.insert(result.indices.end(), mesh.indices.begin() + i, mesh.indices.begin() + i + 3);
    }
    result.parts.clear();
    return result;
}

/// Any cut: groups are refined at random, each only if all that contain it are.
std::vector<uint32_t> randomCut(const MeshGraph& graph, Random& random, double chance) {
    std::vector<uint8_t> refined(graph.groups().size(), 0);
    for (size_t i = 0; i < refined.size(); i++) {
        const MeshClusterGroup& group = graph.groups()[i];
        bool may = random.uniform() < chance;
        for (const uint32_t parent : graph.parents().subspan(group.first_parent, group.parent_count)) {
            const uint32_t container = graph.clusters()[parent].group;
            may = may && (container == UINT32_MAX || refined[container]);
        }
        refined[i] = may;
    }
    // By the rule, cluster by cluster, and by the walk: the same clusters, none twice.
    std::vector<uint32_t> chosen, walked;
    for (uint32_t i = 0; i < graph.clusters().size(); i++) {
        const MeshCluster& c = graph.clusters()[i];
        if ((c.source == UINT32_MAX || !refined[c.source]) && (c.group == UINT32_MAX || refined[c.group]))
            chosen.push_back(i);
    }
    graph.walk([&](const MeshClusterGroup& group) { return refined[&group - graph.groups().data()] != 0; },
               [&](uint32_t cluster) { walked.push_back(cluster); });
    std::sort(walked.begin(), walked.end());
    EXPECT_EQ(walked, chosen);
    return chosen;
}

float errorOf(const MeshGraph& graph, std::span<const uint32_t> cut) {
    float error = 0.0f;
    for (const uint32_t i : cut)
        if (graph.clusters()[i].source != UINT32_MAX)
            error = std::max(error, graph.groups()[graph.clusters()[i].source].error);
    return error;
}

MeshGraphView randomView(Random& random, const Mesh& mesh, double nearest, double farthest) {
    Camera camera;
    const double distance = std::exp(random.uniform(std::log(nearest), std::log(farthest)));
    const Vector3f center = mesh.bounds().center();
    camera.lookAt(center + Vector3f(distance * random.direction()), center);
    camera.perspective(60.0f, 16.0f / 9.0f, 0.01f);
    // Mostly as it is, sometimes turned, mirrored and stretched by 1 : 10.
    const Matrix4x4f to_world = random.below(3) > 0 ? Matrix4x4f(1.0f)
                                                    : rotateX(40.0f) * scale({0.3f, -3.0f, 1.0f}) *
                                                          rotateZ(static_cast<float>(random.uniform(0, 360)));
    return MeshGraphView(camera.parameters(), {1600, 900}, Transform3x4(to_world));
}

}  // namespace

TEST(MeshGraph, EveryCutHasTheMeshsBoundary) {
    for (const Case& c : cases()) {
        SCOPED_TRACE(c.name);
        Random random(1);
        const std::vector<BoundaryEdge> expected = boundaryOf(withoutDegenerate(c.mesh));
        std::vector<std::vector<uint32_t>> cuts;
        for (const double chance : {0.0, 0.5, 0.8, 0.9, 0.95, 1.0})
            for (int i = 0; i < 4; i++) cuts.push_back(randomCut(c.graph, random, chance));
        for (int i = 0; i < 10; i++)
            cuts.push_back(c.graph.cut(randomView(random, c.mesh, 2, 200), static_cast<float>(random.uniform(0.1, 8))));
        std::set<size_t> sizes;
        for (const std::vector<uint32_t>& cut : cuts) {
            const Mesh mesh = c.graph.mesh(cut);
            EXPECT_THAT(mesh.validate(), IsOk());
            EXPECT_TRUE(boundaryOf(mesh) == expected) << mesh.triangleCount() << " triangles";
            sizes.insert(mesh.triangleCount());
        }
        // Of the soup hardly an edge is one that can be simplified.
        if (c.mesh.triangleCount() > 3000 && c.name != std::string("soup")) {
            EXPECT_GT(sizes.size(), 4u) << "always the same";
        }
        // The finest one is the mesh, triangle by triangle.
        const Mesh finest = c.graph.mesh(c.graph.cut(-1.0f));
        EXPECT_EQ(finest.triangleCount(), withoutDegenerate(c.mesh).triangleCount());
        EXPECT_NEAR(areaOf(finest), areaOf(c.mesh), 1e-9 * areaOf(c.mesh));
    }
    // A boundary that has changed would be seen.
    Mesh broken = torus();
    EXPECT_TRUE(boundaryOf(broken).empty());
    broken.positions[100].x += 1e-6f;
    EXPECT_TRUE(boundaryOf(broken).empty());
    broken.indices.resize(broken.indices.size() - 3);
    EXPECT_EQ(boundaryOf(broken).size(), 3u);
}

// Of the torus, 22,528 triangles come down to one cluster of at most 128, by halves.
TEST(MeshGraph, LevelsAreFewerAndFewer) {
    const MeshGraph& graph = cases().front().graph;
    EXPECT_EQ(graph.rootCount(), 1u);
    EXPECT_GE(graph.groups().front().level, 7u);
    size_t last = SIZE_MAX;
    for (float error = 0.0f; error < 4.0f; error = error * 2 + 0.001f) {
        const std::vector<uint32_t> cut = graph.cut(error);
        EXPECT_LE(cut.size(), last);
        EXPECT_LE(errorOf(graph, cut), error);
        last = cut.size();
    }
    EXPECT_EQ(last, 1u);
    // Where there is more than a cluster's worth, a group has two parents or more.
    size_t several = 0;
    for (const MeshClusterGroup& group : graph.groups()) several += group.parent_count > 1;
    EXPECT_GE(several + 2, graph.groups().size());
    // Clusters are full: 128 triangles of a closed mesh have at least 66 vertices, and a good cluster not many more.
    EXPECT_LT(graph.clusters().size(), 2 * 22528 / 128 * 1.15);
}

// Both ways, at some thousand points: a bound that were too small would show at those that happen to be far.
TEST(MeshGraph, ErrorsBoundTheDistance) {
    for (const Case& c : cases()) {
        if (c.mesh.triangleCount() > 12000) continue;  // the reference tries every triangle
        SCOPED_TRACE(c.name);
        const Mesh mesh = withoutDegenerate(c.mesh);
        const double size = glm::length(mesh.bounds().size());
        const NearestReference to_mesh(mesh);
        Random random(2);
        for (const double part : {0.002, 0.02, 0.3}) {
            const std::vector<uint32_t> cut = c.graph.cut(static_cast<float>(part * size));
            const Mesh shown = c.graph.mesh(cut);
            const NearestReference to_shown(shown);
            const double error = errorOf(c.graph, cut);
            double distance = 0.0;
            const auto measure = [&](const Mesh& from, const NearestReference& to) {
                const std::vector<Vector3d> points = samplePoints(from, size * 0.02);
                const uint64_t step = points.size() / 1500 + 1;
                for (size_t i = 0; i < points.size(); i += 1 + random.below(2 * step - 1))
                    distance = std::max(distance, to.distance(points[i]));
            };
            measure(mesh, to_shown);
            measure(shown, to_mesh);
            EXPECT_LE(distance, error + 1e-12 * size);
            // Not idle: errors of levels add up to no more than a few times of what is there.
            if (part < 0.1 && c.name == std::string("sheet")) { EXPECT_GE(distance * 4, error); }
        }
    }
}

// What a screen shows: a point of the mesh and the nearest of the cut lie within the stated number of pixels.
TEST(MeshGraph, PixelErrorsBoundThePicture) {
    const Mesh mesh = createTorus(2.0f, 0.7f, 80, 50);
    const MeshGraph graph = *createMeshGraph(mesh);
    Random random(4);
    const std::vector<Vector3d> points = samplePoints(mesh, 0.2);
    const NearestReference to_mesh(mesh);
    for (int i = 0; i < 12; i++) {
        Camera camera;
        const Vector3f eye(random.uniform(2.9, 30) * random.direction());
        camera.lookAt(eye, {0, 0, 0}).perspective(70.0f, 2.0f, 0.05f);
        // Mirrored, turned, stretched by 1 : 1.5 : 0.7; the eye moves along.
        const Matrix4x4f to_world = i % 3 == 0 ? Matrix4x4f(1.0f)
                                               : translate({3, 1, 2}) * rotateX(40.0f) * scale({1, -1.5, 0.7}) *
                                                     rotateZ(static_cast<float>(30 * i));
        camera.lookAt(transformPoint(to_world, eye), transformPoint(to_world, {0, 0, 0}));
        const CameraParameters parameters = camera.parameters();
        const Vector2u size(800, 400);
        const MeshGraphView view(parameters, size, Transform3x4(to_world));
        const float pixels = std::array{0.5f, 1.0f, 4.0f}[i % 3];
        const std::vector<uint32_t> cut = graph.cut(view, pixels);
        const Mesh shown = graph.mesh(cut);
        const NearestReference nearest(shown);
        const glm::dmat4 to_clip =
            glm::dmat4(parameters.projection) * glm::dmat4(parameters.view) * glm::dmat4(to_world);
        const auto project = [&](const Vector3d& p, Vector2d& place) {
            const Vector4d clip = to_clip * Vector4d(p, 1.0);
            place = Vector2d(clip.x, clip.y) / clip.w;
            return clip.w > 0.05 && std::abs(place.x) <= 1.0 && std::abs(place.y) <= 1.0;
        };
        double largest = 0.0;
        size_t seen = 0;
        const auto measure = [&](const std::vector<Vector3d>& from, const NearestReference& to) {
            for (size_t k = random.below(30); k < from.size(); k += 30) {
                Vector2d a, b;
                if (!project(from[k], a) || !project(to.nearest(from[k]), b)) continue;
                seen++;
                largest = std::max(largest, glm::length((a - b) * Vector2d(size) * 0.5));
            }
        };
        measure(points, nearest);
        measure(samplePoints(shown, 0.2), to_mesh);
        EXPECT_GT(seen, 100u);
        EXPECT_LE(largest, pixels) << cut.size() << " clusters from " << glm::length(eye);
    }
}

TEST(MeshGraph, BoundsHold) {
    for (const Case& c : cases()) {
        SCOPED_TRACE(c.name);
        Random random(3);
        size_t culled = 0, tried = 0;
        std::vector<std::set<uint32_t>> below(c.graph.groups().size());
        for (uint32_t i = 0; i < c.graph.clusters().size(); i++) {
            const MeshCluster& cluster = c.graph.clusters()[i];
            const std::vector<uint32_t> one = {i};
            const Mesh mesh = c.graph.mesh(one);
            EXPECT_EQ(mesh.bounds(), BoundBox(cluster.box_min, cluster.box_max));
            for (const Vector3f& p : mesh.positions)
                EXPECT_LE(glm::distance(Vector3d(p), Vector3d(cluster.center)), cluster.radius);
            for (int k = 0; k < 20; k++) {
                // From all over, and from close by.
                const Vector3f eye = cluster.center + Vector3f(random.direction() * double{cluster.radius} *
                                                               std::exp(random.uniform(-0.5, 5)));
                tried++;
                if (!cluster.isFacingAway(eye)) continue;
                culled++;
                for (size_t t = 0; t < mesh.indices.size(); t += 3) {
                    const Vector3d a(mesh.positions[mesh.indices[t]]), b(mesh.positions[mesh.indices[t + 1]]),
                        d(mesh.positions[mesh.indices[t + 2]]);
                    const Vector3d normal = glm::cross(b - a, d - a);
                    EXPECT_GE(glm::dot(a - Vector3d(eye), normal), 0.0) << "cluster " << i;
                }
            }
        }
        if (c.name == std::string("torus")) { EXPECT_GT(culled * 10, tried) << "cones cull nothing"; }

        // Groups from below: their balls and boxes hold all of the mesh that they stand for.
        for (size_t g = c.graph.groups().size(); g-- > 0;) {
            const MeshClusterGroup& group = c.graph.groups()[g];
            for (uint32_t i = group.first_child; i < group.first_child + group.child_count; i++) {
                const uint32_t source = c.graph.clusters()[i].source;
                if (source == UINT32_MAX)
                    below[g].insert(i);
                else
                    below[g].insert(below[source].begin(), below[source].end());
            }
            std::vector<uint32_t> all(below[g].begin(), below[g].end());
            const auto parents = c.graph.parents().subspan(group.first_parent, group.parent_count);
            all.insert(all.end(), parents.begin(), parents.end());
            const Mesh mesh = c.graph.mesh(all);
            for (const Vector3f& p : mesh.positions) {
                EXPECT_LE(glm::distance(Vector3d(p), Vector3d(group.center)), group.radius);
                EXPECT_TRUE(BoundBox(group.box_min, group.box_max).contains(p));
            }
        }
    }
}

// In float32, as a shader computes it: near and far, where a distance is the difference of two large numbers.
TEST(MeshGraph, ProjectedErrorsAreMonotone) {
    size_t compared = 0;
    for (const Case& c : cases()) {
        if (c.graph.groups().empty()) continue;
        Random random(6);
        for (int i = 0; i < 300; i++) {
            MeshGraphView view = randomView(random, c.mesh, 1e-3, 1e7);
            if (i % 3 == 0) {
                // Close to the surface of some group's ball.
                const MeshClusterGroup& group = c.graph.groups()[random.below(c.graph.groups().size())];
                view.eye = group.center + Vector3f(random.direction() * double{group.radius} *
                                                   (1.0 + std::pow(10.0, -random.uniform(0, 7))));
            }
            for (const MeshCluster& cluster : c.graph.clusters()) {
                if (cluster.source == UINT32_MAX || cluster.group == UINT32_MAX) continue;
                compared++;
                ASSERT_LE(view.error(c.graph.groups()[cluster.source]), view.error(c.graph.groups()[cluster.group]));
            }
        }
    }
    EXPECT_GT(compared, 100000u);
}

TEST(MeshGraph, TheSameWithAnyNumberOfThreads) {
    const Mesh mesh = createTorus(2.0f, 0.7f, 80, 50);
    const MeshGraph one = *createMeshGraph(mesh, {.threads = 1}), three = *createMeshGraph(mesh, {.threads = 3});
    EXPECT_TRUE(std::ranges::equal(one.bytes(), three.bytes()));
}

TEST(MeshGraph, KeepsAttributesAndParts) {
    const Mesh mesh = twoParts();
    const MeshGraph graph = *createMeshGraph(mesh);
    const std::vector<MeshGraphPart> parts = {{"left", 3}, {"right", 5}};
    EXPECT_EQ(graph.parts(), parts);
    std::map<std::array<float, 3>, Vector3f> normals;
    for (size_t i = 0; i < mesh.positions.size(); i++)
        normals[{mesh.positions[i].x, mesh.positions[i].y, mesh.positions[i].z}] = mesh.normals[i];
    for (const float error : {0.0f, 0.05f, 1.0f}) {
        const Mesh shown = graph.mesh(graph.cut(error));
        ASSERT_EQ(shown.parts.size(), 2u);
        EXPECT_EQ(shown.parts[0].name, "left");
        EXPECT_EQ(shown.parts[1].material, 5u);
        for (size_t i = 0; i < shown.positions.size(); i++)
            ASSERT_EQ(shown.normals[i], (normals[{shown.positions[i].x, shown.positions[i].y, shown.positions[i].z}]));
    }
    const MeshGraph torn = *createMeshGraph(tornSheet());
    EXPECT_EQ(torn.texcoords().size(), torn.positions().size());
    EXPECT_EQ(torn.normals().size(), torn.positions().size());
}

TEST(MeshGraph, RefusesWhatItCannotDo) {
    const Mesh good = createTorus(1.0f, 0.4f, 20, 10);
    const auto expect = [](const Mesh& mesh, const char* id, const MeshGraphOptions& options = {}) {
        EXPECT_THAT(createMeshGraph(mesh, options), HasErrorId(id));
    };
    expect(Mesh(), "mesh.no_faces");
    Mesh bad = good;
    bad.positions[3].y = NAN;
    expect(bad, "mesh.not_finite");
    bad = good;
    bad.normals[3].y = INFINITY;
    expect(bad, "mesh.not_finite");
    bad = good;
    bad.indices[5] = 4000;
    expect(bad, "mesh.index_range");
    bad = good;
    bad.indices.pop_back();
    expect(bad, "mesh.index_count");
    bad = good;
    bad.positions[3].y = 2e18f;
    expect(bad, "graph.too_large");
    bad = good;
    for (Vector3f& p : bad.positions) p = {1, 2, 3};
    expect(bad, "graph.no_triangles");
    expect(good, "graph.options", {.group_clusters = 1});
    expect(good, "graph.options", {.group_clusters = 65});
    expect(good, "graph.too_large", {.limit = 3000});
    expect(good, "graph.too_large", {.limit = 1000});

    int calls = 0;
    MeshGraphOptions options;
    float last = 0.0f;
    options.progress = [&](float share) {
        EXPECT_GE(share, last);
        EXPECT_LE(share, 1.0f);
        last = share;
        return ++calls < 2;
    };
    expect(createTorus(1.0f, 0.4f, 60, 40), "graph.cancelled", options);
    EXPECT_EQ(calls, 2);
}

TEST(MeshGraph, SmallAndBadMeshes) {
    Mesh one;
    one.positions = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
    one.indices = {0, 1, 2};
    // One triangle, the same one many times, many that lie on each other the other way round, all in a line.
    std::vector<Mesh> meshes = {one, one, one, one};
    for (int i = 0; i < 1000; i++) {
        meshes[1].indices.insert(meshes[1].indices.end(), {0, 1, 2});
        meshes[2].indices.insert(meshes[2].indices.end(), {0, static_cast<uint32_t>(1 + i % 2), 2u - i % 2});
    }
    meshes[3].positions.clear();
    meshes[3].indices.clear();
    for (uint32_t i = 0; i < 3000; i++) {
        meshes[3].positions.emplace_back(static_cast<float>(i), 0, 0);
        if (i >= 2) meshes[3].indices.insert(meshes[3].indices.end(), {i - 2, i - 1, i});
    }
    for (int seed = 0; seed < 4; seed++) meshes.push_back(soup(seed, 4u << 2 * seed, 1500));
    for (Mesh& mesh : meshes) {
        const Expected<MeshGraph> graph = createMeshGraph(mesh);
        ASSERT_THAT(graph, IsOk());
        const std::vector<BoundaryEdge> expected = boundaryOf(withoutDegenerate(mesh));
        for (const float error : {-1.0f, 0.01f, 0.5f, INFINITY})
            EXPECT_TRUE(boundaryOf(graph->mesh(graph->cut(error))) == expected);
    }
}

TEST(MeshGraph, Bunny) {
    GLINT_NEED_BUNNY();
    const Mesh mesh = *Mesh::load(bunnyPath());
    const Expected<MeshGraph> graph = createMeshGraph(mesh);
    ASSERT_THAT(graph, IsOk());
    const std::vector<BoundaryEdge> expected = boundaryOf(mesh);
    for (const float error : {0.001f, 0.01f, 0.1f}) EXPECT_TRUE(boundaryOf(graph->mesh(graph->cut(error))) == expected);
}
