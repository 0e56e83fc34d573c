// Any bytes give an error or a graph that can be walked and shown.

#include "fuzz.h"

#include <glint/format/mesh_graph.h>

#include <algorithm>

using namespace glint;

int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
    const Expected<MeshGraph> graph = MeshGraph::decode(fuzz::bytesOf(data, size), "fuzz.lod");
    if (!graph) {
        fuzz::require(graph.error().id().starts_with("graph."));
        return 0;
    }
    fuzz::require(std::ranges::equal(graph->bytes(), fuzz::bytesOf(data, size)));
    const size_t last = graph->clusterTriangles().size();
    for (const float error : {-1.0f, 0.01f, 1.0f}) {
        const Mesh mesh = graph->mesh(graph->cut(error));
        fuzz::require(mesh.triangleCount() <= last && (mesh.indices.empty() || mesh.validate()));
    }
    return 0;
}
