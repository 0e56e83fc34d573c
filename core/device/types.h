#pragma once

#include <cstdint>

namespace glint {

/// Work goes to one of these; an adapter without the separate ones runs everything on Main. Main takes every command;
/// Compute all but draws, createMipmaps and transfers of depth; Copy nothing but transfers, without clearTexture and
/// depth: "recorder.queue".
enum class Queue : uint8_t { Main, Compute, Copy, Count };

/// Linear red, green, blue and alpha.
struct Color {
    float r = 0.0f, g = 0.0f, b = 0.0f, a = 1.0f;
    static constexpr Color black() { return {0.0f, 0.0f, 0.0f, 1.0f}; }
    static constexpr Color gray() { return {0.25f, 0.25f, 0.25f, 1.0f}; }
    static constexpr Color white() { return {1.0f, 1.0f, 1.0f, 1.0f}; }
};

/// A range of mip levels and array layers (a cube has six layers, a face each). Count 0 means all that are left.
struct Slice {
    uint16_t mip = 0;
    uint16_t mips = 0;
    uint16_t layer = 0;
    uint16_t layers = 0;
    bool operator==(const Slice&) const = default;
};

/// A box of texels of one mip level. Size 0 means all that is left along that axis.
struct Region {
    uint32_t x = 0, y = 0, z = 0;
    uint32_t width = 0, height = 0, depth = 0;
};

/// Where clip space lands on a target: in pixels from its top left corner, and the depths of the near and far end.
struct Viewport {
    float x = 0, y = 0, width = 0, height = 0, minimum_depth = 0, maximum_depth = 1;
};

/// What is drawn of a target: pixels from its top left corner. What lies outside of the target does not matter.
struct Scissor {
    int32_t x = 0, y = 0;
    uint32_t width = 0, height = 0;
};

/// Comparison for depth, stencil and comparing samplers: passes if `new FUNC old`.
enum class Compare : uint8_t { Never, Less, Equal, LessEqual, Greater, NotEqual, GreaterEqual, Always };

}  // namespace glint
