// Whether a run can begin at all: before anything is made for its first splats.
#pragma once

#include "engine/data/dataset.h"
#include "engine/gpu/device.h"
#include "trainer/options.h"

namespace darb {

/// Bytes of host memory that this process may still take: what the system has left, within its own
/// limits (RLIMIT_AS); the most there is where nothing says.
std::uint64_t free_host_bytes();

/// Throws Error, with the number that fits, where the splats that a run begins with do not fit into
/// the device or the points that they come from not into `host_bytes`. What is counted is less than
/// what a run takes: it refuses only what cannot be.
void check_start_memory(const Device& device, const Dataset& dataset, const TrainOptions& options,
                        std::uint64_t host_bytes = free_host_bytes());

}  // namespace darb
