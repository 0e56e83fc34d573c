// Triangles of a mesh, a thread each.
#pragma once

#include <glint/raster/mesh.h>
#include <glint/raster/triangle.h>

layout(local_size_x = GLINT_GROUP) in;

void main() {
    const uint triangle = groupIndex() * GLINT_GROUP + gl_LocalInvocationIndex;
    if (triangle >= frame.triangles) return;
    const uint id = frame.first_id + triangle;
    vec4 a, b, c;
    trianglePositions(id, a, b, c);
    drawTriangle(project(a), project(b), project(c), id);
}
