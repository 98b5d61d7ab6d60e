// The hard cases: scenes on which renderers of splats are known to break, each with what goes wrong
// elsewhere.
#pragma once

#include <string>
#include <vector>

#include "engine/check/check_report.h"
#include "engine/check/device_walk.h"
#include "engine/reference/random_scene.h"

namespace darb::check {

struct HardCase {
    std::string name;
    std::string what;  // goes wrong where nothing guards
    reference::TestScene scene;
    WalkSettings settings;
    const char* image_tolerance = "image_float32";
    const char* gradient_tolerance = "gradient_scaled_float32";
    bool gradient = true;        // compare it with double
    bool expects_splats = true;  // some must be seen
};

/// All scenes in one kernel and footprint. Deterministic.
std::vector<HardCase> hard_cases(int kernel, Footprint footprint);

/// The case on the device against the reference in double: image, every gradient as one row (the
/// worst attribute), and that all is finite. float_alone: fill that field of the rows too.
std::vector<Row> check_hard_case(Device& device, const HardCase& hard_case,
                                 const std::string& group, bool float_alone = false);

/// Splats with NaN, infinite, denormal and huge parameters among healthy ones change no bit of the
/// image that the healthy ones alone give, and no bit of their gradients where they are culled.
std::vector<Row> check_poison(Device& device, int kernel, const std::string& group);

}  // namespace darb::check
