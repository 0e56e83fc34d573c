#pragma once

#include <glint/format/scene.h>

/// Three koi that swim in a circle, made by formula as a glTF file would hold them: each has a body, fins and eyes on
/// a skin of 16 joints. Materials have maps of colours, normals, metal and roughness; the animation of eight seconds
/// turns joints by lines and cubic splines, and opens the mouths, which are morph targets.
glint::Scene makeKoi();
