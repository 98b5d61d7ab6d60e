// SPDX-License-Identifier: MIT
// What `darb devices` prints: every Vulkan device with its limits, which one is chosen, and why;
// and what commands need of the chosen one.
#pragma once

#include <cstdio>
#include <string>

namespace darb {

class Device;

/// Prints all devices, best first, with a star at the one that `select` means (as for --device).
/// Nothing is printed where out is null. Throws Error as Device does where `select` means no usable
/// device.
void print_devices(std::FILE* out, const std::string& select = {});

/// Throws Error where the device cannot measure how long a pass takes.
void require_timestamps(const Device& device);

}  // namespace darb
