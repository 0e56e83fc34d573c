// The scene of 03 and 05 rasterised in compute shaders alone: select, rasterise, shade.

#include "common/instance_ids.h"
#include "common/instanced_scene.h"
#include "common/viewer.h"

#include <glint/geometry/mesh_graph_builder.h>
#include <glint/graphics/mesh_graph_selector.h>
#include <glint/graphics/rasterizer.h>

#include <cstdio>

using namespace glint;

namespace {

struct Parameters {
    CameraParameters camera;
    Vector2u size;                    // of the picture, in pixels
    float split = 0;                  // between plain and coloured instances, as a share of the width
    uint32_t clusters = 0;            // of the mesh
    uint32_t has_instance_color = 0;  // else each cluster has a colour
};

}  // namespace

int main(int argc, char** argv) {
    Example example(EXAMPLE_NAME, "Rasterises 4,608 instances of a mesh in compute shaders.");
    std::filesystem::path mesh_path;
    bool is_single = false, has_instance_color = false;
    float pixels = 1.0f;
    example.add("--mesh", mesh_path, "Mesh to show (.obj, .ply, .gltf, .glb); a torus without it");
    example.add("--single", is_single, "Show one instance, from near");
    example.addKnob("--pixels", pixels, 0.0f, 32.0f, "Error in pixels that is allowed; 0 is the full mesh");
    example.addKnob("--instance-colors", has_instance_color, "A colour for each instance, not for each cluster");
    InstanceIds ids(example);
    if (!example.parse(argc, argv)) return example.exitCode();

    const Expected<InstancedScene> places = InstancedScene::load(mesh_path, is_single);
    if (!places) return report(places.error());
    const Expected<MeshGraph> graph = createMeshGraph(places->mesh());
    if (!graph) return report(graph.error());
    Device device = openDevice(example);
    if (!device) return report(device.error());

    const MeshGraphModel model(device, *graph, "mesh");
    if (!model) return report(model.error());
    const uint32_t count = places->instances();
    const Buffer instances = device.createBuffer(Buffer::FlagStorage, count * sizeof(Transform3x4), "instances");
    MeshGraphSelector selector;
    if (Status status = selector.create(device); !status) return report(status.error());
    Rasterizer rasterizer;
    if (Status status = rasterizer.create(device); !status) return report(status.error());
    Kernel shade = device.createKernel("shade");
    shade.loadShaderGLSL(EXAMPLE_DIR "/main.shader", ids.macro());
    if (!shade.create()) return report(shade.error());

    Viewer viewer(example, device);
    const auto draw = [&](Frame& frame) {
        const auto time = static_cast<float>(frame.time);
        const Vector2u size(frame.width, frame.height);
        const std::vector<Transform3x4> transforms = places->transforms(time);
        device.setBuffer(instances, std::span(transforms));
        ids.begin(device, frame.width, frame.height);
        Camera camera = places->camera(time, frame.aspect());
        camera.lookAt(frame.view.eye(camera.position(), places->target()), places->target());
        const CameraParameters view = camera.parameters();

        // The first frame may find that the lists are too short: they grow with the next attempt.
        Status drawn;
        for (int attempt = 0; attempt < 8; attempt++) {
            Compute compute = device.createCompute();
            frame.timer.begin(compute, "select");
            selector.select(compute, model, instances, count, view, size, pixels);
            frame.timer.end(compute);
            frame.timer.begin(compute, "raster");
            rasterizer.begin(compute, size);
            rasterizer.drawClusters(compute, model, instances, selector.getList(), selector.getCount(), view,
                                    Rasterizer::CullBack);
            frame.timer.end(compute);
            if (Status submitted = device.submit(compute); !submitted) return submitted;
            drawn = selector.check();
            if (drawn) drawn = rasterizer.check();
            if (drawn.error().id() != "selector.capacity" && drawn.error().id() != "raster.capacity") break;
        }
        if (!drawn) return drawn;

        Compute compute = device.createCompute();
        frame.timer.begin(compute, "shade");
        compute.setKernel(shade);
        compute.setUniform(0, Parameters{.camera = view,
                                         .size = size,
                                         .split = InstancedScene::split(time),
                                         .clusters = model.clusterCount(),
                                         .has_instance_color = has_instance_color || ids.isWanted()});
        compute.setStorageBuffers(0, {rasterizer.getVisibility(), instances, model.getClusters(),
                                      model.getClusterVertices(), model.getClusterTriangles(), model.getPositions(),
                                      model.getNormals()});
        if (ids.isWanted()) compute.setStorageBuffer(7, ids.buffer());
        compute.setSurfaceTexture(0, frame.picture);
        compute.dispatch(frame.picture);
        frame.timer.end(compute);
        return device.submit(compute);
    };
    if (Status status = viewer.run(draw); !status) return report(status.error());
    if (Status status = ids.save(device); !status) return report(status.error());

    Statistics& statistics = example.statistics();
    const MeshGraphSelector::Statistics selected = selector.getStatistics();
    const Rasterizer::Statistics rastered = rasterizer.getStatistics();
    statistics.counts = {{"instances", count},
                         {"triangles", model.triangleCount() * count},
                         {"clusters_drawn", selected.clusters},
                         {"triangles_drawn", selected.triangles},
                         {"outside", selected.outside},
                         {"facing_away", selected.facing_away},
                         {"graph_clusters", model.clusterCount()},
                         {"graph_groups", model.groupCount()},
                         {"graph_bytes", model.bytes()},
                         {"list_bytes", selected.bytes},
                         {"large_triangles", rastered.large},
                         {"cut_triangles", rastered.clipped},
                         {"raster_bytes", rastered.memory}};
    std::printf("%u instances of %llu triangles, in %u clusters of %.1f MB\n", count,
                static_cast<unsigned long long>(model.triangleCount()), model.clusterCount(),
                static_cast<double>(model.bytes()) * 1e-6);
    std::printf("%u clusters of %llu triangles drawn; %u outside, %u facing away\n", selected.clusters,
                static_cast<unsigned long long>(selected.triangles), selected.outside, selected.facing_away);
    for (const std::string& pass : statistics.passNames())
        std::printf("%10s %8.2f ms\n", pass.c_str(), statistics.median(pass) * 1e-6);
    return viewer.finish();
}
