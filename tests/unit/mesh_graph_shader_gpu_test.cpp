// <glint/meshes/graph.h> on the device against C++ and float64. docs/meshes.md has the bounds.

#include "support/kernel_values.h"
#include "support/reference.h"

#include <glint/geometry/mesh_graph_builder.h>
#include <glint/geometry/primitives.h>

#include <glm/geometric.hpp>
#include <glm/matrix.hpp>

#include <cmath>
#include <limits>

namespace glint::test {

namespace {

class MeshGraphShader : public DeviceTest {};

/// MeshGraphView of the shader: what C++ has, and the doubt; 48 bytes.
struct DeviceView {
    MeshGraphView view;
    float doubt = 0.0f;
    float reserved = 0.0f;
};
static_assert(sizeof(DeviceView) == 48);

/// A camera, a picture and a transform.
struct Seen {
    CameraParameters camera;
    Transform3x4 transform;
    Vector2f size = {1600, 900};
    float reserved[2] = {};
};
static_assert(sizeof(Seen) == 320);

constexpr const char* seen_block = R"(
#include <glint/meshes/graph.h>
layout(local_size_x = 8) in;
struct Seen {
    mat4 view, inverse_view, projection;
    vec4 position, ray_corner, ray_x, ray_y;
    vec4 rows[3];
    vec2 size, reserved;
};
layout(std430, binding = 0) readonly buffer Inputs { Seen inputs[]; };
)";

Matrix4x4f randomTurn(Random& random) {
    return rotateX(static_cast<float>(random.uniform(0, 360))) * rotateY(static_cast<float>(random.uniform(0, 360))) *
           rotateZ(static_cast<float>(random.uniform(0, 360)));
}

/// Somewhere, stretched by these factors along other axes than those of the mesh.
Seen randomSeen(Random& random, const Vector3f& factors) {
    Camera camera;
    camera.lookAt(Vector3f(random.direction() * std::exp2(random.uniform(-2, 12))), Vector3f(random.direction()))
        .perspective(static_cast<float>(random.uniform(20, 120)), static_cast<float>(random.uniform(0.5, 2)));
    Seen seen;
    seen.camera = camera.parameters();
    seen.transform = Transform3x4(translate(Vector3f(random.direction() * std::exp2(random.uniform(-2, 12)))) *
                                  randomTurn(random) * scale(factors) * randomTurn(random));
    return seen;
}

}  // namespace

// 48 bytes of a view, a float for each pair.
TEST_F(MeshGraphShader, ErrorsAreThoseOfTheHostAndMonotone) {
    const MeshGraph graph = *createMeshGraph(createTorus(2.0f, 0.7f, 120, 60));
    struct Pair {
        DeviceView view;
        MeshClusterGroup groups[2];
    };
    static_assert(sizeof(Pair) == 176);
    Random random(5);
    std::vector<Pair> pairs;
    for (int i = 0; i < 400; i++) {
        Pair pair;
        const float stretch = static_cast<float>(std::exp2(random.uniform(-4, 4)));
        const Seen seen = randomSeen(random, {stretch, i % 2 ? -1.0f : 1.0f, 1.0f});
        pair.view.view = MeshGraphView(seen.camera, {1600, 900}, seen.transform);
        pair.view.doubt = i % 3 == 0 ? 1e-3f : 0.0f;
        if (i % 4 == 0) {
            // Close to the surface of some group's ball, where values of a group and of one within it are nearest.
            const MeshClusterGroup& group = graph.groups()[random.below(graph.groups().size())];
            pair.view.view.eye = group.center + Vector3f(random.direction() * double{group.radius} *
                                                         (1.0 + std::pow(10.0, -random.uniform(0, 7))));
        }
        for (const MeshCluster& cluster : graph.clusters()) {
            if (cluster.source == UINT32_MAX || cluster.group == UINT32_MAX) continue;
            pair.groups[0] = graph.groups()[cluster.source];
            pair.groups[1] = graph.groups()[cluster.group];
            pairs.push_back(pair);
        }
    }
    const auto errors = runOnEach<std::array<float, 2>>(device, R"(
        #include <glint/meshes/graph.h>
        layout(local_size_x = 8) in;
        struct Pair { MeshGraphView view; MeshClusterGroup inner, outer; };
        layout(std430, binding = 0) readonly buffer Inputs { Pair inputs[]; };
        layout(std430, binding = 1) writeonly buffer Outputs { vec2 outputs[]; };
        void main() {
            const uint i = gl_GlobalInvocationID.x;
            if (i >= inputs.length()) return;
            outputs[i] = vec2(groupError(inputs[i].view, inputs[i].inner), groupError(inputs[i].view, inputs[i].outer));
        })",
                                                        pairs);
    ASSERT_EQ(errors.size(), pairs.size());
    EXPECT_GT(pairs.size(), 5000u);
    for (size_t i = 0; i < pairs.size(); i++) {
        ASSERT_LE(errors[i][0], errors[i][1]) << i;
        for (size_t k = 0; k < 2; k++) {
            if (pairs[i].view.doubt != 0.0f) continue;
            const MeshGraphView& view = pairs[i].view.view;
            const MeshClusterGroup& group = pairs[i].groups[k];
            const double expected = view.error(group);
            // Distances to 2^-20 of themselves, along the view to 2^-21 times the stretch: as much of the depth. Four
            // roundings and a division of 2.5 units more.
            const double distance = glm::distance(Vector3d(view.eye), Vector3d(group.center)) + group.radius;
            const double depth = static_cast<double>(group.error) * view.scale / expected;
            EXPECT_NEAR(errors[i][k], expected, expected * (0x1p-19 * distance * view.stretch / depth + 0x1p-20)) << i;
        }
    }
}

// Of the device's view: its numbers are those of C++, rounded to the side that is safe, and the eye is within the
// doubt.
TEST_F(MeshGraphShader, ViewsBoundThoseOfTheHost) {
    Random random(8);
    std::vector<Seen> inputs;
    std::vector<double> ratios;
    for (int i = 0; i < 600; i++) {
        const double spread = i % 3 * 3.0;  // 1, 8 or 64 times as much one way
        Vector3f factors;
        for (int k = 0; k < 3; k++) factors[k] = static_cast<float>(std::exp2(random.uniform(-spread, 0.0)));
        factors *= static_cast<float>(std::exp2(random.uniform(-13, 13)));
        if (i % 2) factors.y = -factors.y;
        inputs.push_back(randomSeen(random, factors));
        const Vector3f sizes = glm::abs(factors);
        ratios.push_back(std::max({sizes.x, sizes.y, sizes.z}) / std::min({sizes.x, sizes.y, sizes.z}));
    }
    const auto views = runOnEach<DeviceView>(device, std::string(seen_block) + R"(
        layout(std430, binding = 1) writeonly buffer Outputs { MeshGraphView outputs[]; };
        void main() {
            const uint i = gl_GlobalInvocationID.x;
            if (i >= inputs.length()) return;
            const Seen s = inputs[i];
            outputs[i] = meshGraphView(s.projection, s.inverse_view, s.position.xyz, s.size,
                                       meshTransform(s.rows[0], s.rows[1], s.rows[2]));
        })",
                                             inputs);
    ASSERT_EQ(views.size(), inputs.size());
    for (size_t i = 0; i < views.size(); i++) {
        SCOPED_TRACE(i);
        const MeshGraphView host(inputs[i].camera, {1600, 900}, inputs[i].transform);
        const MeshGraphView& view = views[i].view;
        // Stretches to 2^-17 of the largest, widened by as much; the rest to 2^-18, widened by as much.
        const double largest = 0x1p-15, smallest = 0x1p-15 * ratios[i];
        EXPECT_GE(view.scale, host.scale * (1.0 - 0x1p-20));
        EXPECT_LE(view.scale, host.scale * (1.0 + largest));
        EXPECT_LE(view.slant, host.slant * (1.0 + 0x1p-20));
        EXPECT_GE(view.slant, host.slant * (1.0 - smallest));
        EXPECT_GE(view.stretch, host.stretch * (1.0 - 0x1p-20));
        EXPECT_LE(view.stretch, host.stretch * (1.0 + largest));
        EXPECT_EQ(view.near, host.near);
        EXPECT_LE(glm::length(view.forward - host.forward), host.stretch * 0x1p-21);
        const Matrix4x4d to_world(inputs[i].transform.matrix());
        const Vector3d eye(glm::inverse(to_world) * Vector4d(Vector3d(inputs[i].camera.position), 1.0));
        EXPECT_LE(glm::distance(Vector3d(view.eye), eye), views[i].doubt);
        // No more than it has to be: 2^-20 of the distance, times the ratio twice.
        EXPECT_LE(views[i].doubt, 0x1p-19 * ratios[i] * ratios[i] * glm::length(eye));
    }
}

TEST_F(MeshGraphShader, StretchesAreBounds) {
    Random random(9);
    struct Columns {
        Vector4f columns[3];
    };
    std::vector<Columns> inputs;
    std::vector<std::array<double, 2>> expected;
    for (int i = 0; i < 2000; i++) {
        Vector3d factors;
        for (int k = 0; k < 3; k++) factors[k] = std::exp2(random.uniform(-14, 0));
        if (i % 5 == 0) factors.y = factors.x;
        const Matrix4x4d matrix =
            Matrix4x4d(randomTurn(random)) * Matrix4x4d(scale(Vector3f(factors))) * Matrix4x4d(randomTurn(random));
        Columns columns;
        for (int k = 0; k < 3; k++) columns.columns[k] = Vector4f(Vector3f(Vector3d(matrix[k])), 0.0f);
        inputs.push_back(columns);
        expected.push_back({std::min({factors.x, factors.y, factors.z}), std::max({factors.x, factors.y, factors.z})});
    }
    const auto found = runOnEach<std::array<float, 2>>(device, R"(
        #include <glint/meshes/graph.h>
        layout(local_size_x = 8) in;
        struct Columns { vec4 columns[3]; };
        layout(std430, binding = 0) readonly buffer Inputs { Columns inputs[]; };
        layout(std430, binding = 1) writeonly buffer Outputs { vec2 outputs[]; };
        void main() {
            const uint i = gl_GlobalInvocationID.x;
            if (i < inputs.length())
                outputs[i] = meshStretches(inputs[i].columns[0].xyz, inputs[i].columns[1].xyz, inputs[i].columns[2].xyz);
        })",
                                                       inputs);
    ASSERT_EQ(found.size(), inputs.size());
    for (size_t i = 0; i < found.size(); i++) {
        const auto [low, high] = expected[i];
        // The turns and the numbers of the matrix are rounded to float32 before.
        EXPECT_LE(found[i][0], low + 0x1p-22 * high) << i;
        EXPECT_GE(found[i][0], low - 0x1p-16 * high) << i;
        EXPECT_GE(found[i][1], high * (1.0 - 0x1p-22)) << i;
        EXPECT_LE(found[i][1], high * (1.0 + 0x1p-16)) << i;
    }
}

// Balls and boxes against the planes in float64: what is said to be outside is, and what is clearly outside is said to
// be.
TEST_F(MeshGraphShader, FrustumsAndCones) {
    Random random(10);
    struct Input {
        Seen seen;
        MeshCluster cluster;
    };
    static_assert(sizeof(Input) == 400);
    std::vector<Input> inputs;
    for (int i = 0; i < 4000; i++) {
        Input input;
        const float stretch = static_cast<float>(std::exp2(random.uniform(-3, 3)));
        input.seen = randomSeen(random, {stretch, i % 2 ? -1.0f : 1.0f, 1.0f});
        MeshCluster& cluster = input.cluster;
        cluster.center = Vector3f(random.direction() * std::exp2(random.uniform(-1, 10)));
        const Vector3f half(random.direction() * random.uniform(0.1, 4));
        cluster.box_min = cluster.center - glm::abs(half);
        cluster.box_max = cluster.center + glm::abs(half);
        cluster.radius = glm::length(half) * 1.001f;
        cluster.cone_axis = Vector3f(random.direction());
        cluster.cone_cutoff = static_cast<float>(random.uniform(0, 1));
        inputs.push_back(input);
    }
    const auto found = runOnEach<std::array<uint32_t, 4>>(device, R"(
        #include <glint/meshes/graph.h>
        layout(local_size_x = 8) in;
        struct Seen {
            mat4 view, inverse_view, projection;
            vec4 position, ray_corner, ray_x, ray_y;
            vec4 rows[3];
            vec2 size, reserved;
        };
        struct Input { Seen seen; MeshCluster cluster; };
        layout(std430, binding = 0) readonly buffer Inputs { Input inputs[]; };
        layout(std430, binding = 1) writeonly buffer Outputs { uvec4 outputs[]; };
        void main() {
            const uint i = gl_GlobalInvocationID.x;
            if (i >= inputs.length()) return;
            const Seen s = inputs[i].seen;
            const MeshCluster c = inputs[i].cluster;
            const mat4x3 to_world = meshTransform(s.rows[0], s.rows[1], s.rows[2]);
            const MeshFrustum frustum = meshFrustum(s.projection, s.inverse_view, s.position.xyz, to_world);
            const MeshGraphView view = meshGraphView(s.projection, s.inverse_view, s.position.xyz, s.size, to_world);
            outputs[i] = uvec4(isOutside(frustum, c.center, c.radius), isOutside(frustum, c.box_min, c.box_max),
                               isFacingAway(view, c), isMeshTransform(to_world));
        })",
                                                          inputs);
    ASSERT_EQ(found.size(), inputs.size());
    std::array<uint32_t, 3> counts = {};
    for (size_t i = 0; i < found.size(); i++) {
        SCOPED_TRACE(i);
        const Input& input = inputs[i];
        const MeshCluster& cluster = input.cluster;
        const Matrix4x4d to_world(input.seen.transform.matrix());
        const Matrix4x4d projection(input.seen.camera.projection);
        Matrix4x4d to_view(input.seen.camera.inverse_view);
        to_view[3] = Vector4d(Vector3d(input.seen.camera.position), 1.0);
        to_view = glm::inverse(to_view);
        const Matrix4x4d rows = glm::transpose(projection * to_view * to_world);
        const double size = glm::length(Vector3d(input.seen.camera.position)) + glm::length(Vector3d(to_world[3])) +
                            10.0 * glm::length(Vector3d(cluster.center));
        bool ball = false, box = false, clear_ball = false, clear_box = false;
        for (const Vector4d& plane :
             {rows[3] + rows[0], rows[3] - rows[0], rows[3] + rows[1], rows[3] - rows[1], rows[3] - rows[2]}) {
            const Vector3d normal(plane);
            const double distance = (glm::dot(normal, Vector3d(cluster.center)) + plane.w) / glm::length(normal);
            Vector3d inmost;
            for (int k = 0; k < 3; k++) inmost[k] = normal[k] > 0 ? cluster.box_max[k] : cluster.box_min[k];
            const double inner = (glm::dot(normal, inmost) + plane.w) / glm::length(normal);
            ball |= distance < -cluster.radius;
            box |= inner < 0.0;
            // The margins are 2^-20 of the coordinates, divided by the smallest stretch, of at least 1/8.
            clear_ball |= distance < -cluster.radius - 0x1p-16 * size;
            clear_box |= inner < -0x1p-16 * size;
        }
        EXPECT_TRUE(ball || !found[i][0]);
        EXPECT_TRUE(box || !found[i][1]);
        EXPECT_TRUE(found[i][0] || !clear_ball);
        EXPECT_TRUE(found[i][1] || !clear_box);
        const Vector3d eye(glm::inverse(to_world) * Vector4d(Vector3d(input.seen.camera.position), 1.0));
        const Vector3d v = Vector3d(cluster.center) - eye;
        const double facing =
            glm::dot(v, Vector3d(cluster.cone_axis)) - double{cluster.cone_cutoff} * glm::length(v) - cluster.radius;
        EXPECT_TRUE(facing >= 0.0 || !found[i][2]);
        // The doubt, three times: 2^-19 of the eye's distance times the ratio, 8, twice; and 2^-19 of the distance.
        const double margin = 3.0 * 0x1p-19 * 64.0 * glm::length(eye) + 0x1p-18 * glm::length(v);
        EXPECT_TRUE(found[i][2] || facing < margin);
        EXPECT_EQ(found[i][3], 1u);
        counts[0] += found[i][0];
        counts[1] += found[i][1];
        counts[2] += found[i][2];
    }
    for (const uint32_t count : counts) {
        EXPECT_GT(count, 200u);
        EXPECT_LT(count, 3950u);
    }
}

}  // namespace glint::test
