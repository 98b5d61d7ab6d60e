// SPDX-License-Identifier: MIT
// One forward and backward pass of a scene on the tests' device, read back.
#pragma once

#include "engine/check/device_walk.h"
#include "engine/render/renderer.h"
#include "tests/support/compare_arrays.h"
#include "tests/support/shared_device.h"
#include "tests/support/test_scene.h"

namespace darb::test {

using check::DeviceWalk;
using check::forward_options;
using check::to_planes;
using check::WalkSettings;

inline DeviceWalk walk_on_device(const SplatModel& model, const Camera& camera,
                                 const Image<double>& d_image, const WalkSettings& settings) {
    return check::walk_on_device(shared_device(), model, camera, d_image, settings);
}

}  // namespace darb::test
