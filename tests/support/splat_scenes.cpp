#include "support/splat_scenes.h"

#include "support/reference.h"

#include <glm/geometric.hpp>
#include <glm/gtc/constants.hpp>
#include <glm/gtc/quaternion.hpp>

#include <cmath>
#include <cstdlib>

namespace glint::test {

namespace {

/// The constant harmonic.
constexpr float y0 = 0.28209479177387814f;

Vector4f toVector(const glm::dquat& q) {
    return {static_cast<float>(q.x), static_cast<float>(q.y), static_cast<float>(q.z), static_cast<float>(q.w)};
}

/// Any rotation, each as likely as any other.
Vector4f anyRotation(Random& random) {
    const Vector3d axis = random.direction();
    // The angle's density is that of the rotations: 1 - cos.
    double angle = 0.0;
    do { angle = random.uniform(0.0, glm::pi<double>()); } while (random.uniform(0.0, 2.0) > 1.0 - std::cos(angle));
    return toVector(glm::angleAxis(angle, axis));
}

Vector3f anyColor(Random& random) {
    return {static_cast<float>(random.uniform()), static_cast<float>(random.uniform()),
            static_cast<float>(random.uniform())};
}

float between(Random& random, double low, double high) { return static_cast<float>(random.uniform(low, high)); }

const Vector4f unturned = {0, 0, 0, 1};

/// Cameras of the scenes below are at the origin and look along +Y, with Z up: a place is (right, depth, up).
SplatScene frontal(const std::string& name, uint32_t width, uint32_t height, float fov = 60.0f) {
    SplatScene scene = {name, {}, {}, width, height};
    scene.camera.lookAt({0, 0, 0}, {0, 1, 0})
        .perspective(fov, static_cast<float>(width) / static_cast<float>(height), 0.1f);
    return scene;
}

SplatScene insideScene() {
    SplatScene scene = frontal("inside", 96, 72);
    Random random(11);
    addSplat(scene.splats, {0.1f, 0.5f, 0}, {2, 2, 2}, unturned, 0.5f, {0.9f, 0.6f, 0.2f});
    addSplat(scene.splats, {-1.0f, 0.3f, 0.5f}, {3, 0.5f, 1}, anyRotation(random), 0.7f, {0.2f, 0.6f, 0.9f});
    addSplat(scene.splats, {0.0f, -0.5f, 0}, {2, 2, 2}, unturned, 0.9f, {1, 0, 1});
    for (int i = 0; i < 200; i++)
        addSplat(scene.splats, Vector3f(random.direction()) * between(random, 0.3, 4.0),
                 {between(random, 0, 0.5), between(random, 0, 0.5), between(random, 0, 0.5)}, anyRotation(random),
                 between(random, 0, 1), anyColor(random));
    return scene;
}

SplatScene nearScene() {
    SplatScene scene = frontal("near", 96, 72);
    Random random(12);
    for (int i = 0; i < 300; i++) {
        // No centre within rounding of the near plane, which would be seen or not as it pleases.
        const float z = i % 3 == 0 ? between(random, 0.201, 0.21)
                                   : (i % 3 == 1 ? between(random, -0.3, 0.199) : between(random, 0.21, 1.0));
        addSplat(scene.splats, {between(random, -0.5, 0.5), z, between(random, -0.5, 0.5)},
                 {between(random, 0.001, 0.1), between(random, 0.01, 0.15), between(random, 0.01, 0.15)},
                 anyRotation(random), between(random, 0.02, 0.6), anyColor(random));
    }
    return scene;
}

SplatScene opacityScene() {
    SplatScene scene = frontal("opacity", 64, 48);
    Random random(13);
    for (int i = 0; i < 120; i++) {
        const float opacity = i % 3 == 0 ? 0.0f : (i % 3 == 1 ? 1.0f : between(random, 0.9, 1.0));
        addSplat(scene.splats, {between(random, -1, 1), between(random, 1, 3), between(random, -1, 1)},
                 Vector3f(between(random, 0.02, 0.3)), unturned, opacity, anyColor(random));
    }
    return scene;
}

SplatScene equalDepthsScene() {
    SplatScene scene = frontal("equal_depths", 80, 60);
    Random random(14);
    for (int i = 0; i < 600; i++)
        addSplat(scene.splats, {between(random, -1, 1), i % 2 == 0 ? 2.0f : 1.5f, between(random, -0.8, 0.8)},
                 Vector3f(0.15f), unturned, 0.6f, anyColor(random));
    return scene;
}

SplatScene faintScene() {
    SplatScene scene = frontal("faint", 48, 48);
    Random random(15);
    for (int i = 0; i < 10000; i++)
        addSplat(scene.splats, {between(random, -1, 1), between(random, 2, 3), between(random, -1, 1)},
                 Vector3f(between(random, 0.05, 0.5)), unturned, i % 2 == 0 ? 0.0039f : 0.00395f, anyColor(random));
    return scene;
}

SplatScene flatScene() {
    SplatScene scene = frontal("flat", 96, 72);
    Random random(16);
    for (int i = 0; i < 300; i++) {
        Vector3f scales(between(random, 0.05, 0.3), between(random, 0.05, 0.3), between(random, 0.05, 0.3));
        for (int k = 0; k <= i % 3; k++) scales[k] = 0.0f;
        addSplat(scene.splats, {between(random, -1.2, 1.2), between(random, 1, 3), between(random, -1, 1)}, scales,
                 anyRotation(random), between(random, 0.3, 1), anyColor(random));
    }
    return scene;
}

SplatScene hugeScene() {
    SplatScene scene = frontal("huge", 64, 48);
    Random random(17);
    for (int i = 0; i < 60; i++) {
        // Sheets, needles and clouds of up to a million units.
        const float size = std::exp(between(random, 0.0, std::log(1e6)));
        const auto other = [&] { return std::exp(between(random, std::log(0.01), std::log(size))); };
        addSplat(scene.splats, {between(random, -1, 1), between(random, 1, 9), between(random, -1, 1)},
                 {size, other(), other()}, anyRotation(random), between(random, 0.02, 0.8), anyColor(random));
    }
    return scene;
}

SplatScene besideScene() {
    SplatScene scene = frontal("beside", 96, 72, 50.0f);
    Random random(18);
    // Centres outside of the picture, most of them beyond the 1.3 tangents at which the Jacobian is held.
    for (int i = 0; i < 400; i++) {
        const double angle = random.uniform(0.0, 2.0 * glm::pi<double>());
        const double away = random.uniform(0.5, 2.5);
        const float z = between(random, 0.5, 2.0);
        addSplat(scene.splats,
                 {static_cast<float>(std::cos(angle) * away) * z, z, static_cast<float>(std::sin(angle) * away) * z},
                 {between(random, 0.02, 0.4), between(random, 0.02, 0.4), between(random, 0.02, 0.4)},
                 anyRotation(random), between(random, 0.05, 0.9), anyColor(random));
    }
    return scene;
}

}  // namespace

void addSplat(Splats& splats, const Vector3f& position, const Vector3f& scales, const Vector4f& rotation, float opacity,
              const Vector3f& color) {
    splats.positions.push_back(position);
    splats.scales.push_back(scales);
    splats.rotations.push_back(rotation);
    splats.opacities.push_back(opacity);
    splats.harmonics.push_back((color - 0.5f) / y0);
    splats.harmonics.resize(splats.size() * splats.coefficientCount(), Vector3f(0.0f));
}

std::filesystem::path splatsPath() {
    const char* name = std::getenv("GLINT_SPLATS");
    if (name == nullptr || !std::filesystem::is_regular_file(name)) return {};
    return name;
}

Camera cameraAround(const Splats& splats, const Vector3f& from, const Vector3f& up, float fov, uint32_t width,
                    uint32_t height) {
    const BoundBox box = splats.bounds();
    const Vector3f centre = box.center();
    const float radius = glm::length(box.size()) * 0.5f;
    const float distance = radius / std::sin(radians(fov) * 0.5f);
    return Camera()
        .lookAt(centre + from * distance, centre, up)
        .perspective(fov, static_cast<float>(width) / static_cast<float>(height), 0.1f);
}

Expected<SplatScene> realSplatScene(uint32_t width, uint32_t height) {
    Expected<Splats> splats = Splats::load(splatsPath());
    if (!splats) return unexpected(splats.error());
    // Trained scenes have Y down.
    const Camera camera = cameraAround(*splats, {0.16f, -0.12f, 0.42f}, {0, -1, 0}, 50.0f, width, height);
    return SplatScene{"playbot", std::move(*splats), camera, width, height};
}

SplatScene surfaceScene(uint32_t count, uint32_t degree, uint32_t width, uint32_t height) {
    constexpr double major = 1.0, minor = 0.4;
    SplatScene scene = {"surface", {}, {}, width, height};
    Splats& splats = scene.splats;
    splats.degree = degree;
    Random random(21);
    // Discs of this standard deviation overlap their neighbours.
    const double area = 4.0 * glm::pi<double>() * glm::pi<double>() * major * minor;
    const auto size = static_cast<float>(0.75 * std::sqrt(area / count));
    while (splats.size() < count) {
        const double u = random.uniform(0.0, 2.0 * glm::pi<double>());
        const double v = random.uniform(0.0, 2.0 * glm::pi<double>());
        if (random.uniform(0.0, major + minor) > major + minor * std::cos(v)) continue;
        const Vector3d normal(std::cos(u) * std::cos(v), std::sin(u) * std::cos(v), std::sin(v));
        const Vector3d place = Vector3d(std::cos(u), std::sin(u), 0.0) * major + normal * minor;
        const glm::dquat turn = glm::dquat(Vector3d(0, 0, 1), normal) *
                                glm::angleAxis(random.uniform(0.0, glm::pi<double>()), Vector3d(0, 0, 1));
        const double light = 0.15 + 0.75 * std::max(0.0, glm::dot(normal, glm::normalize(Vector3d(1, -2, 2))));
        const Vector3d base(0.5 + 0.4 * std::sin(3.0 * u), 0.55, 0.5 + 0.4 * std::cos(5.0 * v));
        addSplat(splats, Vector3f(place), {size * between(random, 0.8, 1.2), size, size * 0.05f}, toVector(turn),
                 between(random, 0.9, 0.999), Vector3f(base * light));
        // A lobe around the direction from which the highlight is seen, wider in red.
        Vector3f* harmonics = &splats.harmonics[splats.harmonics.size() - splats.coefficientCount()];
        for (uint32_t k = 1; k < splats.coefficientCount(); k++)
            harmonics[k] = Vector3f(0.1f, 0.08f, 0.06f) * between(random, -1, 1) * static_cast<float>(light);
    }
    scene.camera = cameraAround(splats, {0.36f, -0.54f, 0.4f}, {0, 0, 1}, 40.0f, width, height);
    return scene;
}

SplatScene needleScene(uint32_t count, float sigma, uint32_t width, uint32_t height) {
    SplatScene scene = frontal("needles", width, height);
    Random random(22);
    const double focal = 0.5 * height * std::sqrt(3.0);  // pixels, for 60 degrees
    for (uint32_t i = 0; i < count; i++) {
        const double depth = 2.0 + 0.1 * i;
        const double pixel = depth / focal;
        // Long along x; turned about the viewing direction.
        const double angle = glm::pi<double>() * (i + random.uniform()) / count;
        const Vector4f turn = toVector(glm::angleAxis(angle, Vector3d(0, 1, 0)));
        const auto place = [&](double size) { return static_cast<float>(random.uniform(-0.3, 0.3) * size * pixel); };
        addSplat(scene.splats, {place(width), static_cast<float>(depth), place(height)},
                 Vector3f(Vector3d(sigma, 0.1, 0.1) * pixel), turn, 0.9f, anyColor(random));
    }
    return scene;
}

SplatScene spreadScene(const std::string& name, uint32_t count, float fov, uint32_t width, uint32_t height) {
    SplatScene scene = frontal(name, width, height, fov);
    Random random(19);
    const double tangent = std::tan(fov * glm::pi<double>() / 360.0);
    for (uint32_t i = 0; i < count; i++) {
        const double z = random.uniform(1.0, 4.0);
        const auto size = [&] { return static_cast<float>(random.uniform(0.01, 0.2) * z * std::min(tangent, 1.0)); };
        addSplat(scene.splats,
                 {static_cast<float>(random.uniform(-1.1, 1.1) * z * tangent * width / height), static_cast<float>(z),
                  static_cast<float>(random.uniform(-1.1, 1.1) * z * tangent)},
                 {size(), size(), size()}, anyRotation(random), between(random, 0.1, 1), anyColor(random));
    }
    return scene;
}

SplatScene crowdScene(uint32_t count, float opacity) {
    SplatScene scene = frontal("crowd", 64, 64);
    Random random(23);
    const double focal = 32.0 * std::sqrt(3.0);
    for (uint32_t i = 0; i < count; i++) {
        const double z = random.uniform(2.0, 4.0);
        // Pixels 32 to 48 of both directions, but for one in a hundred.
        const auto place = [&](bool is_down) {
            const double offset = i % 100 == 99 ? random.uniform(-32.0, 32.0) : random.uniform(0.0, 16.0);
            return static_cast<float>((is_down ? -offset : offset) * z / focal);
        };
        const float x = place(false);
        const float y = place(true);
        addSplat(scene.splats, {x, static_cast<float>(z), y}, Vector3f(between(random, 0, 0.02)), unturned, opacity,
                 anyColor(random));
    }
    return scene;
}

std::vector<SplatScene> hardSplatScenes() {
    std::vector<SplatScene> scenes = {needleScene(18, 5000.0f, 256, 256), crowdScene(100000, 0.02f)};
    scenes.push_back(insideScene());
    scenes.push_back(nearScene());
    scenes.push_back(opacityScene());
    scenes.push_back(equalDepthsScene());
    scenes.push_back(faintScene());
    scenes.push_back(flatScene());
    scenes.push_back(hugeScene());
    scenes.push_back(besideScene());
    scenes.push_back(spreadScene("wide", 500, 170.0f, 96, 72));
    scenes.push_back(spreadScene("narrow", 500, 1.0f, 96, 72));
    return scenes;
}

}  // namespace glint::test
