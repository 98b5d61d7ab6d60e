// SPDX-License-Identifier: MIT
// Panes: pictures of one scene side by side in strips of the window, the photo first where it is
// compared, then a kernel each; between them lines that can be dragged.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

namespace darb {

inline constexpr std::size_t kMostBeside = 3;  // kernels beside the first

struct Panes {
    std::vector<int> kernels;     // beside that of the display, from left to right
    bool difference = false;      // all but the first show their difference to the first
    float difference_max = 0.1f;  // mean absolute difference that is shown hottest
    std::vector<float> lines;     // shares of the window's width, ascending
    /// Of the last whole pictures against the first, dB, one each but the first; none in motion.
    std::vector<double> psnr_db;
};

/// Those of panes.kernels but the one that is shown first.
std::vector<int> kernels_beside(const Panes& panes, int shown);
/// A part of a window, in shares of its width.
struct Strip {
    float begin = 0, end = 1;
};
/// Lines where their number is not one less than that of the panes: evenly spaced in `within`.
void fit_lines(std::size_t panes, Panes& state, const Strip& within = {});
/// A line stays between its neighbours.
void move_line(std::size_t line, float share, Panes& state);
/// Where the panes begin and end, px: [panes + 1], from 0 to width, ascending.
std::vector<int> pane_edges(const std::vector<float>& lines, int width);

/// Of 8-bit pixels B8G8R8A8, where both have an alpha; infinity where they are equal, NaN where
/// none has.
double pixels_psnr_db(std::span<const std::uint32_t> a, std::span<const std::uint32_t> b);

}  // namespace darb
