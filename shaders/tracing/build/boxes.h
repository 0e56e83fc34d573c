// A box for each triangle or box of a geometry. An inactive one's is empty.
#pragma once

#include <glint/tracing/build/bounds.h>
#include <glint/tracing/build/input.h>

void main() {
    GlintBox all_boxes = GLINT_EMPTY;
    uint present = 0u;
    GLINT_FOR(i, build.count) {
        const GlintShape shape = glintShape(i);
        GlintBox box = GLINT_EMPTY;
        if (glintIsActive(shape)) {
            box = glintBoxOf(shape);
            all_boxes = glintJoin(all_boxes, box);
            present++;
        }
        glintSetScratchBox(build.boxes + 6u * (build.first + i), box);
    }
    glintAddBounds(all_boxes, present);
}
