// glint splat from-mesh: splats of a mesh, with its light in their harmonics.

#include "progress.h"
#include "tool.h"

#include <glint/geometry/mesh_splats.h>
#include <glint/graphics/ray_caster.h>

#include <fmt/format.h>

#include <memory>

using namespace glint;

namespace tool {

namespace {

struct Options {
    std::filesystem::path mesh;
    std::filesystem::path splats;
    std::string adapter;
    std::string api;
    TracingEngine tracing = TracingEngine::Auto;
    MeshSplatsOptions baking;
    Vector3f color = Vector3f(0.6f);
};

Expected<Splats> make(const Options& options) {
    Expected<Mesh> mesh = Mesh::load(options.mesh);
    if (!mesh) return unexpected(mesh.error());
    if (mesh->normals.empty()) mesh->createNormals();
    const Device device = openDevice({.api = options.api,
                                      .adapter = options.adapter,
                                      .required = FeatureComputeTracing,
                                      .optional = FeatureTimestamps,
                                      .tracing = options.tracing});
    if (!device) return unexpected(device.error());
    Expected<RayCaster> caster = RayCaster::create(device, *mesh);
    if (!caster) return unexpected(caster.error());

    MeshSplatsOptions baking = options.baking;
    baking.color = [&](const Vector3f&) { return options.color; };
    Progress progress(uint64_t{baking.count} * (baking.lamp_rays + baking.sky_rays), "million rays", 1e-6);
    uint64_t done = 0;
    return splatsFromMesh(*mesh, baking, [&](std::span<const Ray> rays) -> Expected<std::vector<uint8_t>> {
        if (Status status = checkInterrupt(); !status) return unexpected(status.error());
        progress.update(done += rays.size());
        return caster->castAny(rays);
    });
}

int run(const Options& options) {
    const std::string ending = options.splats.extension();
    if (ending != ".ply" && ending != ".splat" && ending != ".spz")  // before the work, rather than after it
        return failUsage("splat from-mesh",
                         fmt::format("'{}': splats end in .ply, .splat or .spz", options.splats.string()));
    catchSignals();
    const double begin = now();
    const Expected<Splats> splats = make(options);
    if (!splats) {
        const int status = fail("splat from-mesh", splats.error());
        return splats.error().id() == "tool.interrupted" ? ExitInterrupted : status;
    }
    if (Status status = splats->save(options.splats); !status) return fail("splat from-mesh", status.error());
    fmt::print("{} splats of degree {} in {:.2f} s\n", splats->size(), splats->degree, now() - begin);
    return 0;
}

}  // namespace

Command splatFromMeshCommand(CLI::App& app) {
    auto options = std::make_shared<Options>();
    // Models of files mostly have Y up and Z to the front.
    options->baking.light.up = {0.0f, 1.0f, 0.0f};
    options->baking.light.direction = {0.6f, 1.0f, 0.5f};
    MeshSplatsOptions& baking = options->baking;
    CLI::App* sub = app.add_subcommand("from-mesh", "Makes splats of a mesh, lit by a lamp and a sky");
    sub->add_option("MESH", options->mesh, "Mesh of triangles (.obj, .ply, .gltf, .glb)")->required();
    sub->add_option("SPLATS", options->splats, "Where to write the splats (.ply, .splat, .spz)")->required();
    sub->add_option("--count", baking.count, "Splats")->type_name("N")->capture_default_str();
    sub->add_option("--degree", baking.degree, "Degree of the harmonics, 0 to 3")
        ->type_name("N")
        ->capture_default_str();
    addVector(*sub, "--color", options->color,
              "Share of the light that the surface reflects: red, green, blue, 0 to 1");
    sub->add_option("--gloss", baking.gloss, "Share of the light that it mirrors, 0 to 1")->capture_default_str();
    addVector(*sub, "--up", baking.light.up, "Towards the sky");
    addVector(*sub, "--lamp", baking.light.direction, "Towards the lamp");
    sub->add_option("--lamp-radius", baking.light.radius, "Of the lamp's disc, degrees: how soft shadows are")
        ->capture_default_str();
    sub->add_option("--lamp-rays", baking.lamp_rays, "Rays from each splat to the lamp")->capture_default_str();
    sub->add_option("--sky-rays", baking.sky_rays, "Rays from each splat to the sky")->capture_default_str();
    addDevice(*sub, options->adapter, options->api);
    addTracing(*sub, options->tracing);
    return {sub, [options] { return run(*options); }};
}

}  // namespace tool
