// SPDX-License-Identifier: MIT
#include "tools/bench/native_blend.h"

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <numeric>
#include <thread>

#include "engine/core/error.h"
#include "engine/core/on_threads.h"
#include "engine/kernels/kernel_coefficients.h"
#include "shaders/shared/render_args.h"

namespace darb {

namespace {

constexpr int kBlockSide = 8, kBlockPixels = 64;
constexpr std::uint32_t kBlocks = 4;
constexpr int kBatch = 8;  // splats between checks whether every pixel has ended, as on a device
                           // with 8 lanes
constexpr float kAlphaMax = static_cast<float>(ALPHA_MAX);

/// The intersections in a tile's list that touch a block.
struct Hits {
    std::vector<std::uint32_t> splat, number;  // number: 1 + the place in the list
};

struct Block {
    std::uint32_t x, y;  // px, of its first pixel
};

Block block_at(const BlendFrame& f, std::uint32_t tile, std::uint32_t block) {
    return {tile % f.tiles_x * TILE_SIZE + (block & 1u) * kBlockSide,
            tile / f.tiles_x * TILE_SIZE + (block >> 1) * kBlockSide};
}

// The arguments of the loops of one instruction set.
struct Work {
    const BlendFrame& frame;
    BlendedImage* image;
    const std::vector<float>* d_image;
    BlendPartials* partials;
};
using TileFunction = void (*)(const Work&, std::uint32_t tile, Hits&);

struct Instructions {
    const char* name;
    TileFunction forward, backward;
};

namespace baseline {
#define DARB_LANES 8
#include "tools/bench/native_blend_loops.h"
#undef DARB_LANES
}  // namespace baseline

// GCC for Windows puts vectors of more than 16 bytes on the stack wherever it likes, and loads them
// as if they were aligned (GCC's bug 54412).
#if defined(__x86_64__) && !defined(__MINGW32__)
#define DARB_WIDE_VECTORS
#endif

#if defined(DARB_WIDE_VECTORS)
#if defined(__clang__)
#pragma clang attribute push(__attribute__((target("avx2,fma"))), apply_to = function)
#else
#pragma GCC push_options
#pragma GCC target("avx2,fma")
#endif
namespace avx2 {
#define DARB_LANES 8
#include "tools/bench/native_blend_loops.h"
#undef DARB_LANES
}  // namespace avx2
#if defined(__clang__)
#pragma clang attribute pop
#pragma clang attribute push( \
    __attribute__((target("avx2,fma,avx512f,avx512vl,avx512bw,avx512dq"))), apply_to = function)
#else
#pragma GCC target("avx512f,avx512vl,avx512bw,avx512dq")
#endif
namespace avx512 {
#define DARB_LANES 16
#include "tools/bench/native_blend_loops.h"
#undef DARB_LANES
}  // namespace avx512
#if defined(__clang__)
#pragma clang attribute pop
#else
#pragma GCC pop_options
#endif
#endif

Instructions best_instructions() {
#if defined(DARB_WIDE_VECTORS)
    if (__builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512vl") &&
        __builtin_cpu_supports("avx512bw") && __builtin_cpu_supports("avx512dq") &&
        __builtin_cpu_supports("fma"))
        return {"AVX-512", avx512::forward_tile, avx512::backward_tile};
    if (__builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma"))
        return {"AVX2", avx2::forward_tile, avx2::backward_tile};
#endif
    return {"baseline", baseline::forward_tile, baseline::backward_tile};
}

void run_tiles(const Work& work, TileFunction function, int threads) {
    const std::uint32_t tiles = work.frame.tiles_x * work.frame.tiles_y;
    if (threads <= 0) threads = std::max(1, static_cast<int>(std::thread::hardware_concurrency()));
    std::atomic<std::uint32_t> next{0};
    const auto walk = [&] {
        Hits hits;
        for (std::uint32_t tile = next++; tile < tiles; tile = next++) function(work, tile, hits);
    };
    std::vector<JoinedThread> others;
    for (int t = 1; t < threads; ++t) others.emplace_back(walk);
    walk();
}

}  // namespace

BlendFrame download_frame(const ForwardOptions& options, const Frame& frame, const FrameView& view,
                          std::uint32_t splats, std::uint32_t intersections) {
    const KernelCoefficients& k =
        kernel_coefficients(options.kernel, options.footprint, options.polynomial_degree);
    BlendFrame f;
    if (k.form != KERNEL_FORM_GAUSSIAN || options.evaluation == EVALUATION_BUILTIN ||
        options.storage != STORAGE_FLOAT32 || options.depth_order == DEPTH_ORDER_PIXEL ||
        k.degree >= static_cast<int>(f.polynomial.size()))
        throw Error("native blending", "supports only Gaussian splats in float32",
                    "Measure a scene of the Gaussian kernel at the default accuracy.");
    for (std::size_t i = 0; i < f.polynomial.size(); ++i)
        f.polynomial[i] = static_cast<float>(k.c[i]);
    f.width = view.camera.width;
    f.height = view.camera.height;
    f.tiles_x = view.camera.tiles_x;
    f.tiles_y = view.camera.tiles_y;
    f.tile_range =
        frame.intersections.tile_range.download<glm::uvec2>(std::size_t{f.tiles_x} * f.tiles_y);
    f.intersection_from_sorted =
        frame.intersections.intersection_from_sorted.download<std::uint32_t>(intersections);
    f.splat_from_intersection =
        frame.intersections.splat_from_intersection.download<std::uint32_t>(intersections);
    f.shape = frame.splats.shape.download<glm::vec4>(splats);
    f.light = frame.splats.light.download<glm::vec4>(splats);
    f.bound = frame.splats.bound.download<glm::vec4>(splats);
    f.background = view.background;
    f.alpha_cutoff = options.alpha_cutoff;
    f.least_transmittance = least_transmittance(options.transmittance_stop);
    return f;
}

std::string native_instructions() {
    return best_instructions().name;
}

void native_blend(const BlendFrame& frame, BlendedImage& result, int threads) {
    const std::size_t pixels = std::size_t{frame.width} * frame.height;
    result.image.resize(3 * pixels);
    result.final_transmittance.resize(pixels);
    result.last_intersection.resize(pixels);
    run_tiles({frame, &result, nullptr, nullptr}, best_instructions().forward, threads);
}

void native_blend_backward(const BlendFrame& frame, const BlendedImage& image,
                           const std::vector<float>& d_image, BlendPartials& result, int threads) {
    result.first.resize(frame.intersection_from_sorted.size() * 8);
    result.rest.resize(frame.intersection_from_sorted.size());
    // The loops of both directions share Work; this one only reads the image.
    run_tiles({frame, const_cast<BlendedImage*>(&image), &d_image, &result},
              best_instructions().backward, threads);
}

BlendCounts count_blend(const BlendFrame& frame) {
    BlendCounts counts;
    BlendedImage unused;
    Hits hits;
    for (std::uint32_t tile = 0; tile < frame.tiles_x * frame.tiles_y; ++tile)
        for (std::uint32_t block = 0; block < kBlocks; ++block)
            baseline::forward_block<true>(frame, tile, block, hits, unused, counts);
    return counts;
}

void NativeSort::sort(std::vector<std::uint32_t>& keys, std::vector<std::uint32_t>& values) {
    const std::size_t n = keys.size();
    keys_.resize(n);
    values_.resize(n);
    std::array<std::array<std::uint32_t, 256>, 4> count{};  // counts all digits in one pass
    for (const std::uint32_t key : keys)
        for (std::size_t digit = 0; digit < 4; ++digit) ++count[digit][key >> (8 * digit) & 255u];
    for (std::size_t digit = 0; digit < 4; ++digit) {
        std::array<std::uint32_t, 256> next;
        std::exclusive_scan(count[digit].begin(), count[digit].end(), next.begin(), 0u);
        for (std::size_t i = 0; i < n; ++i) {
            const std::uint32_t at = next[keys[i] >> (8 * digit) & 255u]++;
            keys_[at] = keys[i];
            values_[at] = values[i];
        }
        keys.swap(keys_);
        values.swap(values_);
    }
}

void native_scan(const std::vector<std::uint32_t>& counts, std::vector<std::uint32_t>& offsets) {
    offsets.resize(counts.size());
    std::exclusive_scan(counts.begin(), counts.end(), offsets.begin(), 0u);
}

}  // namespace darb
