// Clears the state, and `count` words of the places of records.
#pragma once

#include <glint/tracing/build/common.h>

void main() {
    GLINT_FOR(i, GLINT_STATE_WORDS) {
        uint value = 0u;
        if (i < 3u) value = glintOrder(GLINT_MOST);
        if (i >= 3u && i < 6u) value = glintOrder(-GLINT_MOST);
        scratch[i] = value;
    }
    GLINT_FOR(row, build.count) scratch[build.keys + 2u * row] = GLINT_NONE;
}
