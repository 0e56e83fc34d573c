#include "07_hello_splatting/scene.h"

#include <glint/geometry/mesh_splats.h>
#include <glint/geometry/primitives.h>
#include <glint/graphics/ray_caster.h>

#include <glm/geometric.hpp>

#include <algorithm>
#include <cmath>

using namespace glint;

namespace {

constexpr float model_size = 0.9f;  // longest side
constexpr float floor_z = -0.35f;
constexpr float floor_radius = 1.05f;

/// A ball of the scene.
struct Ball {
    Vector3f place;  // on the floor
    float radius;
    Vector3f color;
};

constexpr Ball balls[] = {{{0.45f, -0.5f, 0.0f}, 0.16f, {0.75f, 0.12f, 0.08f}},
                          {{0.62f, 0.12f, 0.0f}, 0.09f, {0.85f, 0.8f, 0.7f}},
                          {{0.06f, -0.85f, 0.0f}, 0.1f, {0.1f, 0.4f, 0.12f}},
                          {{-0.6f, -0.4f, 0.0f}, 0.18f, {0.08f, 0.2f, 0.55f}},
                          {{-0.12f, 0.78f, 0.0f}, 0.14f, {0.8f, 0.5f, 0.08f}}};

/// Where a coordinate of most splats lies: a few far away do not count.
BoundBox mostOf(const Splats& splats) {
    BoundBox box;
    std::vector<float> values(splats.size());
    for (int axis = 0; axis < 3 && !values.empty(); axis++) {
        for (size_t i = 0; i < values.size(); i++) values[i] = splats.positions[i][axis];
        const auto at = [&](size_t place) {
            std::nth_element(values.begin(), values.begin() + static_cast<std::ptrdiff_t>(place), values.end());
            return values[place];
        };
        box.min[axis] = at(values.size() / 50);
        box.max[axis] = at(values.size() - 1 - values.size() / 50);
    }
    return box;
}

float longestSide(const BoundBox& box) {
    const Vector3f size = box.size();
    return std::max({size.x, size.y, size.z, 1e-30f});
}

void transform(Mesh& mesh, const Matrix4x4f& matrix) {
    const Transform3x4 rows(matrix);
    for (Vector3f& position : mesh.positions) position = transformPoint(matrix, position);
    for (Vector3f& normal : mesh.normals) normal = transformNormal(rows, normal);
}

void append(Mesh& mesh, const Mesh& other) {
    const auto first = static_cast<uint32_t>(mesh.positions.size());
    mesh.positions.insert(mesh.positions.end(), other.positions.begin(), other.positions.end());
    mesh.normals.insert(mesh.normals.end(), other.normals.begin(), other.normals.end());
    for (const uint32_t index : other.indices) mesh.indices.push_back(first + index);
}

/// The model in the middle, on the floor.
Expected<Mesh> loadModel(const std::filesystem::path& path) {
    if (path.empty()) {
        Mesh mesh = createTorus(0.36f, 0.15f, 128, 64);
        transform(mesh, translate({0.0f, 0.0f, floor_z + 0.49f}) * rotateZ(-25.0f) * rotateX(75.0f));
        return mesh;
    }
    Expected<Mesh> mesh = Mesh::load(path);
    if (!mesh) return mesh;
    if (mesh->normals.empty()) mesh->createNormals();
    // Models of files mostly have Y up and Z to the front.
    const BoundBox box = mesh->bounds();
    const Vector3f foot(box.center().x, box.min.y, box.center().z);
    transform(*mesh, translate({0.0f, 0.0f, floor_z}) * rotateZ(150.0f) * rotateX(90.0f) *
                         scale(Vector3f(model_size / longestSide(box))) * translate(-foot));
    return mesh;
}

Mesh makeBalls() {
    Mesh mesh;
    for (const Ball& ball : balls) {
        Mesh sphere = createSphere(ball.radius, 4);
        transform(sphere, translate(ball.place + Vector3f(0.0f, 0.0f, floor_z + ball.radius)));
        append(mesh, sphere);
    }
    return mesh;
}

Mesh makeFloor() {
    constexpr uint32_t corners = 128;
    Mesh mesh;
    mesh.positions = {{0.0f, 0.0f, floor_z}};
    for (uint32_t i = 0; i < corners; i++) {
        const float angle = 2.0f * pi * static_cast<float>(i) / corners;
        mesh.positions.emplace_back(floor_radius * std::cos(angle), floor_radius * std::sin(angle), floor_z);
        mesh.indices.insert(mesh.indices.end(), {0, 1 + i, 1 + (i + 1) % corners});
    }
    mesh.normals.assign(mesh.positions.size(), Vector3f(0.0f, 0.0f, 1.0f));
    return mesh;
}

Vector3f ballColor(const Vector3f& position) {
    const auto distance = [&](const Ball& ball) { return glm::distance(Vector2f(position), Vector2f(ball.place)); };
    return std::min_element(std::begin(balls), std::end(balls),
                            [&](const Ball& a, const Ball& b) { return distance(a) < distance(b); })
        ->color;
}

Vector3f floorColor(const Vector3f& position) {
    const auto tile = [](float x) { return static_cast<int>(std::floor(x * 5.0f)); };
    return (tile(position.x) + tile(position.y)) % 2 == 0 ? Vector3f(0.5f, 0.49f, 0.47f)
                                                          : Vector3f(0.33f, 0.33f, 0.34f);
}

}  // namespace

uint64_t SplatScene::size() const {
    uint64_t count = 0;
    for (const Splats& model : models) count += model.size();
    return count;
}

Expected<SplatScene> SplatScene::load(std::span<const std::filesystem::path> files) {
    SplatScene scene;
    for (size_t i = 0; i < files.size(); i++) {
        Expected<Splats> splats = Splats::load(files[i]);
        if (!splats) return unexpected(splats.error());
        const BoundBox box = mostOf(*splats);
        const float place = static_cast<float>(i) - 0.5f * static_cast<float>(files.size() - 1);
        scene.transforms.push_back(translate({place * model_size, 0.0f, 0.0f}) *
                                   scale(Vector3f(model_size / longestSide(box))) * translate(-box.center()));
        scene.models.push_back(std::move(*splats));
    }
    return scene;
}

Expected<SplatScene> SplatScene::bake(const Device& device, const std::filesystem::path& mesh, uint32_t count) {
    const Expected<Mesh> model = loadModel(mesh);
    if (!model) return unexpected(model.error());
    const std::vector<Mesh> meshes = {*model, makeBalls(), makeFloor()};
    std::vector<MeshInstance> instances(meshes.size());
    for (uint32_t i = 0; i < instances.size(); i++) instances[i].mesh = i;
    Expected<RayCaster> caster = RayCaster::create(device, meshes, instances);
    if (!caster) return unexpected(caster.error());

    // Shares of the splats.
    const float shares[] = {0.45f, 0.15f, 0.4f};
    const std::function<Vector3f(const Vector3f&)> colors[] = {
        [](const Vector3f&) { return Vector3f(0.55f, 0.24f, 0.1f); }, ballColor, floorColor};
    const float glosses[] = {0.15f, 0.2f, 0.04f};
    SplatScene scene;
    for (size_t i = 0; i < meshes.size(); i++) {
        MeshSplatsOptions options;
        options.count = std::max(static_cast<uint32_t>(shares[i] * static_cast<float>(count)), 1u);
        options.color = colors[i];
        options.gloss = glosses[i];
        Expected<Splats> splats =
            splatsFromMesh(meshes[i], options, [&](std::span<const Ray> rays) { return caster->castAny(rays); });
        if (!splats) return unexpected(splats.error());
        scene.models.push_back(std::move(*splats));
        scene.transforms.emplace_back(1.0f);
    }
    return scene;
}

Camera SplatScene::camera(float time, float fov, float aspect) {
    const float away = 0.4f * std::sin(time) + 1.6f;
    const Vector3f from = transformPoint(rotateZ(8.0f * time), {away, away, 1.2f});
    return Camera().lookAt(from, Vector3f(0.0f)).perspective(fov, aspect);
}
