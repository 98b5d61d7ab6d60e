// SPDX-License-Identifier: MIT
// Panes: pictures of one scene side by side in strips of the window. The photo comes first where it
// is compared, then one pane for each kernel. The lines between them can be dragged.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

namespace darb {

inline constexpr std::size_t kMostBeside = 3;  // kernels beside the first one

struct Panes {
    std::vector<int> kernels;     // beside the display's own, from left to right
    bool difference = false;      // all but the first show their difference from the first
    float difference_max = 0.1f;  // mean absolute difference that gets the hottest colour
    std::vector<float> lines;     // shares of the window's width, ascending
    /// PSNR of the last whole pictures against the first, dB, for each but the first; empty in
    /// motion.
    std::vector<double> psnr_db;
};

/// The kernels of panes.kernels without the one that is shown first.
std::vector<int> kernels_beside(const Panes& panes, int shown);
/// A part of a window, in shares of its width.
struct Strip {
    float begin = 0, end = 1;
};
/// Spaces the lines evenly in `within` unless there is exactly one between each two panes.
void fit_lines(std::size_t panes, Panes& state, const Strip& within = {});
/// Moves a line, which stays between its neighbours.
void move_line(std::size_t line, float share, Panes& state);
/// Where the panes begin and end, px: [panes + 1], from 0 to width, ascending.
std::vector<int> pane_edges(const std::vector<float>& lines, int width);

/// PSNR of two B8G8R8A8 pictures over the pixels where both have alpha; infinity where they are
/// equal, NaN where no pixel has.
double pixels_psnr_db(std::span<const std::uint32_t> a, std::span<const std::uint32_t> b);

}  // namespace darb
