// SPDX-License-Identifier: MIT
// The hard cases: scenes that are known to break renderers of splats, each with what goes wrong
// elsewhere.
#pragma once

#include <string>
#include <vector>

#include "engine/check/device_walk.h"
#include "engine/check/run_checks.h"
#include "engine/reference/splats.h"

namespace darb::check {

struct HardCase {
    std::string name;
    std::string what;  // what goes wrong in a renderer without guards
    reference::TestScene scene;
    WalkSettings settings;
    const char* image_tolerance = "image_float32";
    const char* gradient_tolerance = "gradient_scaled_float32";
    bool gradient = true;        // compare the gradient with double
    bool expects_splats = true;  // some splats must be visible
};

/// All scenes with one kernel and footprint. Deterministic.
std::vector<HardCase> hard_cases(int kernel, Footprint footprint);

/// Compares the case on the device with the reference in double: the image, every gradient as one
/// row (the worst attribute), and that everything is finite. float_alone: also fill that field of
/// the rows.
std::vector<Row> check_hard_case(Device& device, const HardCase& hard_case,
                                 const std::string& group, bool float_alone = false);

/// Checks that splats with NaN, infinite, denormal and huge parameters among healthy ones change no
/// bit of the image that the healthy ones alone give and, where they are culled, no bit of their
/// gradients.
std::vector<Row> check_poison(Device& device, int kernel, const std::string& group);

}  // namespace darb::check
