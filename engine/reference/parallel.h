// SPDX-License-Identifier: MIT
// parallel_for hands out indices one by one to a few threads; used per tile and per block.
#pragma once

#include <algorithm>
#include <atomic>
#include <cstddef>
#include <thread>

#include "engine/core/on_threads.h"

namespace darb::reference {

/// Calls body(i) for i in [0, count) on `threads` threads (0: one per core). body must not throw,
/// and must write to disjoint places.
template <class Body>
void parallel_for(size_t count, int threads, const Body& body) {
    size_t workers = threads > 0 ? static_cast<size_t>(threads)
                                 : std::max(1U, std::thread::hardware_concurrency());
    workers = std::min(workers, count);
    std::atomic<size_t> next{0};
    const auto work = [&] {
        for (size_t i = next++; i < count; i = next++) {
            body(i);
        }
    };
    on_threads(workers, work);
}

}  // namespace darb::reference
