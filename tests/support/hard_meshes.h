#pragma once

// Meshes that levels of detail find hard, each in its own way.

#include <glint/format/mesh.h>

#include <cstdint>

namespace glint::test {

/// The torus of the tutorials, refined: 22,528 triangles with 3 steps, four times more with each further one.
Mesh tutorialTorus(uint32_t steps);

/// Open, with a hole, with texture coordinates that are torn along a line.
Mesh tornSheet();

/// A torus in two parts that share a border.
Mesh twoParts();

/// Random triangles between few points: edges of many triangles, repeated and degenerate ones, fans that touch.
Mesh soup(uint64_t seed, size_t points, size_t triangles);

/// A torus with a fin on every 8th edge, a repeated triangle here and there, and cones that touch it at their tips.
Mesh nonManifold();

/// Boxes of random sizes and turns, side by side and through each other, each side divided into `cells` x `cells`
/// squares: sharp edges, and rough sides that can be simplified to next to nothing.
Mesh boxes(uint64_t seed, uint32_t count, uint32_t cells);

/// Balls apart from each other.
Mesh spheres();

}  // namespace glint::test
