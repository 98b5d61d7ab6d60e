// What `darb devices` prints: every Vulkan device with its limits, which is chosen, and why.
#pragma once

#include <cstdio>
#include <string>

namespace darb {

/// All devices, best first, the one that select (as --device) means marked with a star.
/// Throws Error as Device does where select means no usable device.
void print_devices(std::FILE* out, const std::string& select = {});

}  // namespace darb
