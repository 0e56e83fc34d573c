#pragma once

// Loops over the threads of a pool.

#include <glint/base/thread_pool.h>

#include <algorithm>
#include <cstddef>
#include <functional>

namespace glint::detail {

/// Calls body(0) ... body(count - 1), each once, on the calling thread and those of the pool; returns when all are
/// done. Without a pool the caller does it all, in order. The pool may be busy with other work: the caller never waits
/// for a task that has not begun. Bodies must not throw, and may call parallelFor.
void parallelFor(ThreadPool* pool, size_t count, const std::function<void(size_t)>& body);

/// The same for ranges: body(begin, end) over [0, count) in pieces of `grain`, so that the pieces are the same for
/// any number of threads.
template <class Body>
void parallelRanges(ThreadPool* pool, size_t count, size_t grain, const Body& body) {
    const size_t pieces = (count + grain - 1) / grain;
    parallelFor(pieces > 1 ? pool : nullptr, pieces,
                [&](size_t i) { body(i * grain, std::min(count, (i + 1) * grain)); });
}

}  // namespace glint::detail
