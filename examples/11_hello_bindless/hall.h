#pragma once

#include <glint/format/scene.h>

/// The scene that the example shows without a file, as a glTF file would hold it: a hall with a tiled floor, brick
/// walls, marble pillars with bronze bands, 22 pictures in gilded frames and 12 balls of rusty, scratched and hammered
/// metal. 46 images of 256 by 256 texels, all made by formula. Y up; from -220 to 220, 0 to 360 and -1400 to 1400.
glint::Scene makeHall();
