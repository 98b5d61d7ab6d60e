// SPDX-License-Identifier: MIT
// What `darb devices` prints: every Vulkan device with its limits, which is chosen, and why; and
// what commands want of the chosen one.
#pragma once

#include <cstdio>
#include <string>

namespace darb {

class Device;

/// All devices, best first, the one that select (as --device) means marked with a star.
/// Nothing is printed where out is null. Throws Error as Device does where select means no usable
/// device.
void print_devices(std::FILE* out, const std::string& select = {});

/// Throws Error where the device cannot tell what a pass takes.
void require_timestamps(const Device& device);

}  // namespace darb
