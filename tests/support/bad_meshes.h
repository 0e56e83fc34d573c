#pragma once

// Meshes that are wrong, or hardly meshes: what has to be refused, and what has to be drawn all the same.

#include <glint/format/mesh.h>

#include <string>
#include <vector>

namespace glint::test {

struct BadMesh {
    std::string name;
    Mesh mesh;
    std::string invalid;   ///< the error of Mesh::validate, and of everything that asks it; empty if it is valid
    std::string no_graph;  ///< the error of createMeshGraph; empty if there are levels of detail
};

std::vector<BadMesh> badMeshes();

}  // namespace glint::test
