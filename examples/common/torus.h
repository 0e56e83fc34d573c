#pragma once

#include <glint/geometry/primitives.h>
#include <glint/geometry/refine.h>

/// The torus of the tutorials: 16 x 11 quadrilaterals, refined by four steps to 90,112 triangles and 45,056 vertices.
/// Its axis is Z; of its cage's 3.7 x 3.7 x 1.54 the surface fills a little less.
inline glint::Expected<glint::Mesh> refinedTorus() {
    const glint::Expected<glint::PolygonMesh> refined =
        refine(glint::createTorusQuads(1.07208f, 0.77792f, 16, 11), glint::Subdivision::CatmullClark, 4);
    if (!refined) return glint::unexpected(refined.error());
    return toTriangles(*refined);
}
