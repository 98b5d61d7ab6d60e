// SPDX-License-Identifier: MIT
// How near each pass is to what the device can do: two rates measured at start, and the bytes and
// operations of each pass, estimated from counts. The one place where these estimates stand.
#pragma once

#include <optional>
#include <string_view>

#include "engine/gpu/device.h"

namespace darb {

struct DeviceRates {
    double bytes_per_s = 0;  // copy between buffers, bytes read and written together
    double fma_per_s = 0;    // float32 multiply-adds in registers
};

/// Best of a few runs; about a tenth of a second. 0 where the device has no timestamps.
DeviceRates measure_rates(Device& device);

/// Means of the frames or iterations that a time belongs to.
struct FrameCounts {
    double splats = 0, visible = 0, intersections = 0, pixels = 0;
    double rest_floats = 0;  // per splat in the buffers: 3 ((d + 1)^2 - 1) at SH degree d
    double evaluated = 0;    // splat-pixels of blending; 0: estimated from the intersections
    double rest_every = 1;   // iterations between steps of these floats, as AdamStep::rest_every
};

struct PassWork {
    double bytes = 0;  // bytes that must be moved at least once
    double fma = 0;
};

/// The work of a pass, by the name that Forward, Loss, Exposure or Backward gives it; nothing for
/// others.
std::optional<PassWork> pass_work(std::string_view pass, const FrameCounts& counts);

/// The time that the slower of the two rates needs for the work, over the time taken.
double roofline_share(const PassWork& work, const DeviceRates& rates, double ms);

}  // namespace darb
