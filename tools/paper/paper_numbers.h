// SPDX-License-Identifier: MIT
// The figures that the paper prints per scene: DARB-Splatting, arXiv 2501.12369, supplementary
// Tables 1 and 2. One RTX 4090, single runs.
#pragma once

#include <span>
#include <string_view>
#include <vector>

namespace darb {

struct PaperNumbers {
    std::string_view scene;  // lower case: bicycle, ..., truck, train, drjohnson, playroom
    int kernel;              // KERNEL_*
    int iteration;           // 7,000 or 30,000
    double psnr_db, ssim, lpips, model_mb, training_s;
};

/// 13 scenes, 5 kernels, 2 numbers of iterations.
std::span<const PaperNumbers> paper_numbers();

/// The figures for the scene that has the data set's name, ignoring case; empty where there is
/// none.
std::vector<PaperNumbers> paper_numbers_of(std::string_view dataset);

/// "Mip-NeRF 360", "Tanks and Temples", "Deep Blending".
std::span<const std::string_view> paper_benchmarks();

/// The benchmark with a scene that has the data set's name, ignoring case; empty where there is
/// none.
std::string_view paper_benchmark_of(std::string_view dataset);

}  // namespace darb
