#pragma once

// The top level: a hierarchy over instances of other hierarchies.

#include <glint/math/bounds.h>
#include <glint/math/math.h>
#include <glint/tracing/detail/hierarchy.h>

namespace glint::detail {

struct HierarchyInstance {
    Transform3x4 transform;     ///< object to world
    BoundBox bounds;            ///< of the hierarchy, as boundsOf gives it; an empty one makes an inactive instance
    uint32_t texel = 0;         ///< where the hierarchy begins, among all texels that the shader sees
    uint32_t custom_index = 0;  ///< 24 bits
    uint32_t mask = 0xff;       ///< 8 bits
    uint32_t offset = 0;        ///< 24 bits
    uint32_t flags = 0;         ///< Tracing::InstanceFlag
};

/// What the shader reads of an instance, in eight texels behind the records; instance i of the list has place i.
struct InstanceRecord {
    float to_world[12];   ///< rows of 3x4
    float to_object[12];  ///< the inverse; the traversal uses its left 3x3 on points relative to the instance's place
    uint32_t texel;
    uint32_t custom_index_mask;  ///< and the mask in bits 24-31
    uint32_t offset_flags;       ///< and the flags in bits 24-31
    uint32_t unused[5];
};
static_assert(sizeof(InstanceRecord) == 8 * sizeof(Texel));

/// The box of a hierarchy's primitives, refitted or not.
BoundBox boundsOf(const Hierarchy& hierarchy);

/// The world's box of an instance, outward rounded: no point of the object's box lies outside of it.
BoundBox worldBounds(const HierarchyInstance& instance);

/// Instances whose transform is singular or not finite are inactive. Errors: those of buildHierarchy.
Expected<Hierarchy> buildHierarchy(std::span<const HierarchyInstance> instances, BuildMode mode,
                                   ThreadPool* pool = nullptr, NodeForm form = NodeForm::Packed);

}  // namespace glint::detail
