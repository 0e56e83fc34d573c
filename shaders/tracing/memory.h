// How a shader reads hierarchies: GLINT_TRACING_LOAD(i) is texel i, of 16 bytes. GLINT_TRACING_MEMORY picks the form:
//
//   GLINT_TRACING_TEXELS   a storage texel buffer: the cheapest on lavapipe
//   GLINT_TRACING_STORAGE  storage buffers of 2^23 texels (128 MiB) each, GLINT_TRACING_BUFFERS of them: in every
//                          language
//   GLINT_TRACING_ADDRESS  a buffer address, in GLINT_TRACING_POINTER (a uvec2 that the shader has), else in a uniform block
//
// at GLINT_TRACING_SET and GLINT_TRACING_BINDING. With GLINT_TRACING_WRITE 1 there is GLINT_TRACING_STORE(i, texel), too.
#pragma once

#define GLINT_TRACING_TEXELS 0
#define GLINT_TRACING_STORAGE 1
#define GLINT_TRACING_ADDRESS 2

#ifndef GLINT_TRACING_MEMORY
#define GLINT_TRACING_MEMORY GLINT_TRACING_STORAGE
#endif
#ifndef GLINT_TRACING_SET
#define GLINT_TRACING_SET 0
#endif
#ifndef GLINT_TRACING_BINDING
#define GLINT_TRACING_BINDING 0
#endif
#ifndef GLINT_TRACING_BUFFERS
#define GLINT_TRACING_BUFFERS 1
#endif
#ifndef GLINT_TRACING_WRITE
#define GLINT_TRACING_WRITE 0
#endif
#if GLINT_TRACING_WRITE
#define GLINT_TRACING_ACCESS
#else
#define GLINT_TRACING_ACCESS readonly
#endif

#if GLINT_TRACING_MEMORY == GLINT_TRACING_TEXELS
layout(set = GLINT_TRACING_SET, binding = GLINT_TRACING_BINDING, rgba32ui)
GLINT_TRACING_ACCESS uniform uimageBuffer glint_texels;
#define GLINT_TRACING_LOAD(i) imageLoad(glint_texels, int(i))
#define GLINT_TRACING_STORE(i, texel) imageStore(glint_texels, int(i), texel)

#elif GLINT_TRACING_MEMORY == GLINT_TRACING_STORAGE
layout(set = GLINT_TRACING_SET, binding = GLINT_TRACING_BINDING) GLINT_TRACING_ACCESS buffer GlintTexels {
    uvec4 texels[];
} glint_texels[GLINT_TRACING_BUFFERS];
#if GLINT_TRACING_BUFFERS == 1
#define GLINT_TRACING_LOAD(i) glint_texels[0].texels[i]
#define GLINT_TRACING_STORE(i, texel) glint_texels[0].texels[i] = (texel)
#else
// A switch instead of a varying index: not every device can index buffers by what varies.
uvec4 glintLoad(uint i) {
    for (uint b = 0u; b < GLINT_TRACING_BUFFERS - 1; b++) {
        if (i >> 23 == b) return glint_texels[b].texels[i & 0x7fffffu];
    }
    return glint_texels[GLINT_TRACING_BUFFERS - 1].texels[i - (uint(GLINT_TRACING_BUFFERS - 1) << 23)];
}
#define GLINT_TRACING_LOAD(i) glintLoad(i)
#if GLINT_TRACING_WRITE
void glintStoreTexel(uint i, uvec4 texel) {
    for (uint b = 0u; b < GLINT_TRACING_BUFFERS - 1; b++) {
        if (i >> 23 == b) glint_texels[b].texels[i & 0x7fffffu] = texel;
    }
    if (i >> 23 >= GLINT_TRACING_BUFFERS - 1)
        glint_texels[GLINT_TRACING_BUFFERS - 1].texels[i - (uint(GLINT_TRACING_BUFFERS - 1) << 23)] = texel;
}
#define GLINT_TRACING_STORE(i, texel) glintStoreTexel(i, texel)
#endif
#endif

#elif GLINT_TRACING_MEMORY == GLINT_TRACING_ADDRESS
#extension GL_EXT_buffer_reference : require
#extension GL_EXT_buffer_reference_uvec2 : require
#ifndef GLINT_TRACING_POINTER
layout(set = GLINT_TRACING_SET, binding = GLINT_TRACING_BINDING) uniform GlintHeap { uvec2 address; } glint_heap;
#define GLINT_TRACING_POINTER glint_heap.address
#endif
layout(buffer_reference, buffer_reference_align = 16) GLINT_TRACING_ACCESS buffer GlintTexels { uvec4 texels[]; };
#define GLINT_TRACING_LOAD(i) GlintTexels(GLINT_TRACING_POINTER).texels[i]
#define GLINT_TRACING_STORE(i, texel) GlintTexels(GLINT_TRACING_POINTER).texels[i] = (texel)
#endif
