// Rasterizer: lists that are too short, bad input, sizes, clusters of instances, and what shading after it reads.

#include "rasterizer_test.h"
#include "support/kernel_values.h"

#include <glint/geometry/mesh_graph_builder.h>
#include <glint/geometry/primitives.h>
#include <glint/graphics/mesh_graph_model.h>

#include <algorithm>
#include <cmath>
#include <limits>

namespace glint::test {

namespace {

constexpr float infinity = std::numeric_limits<float>::infinity();
constexpr float nan = std::numeric_limits<float>::quiet_NaN();

Triangles whole(float depth = 0.5f) {
    Triangles triangles;
    triangles.add({-1, -1, depth}, {3, -1, depth}, {-1, 3, depth});
    return triangles;
}

/// Pixels with a triangle.
size_t covered(const std::vector<uint64_t>& pixels) {
    return static_cast<size_t>(
        std::count_if(pixels.begin(), pixels.end(), [](uint64_t p) { return p != Rasterizer::background; }));
}

using RasterizerListsTest = RasterizerTest;
using RasterizerListsLong = RasterizerTest;

}  // namespace

TEST_F(RasterizerListsTest, RefusesWhatItCannotDraw) {
    for (const uint32_t capacity : {0u, 15u, (1u << 22) + 1}) {
        Rasterizer rasterizer;
        Rasterizer::Options options;
        options.capacity = capacity;
        EXPECT_THAT(rasterizer.create(device, options), HasErrorId("raster.options"));
        EXPECT_FALSE(rasterizer);
    }
    Rasterizer::Options options;
    options.small_pixels = 1025;
    Rasterizer rasterizer;
    EXPECT_THAT(rasterizer.create(device, options), HasErrorId("raster.options"));
    EXPECT_THAT(rasterizer.create(Device()), HasErrorId("handle.null"));
    EXPECT_THAT(rasterizer.check(), HasErrorId("handle.null"));

    const Rasterizer::Mesh mesh = upload(whole());
    const auto fails = [&](std::string_view id, const auto& record) {
        expectError(id, [&] {
            Compute compute = device.createCompute();
            record(compute);
            return device.submit(compute);
        });
    };
    fails("handle.null", [&](Compute& c) { rasterizer.begin(c, {4, 4}); });
    fails("handle.null", [&](Compute& c) { rasterizer.draw(c, mesh, Matrix4x4f(1.0f)); });
    ASSERT_THAT(rasterizer.create(device), IsOk());
    fails("raster.begin", [&](Compute& c) { rasterizer.draw(c, mesh, Matrix4x4f(1.0f)); });
    for (const Vector2u size : {Vector2u(0, 4), Vector2u(4, 0), Vector2u(16385, 1), Vector2u(1, 16385)})
        fails("raster.size", [&](Compute& c) { rasterizer.begin(c, size); });
    if (device.getFeatures().maxStorageSize < uint64_t{16384} * 16384 * 8)
        fails("raster.size", [&](Compute& c) { rasterizer.begin(c, {16384, 16384}); });

    const auto refuses = [&](std::string_view id, const Rasterizer::Mesh& bad, uint32_t first_id = 0,
                             const Matrix4x4f& matrix = Matrix4x4f(1.0f)) {
        fails(id, [&](Compute& c) {
            rasterizer.begin(c, {4, 4});
            rasterizer.draw(c, bad, matrix, first_id);
        });
    };
    refuses("raster.ids", mesh, UINT32_MAX);
    const auto changed = [&](const auto& change) {
        Rasterizer::Mesh bad = mesh;
        change(bad);
        return bad;
    };
    refuses("raster.mesh", changed([](Rasterizer::Mesh& m) { m.position_stride = 8; }));
    refuses("raster.mesh", changed([](Rasterizer::Mesh& m) { m.position_stride = 14; }));
    refuses("raster.mesh", changed([](Rasterizer::Mesh& m) { m.position_offset = 2; }));
    refuses("raster.mesh", changed([](Rasterizer::Mesh& m) { m.position_offset = 28; }));
    refuses("raster.mesh", changed([](Rasterizer::Mesh& m) { m.position_offset = UINT64_MAX - 3; }));
    const Buffer indices = device.createBuffer(Buffer::FlagStorage, 12);
    refuses("raster.mesh", changed([&](Rasterizer::Mesh& m) { m.indices = indices, m.triangles = 2; }));
    refuses("raster.mesh", changed([&](Rasterizer::Mesh& m) { m.indices = indices, m.index_offset = 4; }));
    refuses("raster.mesh",
            changed([&](Rasterizer::Mesh& m) { m.positions = device.createBuffer(Buffer::FlagVertex, 64); }));
    refuses("handle.null", changed([](Rasterizer::Mesh& m) { m.positions = Buffer(); }));
    Matrix4x4f matrix(1.0f);
    matrix[2][1] = nan;
    refuses("raster.matrix", mesh, 0, matrix);
    log.expectNone();
}

TEST_F(RasterizerListsTest, LeavesOutTrianglesThatAreNone) {
    const Vector2u size(32, 32);
    Rasterizer rasterizer = create();
    Triangles bad;
    const Vector3f good[3] = {{-1, -1, 0.5f}, {3, -1, 0.5f}, {-1, 3, 0.5f}};
    for (const float value : {nan, -nan, infinity, -infinity, std::numeric_limits<float>::max()})
        for (int corner = 0; corner < 3; corner++)
            for (int axis = 0; axis < 3; axis++) {
                Vector3f corners[3] = {good[0], good[1], good[2]};
                corners[corner][axis] = value;
                // The largest finite number stays finite here, and is cut or out of sight.
                if (std::isfinite(value) && axis < 2) continue;
                bad.add(corners[0], corners[1], corners[2]);
            }
    // Points, lines, and what has no area once it is rounded.
    bad.add(good[0], good[0], good[0]);
    bad.add(good[0], good[1], good[0]);
    bad.add({-1, -1, 0.5f}, {0, 0, 0.5f}, {1, 1, 0.5f});
    bad.add({0, 0, 0.5f}, {1e-5f, 0, 0.5f}, {0, 1e-5f, 0.5f});
    // Beyond the far end, nearer than the near plane, beside the picture.
    bad.add({-1, -1, 0}, {3, -1, 0}, {-1, 3, 0});
    bad.add({-1, -1, -1}, {3, -1, -2}, {-1, 3, -3});
    bad.add({-1, -1, 1.5f}, {3, -1, 1.5f}, {-1, 3, 2});
    bad.add({1.5f, -1, 0.5f}, {3, -1, 0.5f}, {1.5f, 3, 0.5f});
    EXPECT_EQ(covered(draw(rasterizer, bad, size)), 0u);

    // A vertex that is not there takes its triangle along, and none of the others.
    Triangles indexed = whole();
    indexed.indices = {0, 1, 3, 0, 1, ~0u, 0, 1, 2, 2, 1, 1u << 30};
    const std::vector<uint64_t> pixels = draw(rasterizer, indexed, size);
    EXPECT_EQ(covered(pixels), 1024u);
    EXPECT_EQ(triangleOf(pixels[0]), 2u);

    // A corner that is as far away as there is.
    Triangles far;
    far.add({-1, -1, 0.5f}, {std::numeric_limits<float>::max(), -1, 0.5f},
            {-1, std::numeric_limits<float>::max(), 0.5f});
    far.add({-1e30f, 1e30f, 0.25f}, {-1e30f, -1e30f, 0.25f}, {1e30f, 0, 0.25f});
    EXPECT_EQ(covered(draw(rasterizer, far, size)), 1024u);
}

TEST_F(RasterizerListsTest, CullsByTheWayAround) {
    const Vector2u size(16, 16);
    Rasterizer rasterizer = create();
    for (const uint32_t small : {0u, 1024u})
        for (const float reach : {1.0f, 1000.0f, 1e9f}) {
            Rasterizer::Options options;
            options.small_pixels = small;
            ASSERT_THAT(rasterizer.create(device, options), IsOk());
            Triangles front;
            front.add({-reach, -reach, 0.5f}, {reach, -reach, 0.5f}, {0, reach, 0.5f});
            Triangles back;
            back.add(front.positions[0], front.positions[2], front.positions[1]);
            const Matrix4x4f same(1.0f);
            EXPECT_GT(covered(draw(rasterizer, front, size, same, Rasterizer::CullBack)), 50u) << reach;
            EXPECT_EQ(covered(draw(rasterizer, front, size, same, Rasterizer::CullFront)), 0u) << reach;
            EXPECT_EQ(covered(draw(rasterizer, back, size, same, Rasterizer::CullBack)), 0u) << reach;
            EXPECT_GT(covered(draw(rasterizer, back, size, same, Rasterizer::CullFront)), 50u) << reach;
        }
}

TEST_F(RasterizerListsTest, GrowsItsLists) {
    const Vector2u size(64, 64);
    std::mt19937 random(3);
    Triangles large, behind;
    for (int i = 0; i < 300; i++) {
        const float depth = between(random, 0.1f, 0.9f);
        large.add({-1, -1, depth}, {3, -1, depth}, {-1, 3, depth});
        behind.add({-1, -1, depth}, {3e6f, -1, depth}, {-1, 3e6f, depth});
    }
    Rasterizer roomy = create();
    Rasterizer::Options options;
    options.capacity = 16;
    for (const bool narrow : {false, true})
        for (const Triangles& triangles : {large, behind}) {
            options.narrow = narrow;
            Rasterizer rasterizer = create(options);
            const Rasterizer::Mesh mesh = upload(triangles);
            const std::vector<uint64_t> expected = draw(roomy, mesh, size);
            Compute compute = device.createCompute();
            rasterizer.begin(compute, size);
            rasterizer.draw(compute, mesh, Matrix4x4f(1.0f));
            ASSERT_THAT(device.submit(compute), IsOk());
            EXPECT_THAT(rasterizer.check(), HasErrorId("raster.capacity"));
            // What is cut needs room in the second list, too, which is known only when the first one suffices.
            for (int i = 0; i < 2; i++) {
                Compute again = device.createCompute();
                rasterizer.begin(again, size);
                rasterizer.draw(again, mesh, Matrix4x4f(1.0f));
                ASSERT_THAT(device.submit(again), IsOk());
                if (rasterizer.check()) break;
            }
            log.take();
            EXPECT_EQ(draw(rasterizer, mesh, size), expected) << narrow;
            EXPECT_GE(rasterizer.getStatistics().capacity, 300u);
        }
}

TEST_F(RasterizerListsTest, DrawsSeveralMeshesIntoPicturesOfAnySize) {
    Rasterizer rasterizer = create();
    for (const Vector2u size :
         {Vector2u(1, 1), Vector2u(17, 3), Vector2u(1, 300), Vector2u(8191, 5), Vector2u(16384, 1)})
        for (const bool narrow : {false, true}) {
            Rasterizer::Options options;
            options.narrow = narrow;
            ASSERT_THAT(rasterizer.create(device, options), IsOk());
            // The nearer one first; it has the left half.
            Triangles near;
            near.add({-1, -1, 0.75f}, {0, -1, 0.75f}, {0, 1, 0.75f});
            near.add({-1, -1, 0.75f}, {0, 1, 0.75f}, {-1, 1, 0.75f});
            Compute compute = device.createCompute();
            rasterizer.begin(compute, size);
            rasterizer.draw(compute, upload(near), Matrix4x4f(1.0f), 10);
            rasterizer.draw(compute, upload(whole(0.5f)), Matrix4x4f(1.0f), 20);
            rasterizer.draw(compute, upload(whole(0.5f)), Matrix4x4f(1.0f), 15);
            rasterizer.draw(compute, Rasterizer::Mesh{upload(near).positions, 0, 12, {}, 0, 0}, Matrix4x4f(1.0f));
            ASSERT_THAT(device.submit(compute), IsOk());
            const std::vector<uint64_t> pixels = read(rasterizer);
            for (size_t i = 0; i < pixels.size(); i++) {
                // The centre of an odd number of columns is at the edge: not a left one of the nearer mesh.
                const bool is_left = 2 * (i % size.x) + 1 < size.x;
                ASSERT_EQ(triangleOf(pixels[i]),
                          is_left ? triangleOf(pixels[i]) <= 11 ? triangleOf(pixels[i]) : 10 : 15)
                    << i << " of " << size.x << "x" << size.y;
                ASSERT_EQ(depthOf(pixels[i]), is_left ? 0.75f : 0.5f);
            }
        }
}

TEST_F(RasterizerListsTest, ReadsWhereItIsTold) {
    // Positions with other things between them, from odd offsets.
    const Vector2u size(8, 8);
    Rasterizer rasterizer = create();
    std::vector<float> values(5, nan);
    for (const Vector3f& p : whole().positions) values.insert(values.end(), {p.x, p.y, p.z, nan, nan});
    const std::vector<uint32_t> indices = {7, 7, 7, 0, 1, 2, 9};
    const Rasterizer::Mesh mesh = {device.createBuffer(Buffer::FlagStorage, std::span(values)),  20, 20,
                                   device.createBuffer(Buffer::FlagStorage, std::span(indices)), 12, 1};
    EXPECT_EQ(covered(draw(rasterizer, mesh, size)), 64u);
}

namespace {

class RasterizerClustersTest : public RasterizerTest {
protected:
    std::vector<uint64_t> drawClusters(Rasterizer& rasterizer, const MeshGraphModel& model,
                                       const std::vector<Transform3x4>& instances, const std::vector<Vector2u>& list,
                                       const CameraParameters& camera, const Vector2u& size) {
        const std::vector<uint32_t> count = {static_cast<uint32_t>(list.size())};
        Compute compute = device.createCompute();
        rasterizer.begin(compute, size);
        rasterizer.drawClusters(compute, model, device.createBuffer(Buffer::FlagStorage, std::span(instances)),
                                device.createBuffer(Buffer::FlagStorage, std::span(list)),
                                device.createBuffer(Buffer::FlagStorage, std::span(count)), camera,
                                Rasterizer::CullBack);
        EXPECT_THAT(device.submit(compute), IsOk());
        return read(rasterizer);
    }
};

}  // namespace

TEST_F(RasterizerClustersTest, AreTheTrianglesOfTheirMesh) {
    const auto graph = createMeshGraph(createTorus(1.0f, 0.4f, 64, 32));
    ASSERT_THAT(graph, IsOk());
    const MeshGraphModel model(device, *graph);
    ASSERT_THAT(model, IsOk());
    const Vector2u size(200, 150);
    // A view and instances that are exact, so that both ways round alike: a quarter turn of the view, whole offsets.
    const CameraParameters camera =
        Camera().lookAt({0, -4, 0}, {0, 0, 0}).perspective(60.0f, 4.0f / 3.0f, 0.5f).parameters();
    const std::vector<Transform3x4> instances = {Transform3x4(), Transform3x4(translate({0, 2, 0})),
                                                 Transform3x4(translate({0.5f, -4, 0.25f}))};
    const std::vector<uint32_t> clusters = graph->cut(0.0f);
    std::vector<Vector2u> list;
    for (uint32_t i = 0; i < instances.size(); i++)
        for (const uint32_t cluster : clusters) list.emplace_back(i, cluster);
    // What does not exist is left out.
    list.emplace_back(3, 0);
    list.emplace_back(0, model.clusterCount());
    Rasterizer rasterizer = create();
    const std::vector<uint64_t> pixels = drawClusters(rasterizer, model, instances, list, camera, size);
    EXPECT_GT(rasterizer.getStatistics().clipped, 0u);
    EXPECT_GT(covered(pixels), 5000u);

    // The same triangles as meshes.
    Compute compute = device.createCompute();
    Rasterizer meshes = create();
    meshes.begin(compute, size);
    std::vector<uint32_t> ids;
    for (uint32_t i = 0; i < instances.size(); i++) {
        Triangles triangles;
        const uint32_t first = static_cast<uint32_t>(ids.size());
        for (const uint32_t cluster : clusters) {
            const Mesh mesh = graph->mesh(std::span(&cluster, 1));
            for (size_t k = 0; k < mesh.triangleCount(); k++) {
                const auto corner = [&](size_t c) {
                    return transformPoint(instances[i].matrix(), mesh.positions[mesh.indices[3 * k + c]]);
                };
                triangles.add(corner(0), corner(1), corner(2));
                ids.push_back((i * model.clusterCount() + cluster) * 128 + static_cast<uint32_t>(k));
            }
        }
        meshes.draw(compute, upload(triangles), Matrix4x4f(Matrix4x4d(camera.projection) * Matrix4x4d(camera.view)),
                    first, Rasterizer::CullBack);
    }
    ASSERT_THAT(device.submit(compute), IsOk());
    const std::vector<uint64_t> expected = read(meshes);
    size_t other = 0;
    for (size_t i = 0; i < pixels.size(); i++) {
        ASSERT_EQ(pixels[i] >> 32, expected[i] >> 32) << i;
        other += expected[i] != 0 && triangleOf(pixels[i]) != ids[triangleOf(expected[i])];
    }
    EXPECT_EQ(other, 0u);

    // In any order, and in the form without 64-bit atomics.
    std::shuffle(list.begin(), list.end(), std::mt19937(5));
    EXPECT_EQ(drawClusters(rasterizer, model, instances, list, camera, size), pixels);
    Rasterizer::Options options;
    options.narrow = true;
    Rasterizer narrow = create(options);
    EXPECT_EQ(drawClusters(narrow, model, instances, list, camera, size), pixels);

    const auto fails = [&](std::string_view id, const MeshGraphModel& some, const Buffer& transforms,
                           const Buffer& entries, const Buffer& count) {
        expectError(id, [&] {
            Compute bad = device.createCompute();
            rasterizer.begin(bad, size);
            rasterizer.drawClusters(bad, some, transforms, entries, count, camera);
            return device.submit(bad);
        });
    };
    const Buffer good = device.createBuffer(Buffer::FlagStorage, 48);
    const Buffer small = device.createBuffer(Buffer::FlagStorage, 4),
                 unfit = device.createBuffer(Buffer::FlagVertex, 48);
    fails("handle.null", MeshGraphModel(), good, good, good);
    fails("handle.null", model, Buffer(), good, good);
    fails("raster.list", model, small, good, good);
    fails("raster.list", model, good, small, good);
    fails("raster.list", model, unfit, good, good);
    fails("raster.list", model, good, unfit, good);
    fails("raster.list", model, good, good, unfit);
    const uint64_t most = (uint64_t{1} << 25) / model.clusterCount();
    fails("raster.ids", model, device.createBuffer(Buffer::FlagStorage, (most + 1) * 48), good, good);
}

TEST_F(RasterizerListsTest, BarycentricsAreThoseOfFloat64) {
    struct Input {
        Vector4f a, b, c;
        Vector4f place;  ///< x, y, of a picture of z by w pixels
    };
    struct Output {
        Vector4f weights, along_x, along_y;
    };
    std::mt19937 random(4);
    std::vector<Input> inputs;
    const auto corner = [&] {
        return Vector4f(between(random, -3, 3), between(random, -3, 3), 0.1f, between(random, -0.5f, 4));
    };
    const auto weightsOf = [](const Input& input, double x, double y) {
        const Vector2d ndc(2.0 * x / input.place.z - 1.0, 1.0 - 2.0 * y / input.place.w);
        glm::dmat3 m;
        for (int i = 0; i < 3; i++) {
            const Vector4d p(i == 0 ? input.a : i == 1 ? input.b : input.c);
            m[i] = {p.x, p.y, p.w};
        }
        const Vector3d w = glm::inverse(m) * Vector3d(ndc, 1.0);
        return w / (w.x + w.y + w.z);
    };
    // Triangles that are not seen from their edges, at places that they cover.
    while (inputs.size() < 2000) {
        const Input input = {
            corner(), corner(), corner(), {between(random, 0, 640), between(random, 0, 480), 640, 480}};
        const Vector3d w = weightsOf(input, input.place.x, input.place.y);
        const double volume = std::abs(glm::determinant(glm::dmat3(Vector3d(input.a.x, input.a.y, input.a.w),
                                                                   Vector3d(input.b.x, input.b.y, input.b.w),
                                                                   Vector3d(input.c.x, input.c.y, input.c.w))));
        if (std::min({w.x, w.y, w.z}) > 0 && volume > 1) inputs.push_back(input);
    }
    const std::vector<Output> outputs = runOnEach<Output>(device, R"(
        #include <glint/raster/visibility.h>
        layout(local_size_x = 64) in;
        struct Input { vec4 a, b, c, place; };
        struct Output { vec4 weights, along_x, along_y; };
        layout(std430, binding = 0) readonly buffer Inputs { Input inputs[]; };
        layout(std430, binding = 1) writeonly buffer Outputs { Output outputs[]; };
        void main() {
            const uint i = gl_GlobalInvocationID.x;
            if (i >= inputs.length()) return;
            const Barycentrics b = barycentrics(inputs[i].a, inputs[i].b, inputs[i].c, inputs[i].place.xy, inputs[i].place.zw);
            outputs[i] = Output(vec4(b.weights, visibleTriangle(uvec2(~i, 1u)) == i ? 1.0 : 0.0), vec4(b.along_x, 0.0), vec4(b.along_y, 0.0));
        }
    )",
                                                          inputs);
    ASSERT_EQ(outputs.size(), inputs.size());
    double worst = 0.0, worst_slope = 0.0;
    for (size_t i = 0; i < inputs.size(); i++) {
        const double x = inputs[i].place.x, y = inputs[i].place.y, h = 1e-4;
        const Vector3d w = weightsOf(inputs[i], x, y);
        const Vector3d along_x = (weightsOf(inputs[i], x + h, y) - weightsOf(inputs[i], x - h, y)) / (2 * h);
        const Vector3d along_y = (weightsOf(inputs[i], x, y + h) - weightsOf(inputs[i], x, y - h)) / (2 * h);
        for (int k = 0; k < 3; k++) {
            worst = std::max(worst, std::abs(outputs[i].weights[k] - w[k]));
            worst_slope = std::max({worst_slope, std::abs(outputs[i].along_x[k] - along_x[k]),
                                    std::abs(outputs[i].along_y[k] - along_y[k])});
        }
        EXPECT_EQ(outputs[i].weights.w, 1.0f);
    }
    std::printf("barycentrics: %.3g, their slopes %.3g\n", worst, worst_slope);
    // Edges are differences of two products of numbers up to 6.5 with four roundings each, 2^-24 * 4 * 2 * 42 = 2e-5,
    // and the sum of those that a place within has is at least the volume over the largest w: 1 / 4.
    EXPECT_LT(worst, 2e-4);
    EXPECT_LT(worst_slope, 2e-5);
}

TEST_F(RasterizerListsLong, DrawsTheLargestPicture) {
    Rasterizer rasterizer = create();
    const uint64_t most = device.getFeatures().maxStorageSize / 8;
    const Vector2u size(16384, static_cast<uint32_t>(std::min<uint64_t>(most / 16384, 16384)));
    Triangles triangles = whole(0.25f);
    // Thin ones over all of it, in front.
    for (int i = 0; i < 64; i++) {
        const float y = static_cast<float>(i) / 32 - 0.99f;
        triangles.add({-1, y, 0.5f}, {1, y + 0.001f, 0.5f}, {-1, y + 0.002f, 0.5f});
    }
    const std::vector<uint64_t> pixels = draw(rasterizer, triangles, size);
    EXPECT_EQ(std::count(pixels.begin(), pixels.end(), Rasterizer::background), 0);
    size_t expected = 0;
    for (uint32_t t = 1; t < triangles.count(); t++) {
        FixedTriangle fixed;
        for (uint32_t k = 0; k < 3; k++) fixed[k] = fixedCorner(triangles.positions[3 * t + k], size);
        forEachPixel(fixed, size, [&](uint32_t, uint32_t, double) { expected++; });
    }
    EXPECT_EQ(std::count_if(pixels.begin(), pixels.end(), [](uint64_t p) { return triangleOf(p) != 0; }), expected);
}

TEST_F(RasterizerListsLong, DrawsMoreTrianglesThanOneDispatchHasGroups) {
    // 65,535 groups of 64 are 4.2 million.
    const Vector2u size(64, 64);
    Triangles triangles = whole(0.25f);
    triangles.indices.resize(3 * 5000000);
    for (size_t i = 0; i < triangles.indices.size(); i += 3)
        if (i % 900000 == 0) triangles.indices[i + 1] = 1, triangles.indices[i + 2] = 2;
    triangles.indices[triangles.indices.size() - 2] = 1;
    triangles.indices[triangles.indices.size() - 1] = 2;
    Rasterizer rasterizer = create(counting());
    const std::vector<uint64_t> pixels = draw(rasterizer, triangles, size);
    EXPECT_EQ(std::count(pixels.begin(), pixels.end(), uint64_t{18}), 64 * 64);
}

}  // namespace glint::test
