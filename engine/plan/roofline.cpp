// SPDX-License-Identifier: MIT
#include "engine/plan/roofline.h"

#include <algorithm>
#include <limits>
#include <string>

#include "engine/gpu/buffer.h"
#include "engine/gpu/commands.h"
#include "engine/gpu/pipeline.h"
#include "engine/scene/splat_model.h"
#include "shaders/shared/limits.h"
#include "shaders/shared/measure_args.h"
#include "shaders/shared/render_args.h"

namespace darb {

namespace {

// Larger than the last-level caches of most CPUs and of GPUs.
constexpr std::uint64_t kCpuCopyBytes = 32u << 20, kGpuCopyBytes = 512u << 20;
constexpr int kRuns = 4;  // the first compiles

// Bytes per splat and per intersection, from the layouts in shaders/shared/render_args.h and
// Forward.
constexpr double kProjectedBytes = 4 * 16;               // shape, light, bound, cover
constexpr double kIntersectionBytes = 2 * 4 + 3 * 16;    // order, splat, and the projected splat
constexpr double kSumsBytes = PARTIALS * sizeof(float);  // sums of an intersection's gradients
constexpr double kSortBytes = 4 + 8 + 8;  // a digit: histogram, scatter's read and write
constexpr double kTouchedShare = 0.6;     // share of a tile's four blocks that an ellipse touches
constexpr double kPixelsOfTile = TILE_SIZE * TILE_SIZE;
// Multiply-adds, counted in the shaders.
constexpr double kProjectFma = 250, kProjectBackwardFma = 600, kShFma = 3;
constexpr double kBlendFma = 20, kBlendBackwardFma = 50;
constexpr double kExposureFma = 9 + 12 + 9;
constexpr double kDepthLossFma = 6;
constexpr double kLossFma = 3 * 2 * 2 * 11 * 5;  // channels, ways, axes, taps, moments

double best_ms(Commands& commands, const auto& record) {
    double best = std::numeric_limits<double>::infinity();
    for (int run = 0; run < kRuns; ++run) {
        commands.begin();
        commands.pass("measure");
        record();
        commands.submit_and_wait();
        if (run > 0 && !commands.pass_times().empty())
            best = std::min(best, commands.pass_times()[0].ms);
    }
    return best;
}

}  // namespace

DeviceRates measure_rates(Device& device) {
    if (device.info().timestamp_period_ns <= 0) return {};
    DeviceRates rates;
    Commands commands(device);
    const DeviceInfo& info = device.info();
    const bool cpu = info.type == "cpu";
    const std::uint64_t copied =
        cpu ? kCpuCopyBytes
            : std::min({kGpuCopyBytes, info.max_allocation_bytes, info.heap_bytes / 8});
    const std::uint32_t groups = cpu ? 64 : 4096;
    {
        const Buffer from(device, "copy source", copied), to(device, "copy target", copied);
        const Pipeline pipeline(device, "copy_rate");
        const gpu::CopyArgs args{static_cast<std::uint32_t>(copied / 16)};
        const auto by_shader = [&] { commands.dispatch(pipeline, args, {from, to}, groups); };
        // An H200's own copies are five times slower than those of a shader.
        const double ms = std::min(best_ms(commands, [&] { commands.copy(from, to, copied); }),
                                   best_ms(commands, by_shader));
        rates.bytes_per_s = 2e3 * static_cast<double>(copied) / ms;
    }
    const Pipeline pipeline(device, "fma_rate");
    const Buffer sums(device, "fma sums", std::uint64_t{groups} * MEASURE_THREADS * 4);
    const gpu::FmaArgs args{1.0f, 1e-7f};
    const double ms = best_ms(commands, [&] { commands.dispatch(pipeline, args, {sums}, groups); });
    rates.fma_per_s = 1e3 * groups * MEASURE_THREADS * double(MEASURE_STEPS) * MEASURE_CHAINS / ms;
    return rates;
}

std::optional<PassWork> pass_work(std::string_view pass, const FrameCounts& c) {
    const double rest = c.rest_floats;
    const double others = splat_floats(0), floats = others + rest;  // floats per splat
    const double samples =
        c.evaluated > 0 ? c.evaluated : c.intersections * kPixelsOfTile * kTouchedShare;
    if (pass == "project")
        return PassWork{c.splats * 8 + c.visible * (4 * floats + kProjectedBytes),
                        c.visible * (kProjectFma + kShFma * rest)};
    if (pass == "compact") return PassWork{c.splats * 4 * 4 + c.visible * (16 + 8), 0};
    if (pass == "depth sort") return PassWork{c.visible * 4 * kSortBytes, 0};
    if (pass == "emit") return PassWork{c.visible * (16 + 32 + 5 * 4) + c.intersections * 8, 0};
    if (pass == "tile sort") return PassWork{c.intersections * 2 * kSortBytes, 0};
    if (pass == "scan") return PassWork{c.splats * 3 * 4, 0};  // read twice, written once
    if (pass == "tile ranges") return PassWork{c.intersections * 4, 0};
    if (pass == "blend")
        return PassWork{c.intersections * kIntersectionBytes + c.pixels * 20, samples * kBlendFma};
    if (pass == "loss") return PassWork{c.pixels * (12 + 4 + 12), c.pixels * kLossFma};
    if (pass == "exposure")  // the map, and its gradient and that of the picture before it
        return PassWork{c.pixels * (28 + 44), c.pixels * kExposureFma};
    if (pass == "depth loss") return PassWork{c.pixels * 24, c.pixels * kDepthLossFma};
    if (pass == "blend backward")
        return PassWork{c.intersections * (kIntersectionBytes + 2 * kSumsBytes) + c.pixels * 20,
                        samples * kBlendBackwardFma};
    if (pass == "project backward") {  // parameters and two moments, read and written, or the sum
        const double steps = 1 / c.rest_every;
        const double sums =
            c.rest_every > 1 ? (c.visible * (1 - steps) + c.splats * steps) * 8 * rest : 0;
        return PassWork{
            c.splats * (24 * (others + rest * steps) + 16) + sums + c.intersections * kSumsBytes,
            c.visible * (kProjectBackwardFma + 3 * kShFma * rest)};
    }
    return std::nullopt;
}

double roofline_share(const PassWork& work, const DeviceRates& rates, double ms) {
    if (!(rates.bytes_per_s > 0 && rates.fma_per_s > 0 && ms > 0)) return 0;
    return 1e3 * std::max(work.bytes / rates.bytes_per_s, work.fma / rates.fma_per_s) / ms;
}

}  // namespace darb
