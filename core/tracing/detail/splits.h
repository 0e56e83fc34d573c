#pragma once

// Spatial splits: boxes of triangles cut before a build. docs/tracing.md has what they bring.

#include <glint/tracing/detail/binary_tree.h>

#include <functional>

namespace glint::detail {

/// Writes the corners of a triangle, or returns false: it is to be left whole.
using SplitCorners = std::function<bool(uint32_t id, float values[9])>;

/// Cuts boxes that are mostly empty into several that together hold the triangle, each a ref with its id: at most 0.6
/// times as many more as there are refs, and `room` more. The same for any number of threads.
Array<PrimRef> splitBoxes(Array<PrimRef> refs, const Box4& bounds, size_t room, const SplitCorners& corners,
                          ThreadPool* pool);

}  // namespace glint::detail
