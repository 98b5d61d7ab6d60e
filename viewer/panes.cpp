// SPDX-License-Identifier: MIT
#include "viewer/panes.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "engine/core/error.h"

namespace darb {

namespace {

constexpr float kNarrowest = 0.01f;  // share of the width between two lines

}  // namespace

std::vector<int> kernels_beside(const Panes& panes, int shown) {
    std::vector<int> kernels = panes.kernels;
    std::erase(kernels, shown);
    return kernels;
}

void fit_lines(std::size_t panes, Panes& state, const Strip& within) {
    const std::size_t wanted = panes > 0 ? panes - 1 : 0;
    if (state.lines.size() == wanted) return;
    state.lines.resize(wanted);
    for (std::size_t i = 0; i < wanted; ++i)
        state.lines[i] = within.begin + (within.end - within.begin) * static_cast<float>(i + 1) /
                                            static_cast<float>(panes);
}

void move_line(std::size_t line, float share, Panes& state) {
    std::vector<float>& lines = state.lines;
    if (line >= lines.size() || std::isnan(share)) return;
    const float low = line == 0 ? 0 : lines[line - 1] + kNarrowest;
    const float high = line + 1 == lines.size() ? 1 : lines[line + 1] - kNarrowest;
    lines[line] = std::clamp(share, std::min(low, high), high);
}

std::vector<int> pane_edges(const std::vector<float>& lines, int width) {
    std::vector<int> edges{0};
    for (const float line : lines) {
        const int at = static_cast<int>(std::lround(line * static_cast<float>(width)));
        edges.push_back(std::clamp(at, edges.back(), width));
    }
    edges.push_back(width);
    return edges;
}

double pixels_psnr_db(std::span<const std::uint32_t> a, std::span<const std::uint32_t> b) {
    DARB_CHECK(a.size() == b.size(), "{} pixels, {}", a.size(), b.size());
    std::uint64_t squares = 0, count = 0;
    for (std::size_t i = 0; i < a.size(); ++i) {
        if (a[i] >> 24 == 0 || b[i] >> 24 == 0) continue;
        for (int shift = 0; shift < 24; shift += 8) {
            const int d =
                static_cast<int>(a[i] >> shift & 255) - static_cast<int>(b[i] >> shift & 255);
            squares += static_cast<std::uint64_t>(d * d);
        }
        count += 3;
    }
    if (count == 0) return std::numeric_limits<double>::quiet_NaN();
    if (squares == 0) return std::numeric_limits<double>::infinity();
    return 10 * std::log10(255.0 * 255.0 * double(count) / double(squares));
}

}  // namespace darb
