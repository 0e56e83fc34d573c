// The form of the hierarchies' nodes: NodeForm of core/tracing/detail/hierarchy.h.
#pragma once

#define GLINT_NODES_PACKED 0
#define GLINT_NODES_FULL 1
#ifndef GLINT_TRACING_NODES
#define GLINT_TRACING_NODES GLINT_NODES_PACKED
#endif

#if GLINT_TRACING_NODES == GLINT_NODES_PACKED
#define GLINT_NODE_WIDTH 8u
#define GLINT_NODE_TEXELS 4u
#else
#define GLINT_NODE_WIDTH 4u
#define GLINT_NODE_TEXELS 8u
#endif
