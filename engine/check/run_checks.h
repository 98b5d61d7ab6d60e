// SPDX-License-Identifier: MIT
// Every numerical check of a device and its driver against double: kernels, scan, sort, loss, the
// whole walk forward and back, and the hard cases.
#pragma once

#include <optional>

#include "engine/check/check_report.h"
#include "engine/gpu/device.h"
#include "engine/kernels/kernel_family.h"

namespace darb::check {

struct CheckOptions {
    // Runs walks and hard cases in all kernels and footprints, and the reference in float beside
    // them; takes minutes.
    bool every_kernel = false;
    // Checks values, walks and hard cases of this kernel alone, in its footprints.
    std::optional<int> kernel;
};

/// All rows, in order; each also goes to on_row when it is ready.
std::vector<Row> run_checks(Device& device, const CheckOptions& options, const OnRow& on_row);

// The parts of run_checks().

/// Checks all listed kernels, including those with several pulses, or just one.
std::vector<Row> check_kernels(Device& device, std::optional<int> kernel = std::nullopt);
std::vector<Row> check_scan_and_sort(Device& device);
std::vector<Row> check_loss(Device& device);
std::vector<Row> check_walk(Device& device, int kernel, Footprint footprint, int evaluation,
                            bool float_alone = false);

}  // namespace darb::check
