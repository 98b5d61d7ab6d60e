// Every numerical check of a device and its driver against double: kernels, scan, sort, loss, the
// whole walk forward and back, and the hard cases.
#pragma once

#include <optional>

#include "engine/check/check_report.h"
#include "engine/gpu/device.h"
#include "engine/kernels/kernel_family.h"

namespace darb::check {

struct CheckOptions {
    // Walks and hard cases in all kernels and footprints, and beside them the reference in float;
    // minutes.
    bool every_kernel = false;
    // Values, walks and hard cases of this kernel alone, in its footprints.
    std::optional<int> kernel;
};

/// All rows, in order; each also goes to on_row as it is ready.
std::vector<Row> run_checks(Device& device, const CheckOptions& options, const OnRow& on_row);

// Its parts.
/// Of all that are listed, rings included, or of one.
std::vector<Row> check_kernels(Device& device, std::optional<int> kernel = std::nullopt);
std::vector<Row> check_scan_and_sort(Device& device);
std::vector<Row> check_loss(Device& device);
std::vector<Row> check_walk(Device& device, int kernel, Footprint footprint, int evaluation,
                            bool float_alone = false);

}  // namespace darb::check
