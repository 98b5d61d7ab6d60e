// The barrier between submissions of whoever recorded them.
#pragma once

#include <vulkan/vulkan.h>

namespace darb {

/// After it everything that was written before it is visible to what follows.
VkMemoryBarrier2 full_barrier();
void record_barrier(VkCommandBuffer commands, const VkMemoryBarrier2& barrier);

}  // namespace darb
