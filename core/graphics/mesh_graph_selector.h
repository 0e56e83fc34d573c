#pragma once

#include <glint/graphics/mesh_graph_model.h>
#include <glint/math/camera.h>

#include <cstdint>
#include <memory>

namespace glint {

/// Chooses what is to be drawn of many instances of a graph, on the device: for each instance the cut of
/// MeshGraph::cut, less what cannot be seen.
///
///     MeshGraphSelector selector;
///     if (!selector.create(device)) return 1;
///     Compute compute = device.createCompute();
///     selector.select(compute, model, transforms, count, camera.parameters(), {1600, 900}, 1.0f);
///     ...                             // draw selector.getList() with selector.getCount()
///     if (!device.submit(compute)) return 1;
///     if (!selector.check()) ...      // once more: the list has grown
///
/// Whatever is rounded, the list is a cut: no crack, nothing twice. It is the cut of MeshGraph::cut, but where a
/// group's error is as near to the threshold as the rounding of its distance (docs/meshes.md).
///
/// A value: copies share the buffers. One thread may record selections of one selector, and they are played in the
/// order of the submissions. Selections set the list's kernel, its uniform block and storage buffers from slot 0 on.
class MeshGraphSelector {
public:
    using Where = std::source_location;

    /// What is left out of the list.
    enum Cull : uint8_t {
        CullNone = 0,
        CullFrustum = 1u << 0,  ///< clusters that are outside of the picture, or nearer than the near plane
        CullCone = 1u << 1,     ///< clusters all of whose triangles show their backs; not for pictures that show them
        CullAll = CullFrustum | CullCone,
    };

    /// What was selected last, as check() has found it.
    struct Statistics {
        uint32_t clusters = 0;     ///< entries that the list would have, without a limit
        uint32_t capacity = 0;     ///< entries that there was room for
        uint64_t triangles = 0;    ///< of these clusters
        uint32_t outside = 0;      ///< groups and clusters that CullFrustum has left out
        uint32_t facing_away = 0;  ///< clusters that CullCone has left out
        uint32_t refused = 0;      ///< instances left out because of their transforms
        uint64_t bytes = 0;        ///< of the list
    };

    /// Errors: "handle.null", those of kernels and buffers.
    Status create(const Device& device, Where where = Where::current());
    /// True once create() has succeeded.
    explicit operator bool() const { return state_ != nullptr; }

    /// Records the selection; getList() and getCount() are this one's from then on.
    ///
    /// `instances`: Transform3x4 each, object to world, from the beginning of a buffer with FlagStorage. One that is
    /// not finite, all 0, or has its largest number (but for the translation) beyond 2^-60 and 2^60 draws nothing; one
    /// that has no inverse, or stretches 2^16 times as much one way as another, is drawn in full. `size` of the picture
    /// in pixels. `pixels`: the error that may be seen, as MeshGraphView::error has it; 0 is the full mesh (or what
    /// equals it, point by point).
    ///
    /// Errors, which fail the list: "selector.view" (a camera that is not finite, a size of 0, an error that is
    /// negative or NaN), "selector.instances" (a buffer that is too small), "selector.too_many" (more than 2^32 - 1
    /// clusters in all, or more instances than can be dispatched), those of a failed model, "handle.null" before
    /// create().
    void select(Compute& compute, const MeshGraphModel& model, const Buffer& instances, uint32_t instance_count,
                const CameraParameters& camera, const Vector2u& size, float pixels, Cull cull = CullAll,
                Where where = Where::current());

    /// What is to be drawn: uvec2 each, x the instance, y the cluster, in any order. FlagStorage.
    Buffer getList() const;
    /// uint[8]: first the number of entries in the list, never more than fit in it. FlagStorage and FlagIndirect.
    Buffer getCount() const;
    /// Entries that the list has room for.
    uint32_t getCapacity() const;

    /// Waits for the device. "selector.capacity" if the list of a selection since the last check did not fit: clusters
    /// are missing. It grows with the next selection, as far as the device allows.
    Status check(Where where = Where::current());
    Statistics getStatistics() const;

private:
    struct State;
    std::shared_ptr<State> state_;
};

/// Both.
constexpr MeshGraphSelector::Cull operator|(MeshGraphSelector::Cull a, MeshGraphSelector::Cull b) {
    return static_cast<MeshGraphSelector::Cull>(static_cast<uint8_t>(a) | static_cast<uint8_t>(b));
}

}  // namespace glint
