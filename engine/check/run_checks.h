// Every numerical check of a device and its driver against double: kernels, scan, sort, loss, the
// whole walk forward and back, and the hard cases.
#pragma once

#include "engine/check/check_report.h"
#include "engine/gpu/device.h"
#include "engine/kernels/kernel_family.h"

namespace darb::check {

struct CheckOptions {
    // Walks and hard cases in all kernels and footprints, and beside them the reference in float;
    // minutes.
    bool every_kernel = false;
};

/// All rows, in order; each also goes to on_row as it is ready.
std::vector<Row> run_checks(Device& device, const CheckOptions& options, const OnRow& on_row);

// Its parts.
std::vector<Row> check_kernels(Device& device);
std::vector<Row> check_scan_and_sort(Device& device);
std::vector<Row> check_loss(Device& device);
std::vector<Row> check_walk(Device& device, int kernel, Footprint footprint, int evaluation,
                            bool float_alone = false);

}  // namespace darb::check
