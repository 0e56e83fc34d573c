#include "support/splat_device.h"

#include <glint/geometry/mesh_splats.h>
#include <glint/geometry/primitives.h>
#include <glint/graphics/picture.h>
#include <glint/graphics/ray_caster.h>

#include <array>
#include <cmath>
#include <stdexcept>

namespace glint::test {

namespace {

template <class T>
decltype(auto) need(T&& result) {
    if (!result) throw std::runtime_error(result.error().text());
    return std::forward<T>(result);
}

}  // namespace

SplatSettings settingsOf(const SplatRenderer::Options& options) {
    return {.near = options.near,
            .low_pass = options.low_pass,
            .is_antialiased = options.antialiased,
            .max_degree = options.max_degree,
            .alpha_cut = options.alpha_cut,
            .transmittance_stop = options.transmittance_stop,
            .order = SplatOrder::Centres};
}

SplatDrawer::SplatDrawer(const Device& device, const SplatRenderer::Options& options, Format color)
    : device_(device), format_(color) {
    need(renderer_.create(device, options));
}

void SplatDrawer::draw(const Camera& camera, uint32_t width, uint32_t height,
                       std::span<const SplatRenderer::Instance> instances) {
    if (!outputs_.color || outputs_.color.getWidth() != width || outputs_.color.getHeight() != height) {
        outputs_.color = need(device_.createTexture2D(format_, width, height, Texture::FlagSurface));
        outputs_.depth = need(device_.createTexture2D(FormatRf32, width, height, Texture::FlagSurface));
        outputs_.transmittance = need(device_.createTexture2D(FormatRf32, width, height, Texture::FlagSurface));
    }
    for (int attempt = 0;; attempt++) {
        Compute compute = device_.createCompute();
        renderer_.draw(compute, camera, instances, outputs_);
        need(device_.submit(compute));
        const Status status = renderer_.check();
        if (status) return;
        // Lists that did not fit may have ended the growth early, but not often.
        if (status.error().id() != "splats.capacity" || attempt == 4) need(status);
    }
}

void SplatDrawer::draw(const SplatScene& scene, const SplatModel& model) {
    need(model);
    draw(scene.camera, scene.width, scene.height, std::array{SplatRenderer::Instance{model}});
}

SplatPicture SplatDrawer::draw(const SplatScene& scene, SplatModel::Storage storage) {
    draw(scene, SplatModel(device_, scene.splats, storage));
    return picture();
}

SplatPicture SplatDrawer::picture() {
    const Image color = *need(readImage(device_, outputs_.color));
    const Image depth = *need(readImage(device_, outputs_.depth));
    const Image transmittance = *need(readImage(device_, outputs_.transmittance));
    SplatPicture picture = {color.width(), color.height(), {}, {}, {}};
    for (uint32_t y = 0; y < color.height(); y++)
        for (uint32_t x = 0; x < color.width(); x++) {
            picture.color.emplace_back(color.load(x, y));
            picture.transmittance.push_back(static_cast<double>(transmittance.load(x, y).x));
            picture.depth.push_back(static_cast<double>(depth.load(x, y).x));
        }
    return picture;
}

Image SplatDrawer::colors() { return *need(readImage(device_, outputs_.color)); }

SplatScene meshScene(const Device& device, uint32_t count, uint32_t quality, uint32_t width, uint32_t height) {
    Mesh mesh = createTorus(1.0f, 0.4f, 96, 48);
    for (Vector3f& position : mesh.positions) position.z += 0.8f;
    const auto base = static_cast<uint32_t>(mesh.positions.size());
    const Mesh floor = createPlane(5.0f);
    mesh.positions.insert(mesh.positions.end(), floor.positions.begin(), floor.positions.end());
    for (const uint32_t index : floor.indices) mesh.indices.push_back(base + index);
    mesh.normals.insert(mesh.normals.end(), floor.normals.begin(), floor.normals.end());
    mesh.texcoords.clear();

    MeshSplatsOptions options;
    options.count = count;
    options.sky_rays = quality;
    options.gloss = 0.4f;
    options.color = [](const Vector3f& p) {
        if (p.z > 0.1f) return Vector3f(0.7f, 0.25f, 0.1f);
        const bool is_odd = (static_cast<int>(std::floor(p.x * 2.0f)) + static_cast<int>(std::floor(p.y * 2.0f))) & 1;
        return is_odd ? Vector3f(0.65f) : Vector3f(0.15f, 0.3f, 0.35f);
    };
    RayCaster caster = std::move(*need(RayCaster::create(device, mesh)));
    SplatScene scene = {"mesh", {}, {}, width, height};
    scene.splats = std::move(
        *need(splatsFromMesh(mesh, options, [&](std::span<const Ray> rays) { return caster.castAny(rays); })));
    scene.camera = cameraAround(scene.splats, {0.25f, -0.36f, 0.27f}, {0, 0, 1}, 45.0f, width, height);
    return scene;
}

SplatPicture referenceOf(const SplatScene& scene, const SplatSettings& settings) {
    const SplatInstance instance = {&scene.splats};
    return renderSplats(scene.camera, scene.width, scene.height, {&instance, 1}, settings);
}

SplatPicture referenceOf(const SplatScene& scene, SplatModel::Storage storage, const SplatSettings& settings) {
    const Splats splats = SplatModel::decoded(scene.splats, storage);
    const SplatInstance instance = {&splats};
    return renderSplats(scene.camera, scene.width, scene.height, {&instance, 1}, settings);
}

}  // namespace glint::test
