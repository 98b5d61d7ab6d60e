// SPDX-License-Identifier: MIT
// Forward and backward blending as plain C++ loops over vectors of floats, on as many threads as
// the machine has cores: the yardstick of `darb bench` for what the blend passes could achieve on a
// CPU. They walk the same tile lists, evaluate the same splat-pixels and give the same results as
// shaders/forward/blend.comp and shaders/backward/blend_backward.comp.
#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <string>
#include <vector>

#include "engine/raster/forward_options.h"
#include "engine/raster/frame.h"
#include "engine/raster/frame_view.h"

namespace darb {

/// What the blend passes of one frame read, copied to the host. Gaussian splats in float32.
struct BlendFrame {
    std::uint32_t width = 0, height = 0;     // px
    std::uint32_t tiles_x = 0, tiles_y = 0;  // tiles
    std::vector<glm::uvec2> tile_range;      // [T] begin and end in intersection_from_sorted
    std::vector<std::uint32_t>
        intersection_from_sorted;  // [K] slots, tile after tile, front to back
    std::vector<std::uint32_t> splat_from_intersection;  // [K] by slot, with block bits
    std::vector<glm::vec4> shape, light, bound;          // [N] as project.comp leaves them
    glm::vec3 background{0.0f};
    std::array<float, 6> polynomial{};  // coefficients for 2^f, rising powers
    float alpha_cutoff = 0;
    float least_transmittance = 0;  // the stop less its slack
};

/// Reads back the frame that was recorded last; the queue must be idle. Throws Error where it uses
/// another kernel, evaluation or storage than the loops support.
BlendFrame download_frame(const ForwardOptions& options, const Frame& frame, const FrameView& view,
                          std::uint32_t splats, std::uint32_t intersections);

/// What the forward loop writes and the backward loop reads.
struct BlendedImage {
    std::vector<float> image;                // [3][H][W]
    std::vector<float> final_transmittance;  // [H][W]
    std::vector<std::uint32_t>
        last_intersection;  // [H][W] 1 + the last intersection looked at; 0: none
};

struct BlendCounts {
    std::uint64_t evaluated = 0;     // splat-pixels whose kernel is evaluated, 64 per block of 8 x
                                     // 8
    std::uint64_t contributing = 0;  // those among them that change a pixel
};

/// Partial sums per intersection, in its slot, as blend_backward.comp writes them.
struct BlendPartials {
    std::vector<float> first;  // [K][8]
    std::vector<float> rest;   // [K]
};

/// The instructions that the loops use on this machine: "AVX-512", "AVX2" or "baseline".
std::string native_instructions();

/// threads: 0 = all cores. The vectors in the results are sized at the first call and reused.
void native_blend(const BlendFrame& frame, BlendedImage& result, int threads = 0);
/// d_image: [3][H][W].
void native_blend_backward(const BlendFrame& frame, const BlendedImage& image,
                           const std::vector<float>& d_image, BlendPartials& result,
                           int threads = 0);
/// Counts; slower than native_blend, and not timed.
BlendCounts count_blend(const BlendFrame& frame);

// Sort and scan in plain C++ on one thread, with which those of the device are compared.

/// Stable, least significant digit first, 8 bits per pass. Temporaries are kept between calls.
class NativeSort {
  public:
    void sort(std::vector<std::uint32_t>& keys, std::vector<std::uint32_t>& values);

  private:
    std::vector<std::uint32_t> keys_, values_;
};

/// Exclusive prefix sum modulo 2^32.
void native_scan(const std::vector<std::uint32_t>& counts, std::vector<std::uint32_t>& offsets);

}  // namespace darb
