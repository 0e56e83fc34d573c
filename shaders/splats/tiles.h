// Which tiles a footprint reaches: those with pixel centres, or anything between them, where its alpha is at least the
// cut. Tiles are closed rectangles of pixel centres, and bounds are widened by more than their rounding: no tile is
// missing, and one more is harmless.
#pragma once

const float TILE_X = float(GLINT_TILE_X), TILE_Y = float(GLINT_TILE_Y);

// In pixels: 2^-20 of a magnitude, more than rounding amounts to, and 2^-10.
float marginOf(float magnitude) { return magnitude * 9.5367431640625e-7 + 0.0009765625; }

// Tiles from x to y - 1 along one axis, whose closed interval [low, high] in pixels from the picture's middle reaches.
uvec2 tilesIn(float low, float high, float half_size, float tile, uint tiles) {
    const float begin = ceil((low + half_size + 0.5) / tile - 1.0);
    const float end = floor((high + half_size - 0.5) / tile) + 1.0;
    return uvec2(clamp(vec2(begin, end), 0.0, float(tiles)));
}

#if GLINT_PLAIN

// The square of three standard deviations along the longer axis, as in the original.
float squareOf(Footprint f) {
    const float a = 0.72134752 / (f.scale_x * f.scale_x);
    const float rest = 0.72134752 / (f.scale_y * f.scale_y);
    const float c = rest + f.shear * f.shear * a;
    const float mean = 0.5 * (a + c);
    return ceil(3.0 * sqrt(mean + sqrt(max(mean * mean - a * rest, 0.1))));
}

uvec2 tileRows(Footprint f) {
    const float extent = squareOf(f);
    return tilesIn(f.center.y - extent, f.center.y + extent, frame.half_size.y, TILE_Y, frame.tiles.y);
}

uvec2 tileSpan(Footprint f, uint row) {
    const float extent = squareOf(f);
    return tilesIn(f.center.x - extent, f.center.x + extent, frame.half_size.x, TILE_X, frame.tiles.x);
}

#else

// From the center to the ellipse's highest point.
float heightOf(Footprint f) {
    const float extent = sqrt(f.log_opacity - frame.log_cut) * length(vec2(1.0 / f.scale_y, f.shear / f.scale_x));
    return extent + marginOf(extent + abs(f.center.y));
}

// Rows of tiles.
uvec2 tileRows(Footprint f) {
    const float extent = heightOf(f);
    return tilesIn(f.center.y - extent, f.center.y + extent, frame.half_size.y, TILE_Y, frame.tiles.y);
}

// From left to right, in pixels from the center: the part of the ellipse between two lines, that there is one. It is
// convex: it begins and ends at the ellipse's own leftmost and rightmost points where they are between the lines, else
// where the ellipse crosses the line that is nearer to them.
vec2 widthBetween(Footprint f, float top, float bottom) {
    const float limit = f.log_opacity - frame.log_cut;
    const float right = sqrt(limit) / f.scale_x;
    const float height = f.shear * right;  // of the rightmost point
    const vec2 edge = clamp(vec2(-height, height), vec2(top), vec2(bottom));
    const float ratio = f.scale_y / f.scale_x;
    const float slope = ratio * f.shear;
    const float norm = 1.0 + slope * slope;
    const vec2 root = sqrt(max(limit * norm - f.scale_y * f.scale_y * edge * edge, 0.0)) / (f.scale_x * norm);
    const vec2 middle = (ratio * slope / norm) * edge;
    vec2 span = middle + vec2(-root.x, root.y);
    if (edge.x == -height) span.x = -right;
    if (edge.y == height) span.y = right;
    const float margin = marginOf(abs(f.center.x) + max(abs(middle.x) + root.x, abs(middle.y) + root.y));
    return span + vec2(-margin, margin);
}

// Tiles of a row.
uvec2 tileSpan(Footprint f, uint row) {
    const float top = float(row) * TILE_Y + 0.5 - frame.half_size.y - f.center.y;
    const vec2 span = f.center.x + widthBetween(f, top, top + TILE_Y - 1.0);
    return tilesIn(span.x, span.y, frame.half_size.x, TILE_X, frame.tiles.x);
}

#endif
