// TrainOptions: everything that decides a training run, with the defaults of 3DGS (graphdeco).
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>

#include "engine/kernels/kernel_family.h"
#include "engine/plan/accuracy.h"
#include "engine/raster/effects.h"

namespace darb {

/// How the splats grow in number; see trainer/strategy.h.
enum class Strategy { adc, mcmc, budget };

constexpr int kPacedBelow = 4'000;  // iterations
constexpr float kMostPace = 5;
constexpr float kMostHaste = 10;

struct TrainOptions {
    int iterations = 30'000;
    std::uint64_t seed = 0;

    int kernel = KERNEL_GAUSSIAN;
    Footprint footprint = Footprint::psi;
    Accuracy accuracy;     // footprint and SH degree aside: they are the two here
    int sh_degree = 3;     // one more every degree_interval() iterations
    int sh_interval = -1;  // below 0: 1,000 over pace()
    // false: a degree is added at each interval. true: the first only where a probe on training
    // photos set aside gains, tried again after as many iterations as before. The others follow:
    // probes of a few iterations refuse them wrongly, and without these degrees the shipped scene
    // has 31.62 dB after 4,000, with them 32.20.
    bool probe_sh = false;
    bool antialias = false;  // opacity compensation and the 3D smoothing filter of Mip-Splatting
    bool exposure = false;   // an affine map of colours per photo, trained beside the splats
    float exposure_lr_init = 0.001f, exposure_lr_final = 0.0001f;
    ProjectionEffects projection;  // but for its antialias and smoothing, which are antialias
    bool alpha = true;             // false: every photo is opaque, its alpha is not read
    Crowds crowds = Crowds::by_counters;
    bool white_background = false;  // what pictures are compared over; black otherwise
    bool random_background = true;  // train over another colour each iteration: no surface can
                                    // stay half transparent to borrow the background's colour
    float lambda_dssim = 0.2f;

    // Learning rates of Adam; position is log-linear over the run and in units of the scene extent.
    // Position rates <= 0: 1.6e-4 to 1.6e-6, times haste(), without which short runs end before
    // positions settle (fox at 200 px, after 2,500 of 4,000: 27.95 dB with, 27.81 without).
    float position_lr_init = 0, position_lr_final = 0;
    // The three below 0: 0.005 and 0.001 times pace(), 0.05 times its root.
    float scale_lr = -1, rotation_lr = -1, opacity_lr = -1;
    float sh_dc_lr = 2.5e-3f;
    // Whether the rate of the other bands, a twentieth of it, is multiplied by 30,000 / iterations,
    // at most kMostHaste: they come late in a run. ARCHITECTURE has what that brings.
    bool sh_rest_hastens = true;
    // These bands make a step in every so many iterations, of their mean gradient, at the root of
    // as many times the rate: what Adam reads and writes for them is most of what it moves.
    int sh_rest_every = 1;
    // From this share of the run on, once density control is over, the mean of the splats is taken,
    // and the run ends with it; 1: never, as 3DGS. See iterate_average.h.
    double average_from = 0.85;
    // The position's rate falls for this share of the run and stays. Below 0: for the whole, as
    // 3DGS, but where a mean settles what large steps scatter; the noise of mcmc falls with it.
    double position_lr_falls = -1;
    // Over the second half the other rates fall to this share, log-linear. Below 0: not, as 3DGS,
    // where the run ends with a mean, else to 0.3.
    double final_lr_share = -1;

    // Whether runs of fewer than kPacedBelow iterations learn shapes and opacities, grow, and come
    // to their degrees of colour faster; see pace().
    bool paced = true;

    // Density control. What is not adc is set by use_strategy. Below 0: rounds after 500 iterations
    // and then every 100, over pace(), until half of the run, at most 15,000; mcmc: 5/6 of it, at
    // most 25,000.
    Strategy strategy = Strategy::adc;
    int densify_from = -1, densify_until = -1, densify_interval = -1;
    float densify_grad_threshold = 2e-4f;  // NDC units
    float clone_split_extent = 0.01f;      // share of the scene extent
    // 3DGS prunes below 0.005, at an opacity rate of 0.025. These two leave 59,192 rather than
    // 80,811 splats on fox at 200 px after 2,000 iterations, and 27.47 rather than 26.75 dB on
    // held-out views.
    float prune_opacity = 0.1f;
    // Pruning by size from the first opacity reset on, share of the scene extent; 0: none. 3DGS has
    // 0.1; what fills the holes stays as veils over other views: the shipped scene after 7,000
    // iterations, 29.0 dB with it, 31.9 without.
    float prune_extent = 0;
    int opacity_reset_interval = 3'000;
    // Whether opacities are reset where density control ends before the next reset, as 3DGS does:
    // nothing prunes what comes back then.
    bool late_resets = false;
    // Whether each round of density control ends with the splats in Morton order in memory.
    bool morton_order = false;
    std::uint32_t max_splats = std::numeric_limits<std::uint32_t>::max();
    std::uint64_t max_memory_bytes = 0;  // of device memory: growth stops before it; 0: no budget

    float noise_lr = 5e5f;    // mcmc: noise on positions, over the rate of positions
    float opacity_decay = 0;  // budget: share of its opacity that a splat loses in a round
    // The first iterations see smaller photos; see trainer/resolution_ramp.h.
    bool resolution_ramp = true;

    // Share of scene_reach beyond which no scale grows; 0: no limit. A splat that outgrows the
    // scene is a veil before cameras that no photo was taken from. Below 0: as scale_limit says.
    float largest_scale = -1;

    // Share of the way from a training camera to its nearest points within which splats fade, as
    // nothing stands there: between two cameras they would be veils; 0: none does.
    float clearance = 0.6f;

    // Regularisers of 3DGS-MCMC: weights of the mean opacity and of the mean scale (in scene
    // extents) in the loss. They take from splats what no photo holds up: a quarter fewer on
    // monstree at 200 px, at equal quality.
    float opacity_weight = 0.01f, scale_weight = 0.01f;

    // The lengths above and below are a Gaussian's. A kernel that covers less of the picture at the
    // same scale has them longer and learns its scales faster; one that covers more keeps them
    // (ARCHITECTURE has both measured). false: as they are, for every kernel.
    bool lengths_by_area = true;

    // Start.
    float initial_opacity = 0.1f;
    float initial_scale = 1;          // times the distance to the neighbours
    std::uint32_t random_points = 0;  // without a point cloud; 0: from the number of pixels

    /// An opacity reset leaves twice the opacity that is pruned, as 3DGS does, and at least 0.01,
    /// its value, or twice what is drawn at all: what is not seen never comes back.
    float opacity_reset_to() const {
        const auto seen = static_cast<float>(2 * accuracy.value(kAlphaCutoff));
        return std::clamp(2.0f * prune_opacity, std::max(0.01f, seen), 0.9f);
    }
    /// What multiplies every length.
    double length_scale() const {
        return lengths_by_area ? std::max(1.0, equal_area_scale(kernel, footprint)) : 1;
    }
    /// Unless given, 1 for kernels that cover less than a Gaussian, which gain from a limit, and
    /// none for the others: a Gaussian loses with one.
    float scale_limit() const {
        if (largest_scale >= 0) return largest_scale;
        return length_scale() > 1 ? 1.0f : 0.0f;
    }
    /// A run that is shorter than kPacedBelow is that run in fast motion, at most kMostPace times.
    float pace() const {
        const float times = float(kPacedBelow) / static_cast<float>(std::max(iterations, 1));
        return paced ? std::clamp(times, 1.0f, kMostPace) : 1.0f;
    }
    int degree_interval() const {
        if (sh_interval >= 0) return std::max(sh_interval, 1);
        return static_cast<int>(std::lround(1'000 / pace()));
    }
    float scale_rate() const {
        const float rate = scale_lr >= 0 ? scale_lr : 0.005f * pace();
        return length_scale() > 1 ? 1.5f * rate : rate;
    }
    float rotation_rate() const { return rotation_lr >= 0 ? rotation_lr : 0.001f * pace(); }
    /// The root of the pace: with the whole, fewer splats and less time, but 0.8 dB less.
    float opacity_rate() const { return opacity_lr >= 0 ? opacity_lr : 0.05f * std::sqrt(pace()); }
    /// Of what would not settle in a run shorter than the 30,000 iterations of 3DGS.
    float haste() const {
        return std::sqrt(std::max(1.0f, 30'000.0f / static_cast<float>(std::max(iterations, 1))));
    }
    /// Of steps of the mean of so many iterations.
    float sh_rest_rate(int every) const {
        float times = std::sqrt(static_cast<float>(every));
        if (sh_rest_hastens) times *= std::min(haste() * haste(), kMostHaste);
        return sh_dc_lr * std::min(1.0f, times / 20);
    }
    float position_lr_start() const {
        return position_lr_init > 0 ? position_lr_init : 1.6e-4f * haste();
    }
    float position_lr_end() const {
        return position_lr_final > 0 ? position_lr_final : 1.6e-6f * haste();
    }
    int densify_begin() const {
        return densify_from >= 0 ? densify_from : static_cast<int>(std::lround(500 / pace()));
    }
    int round_interval() const {
        if (densify_interval >= 0) return std::max(densify_interval, 1);
        return static_cast<int>(std::lround(100 / pace()));
    }
    int densify_end() const {
        if (densify_until >= 0) return std::min(densify_until, iterations);
        if (strategy == Strategy::mcmc) return std::min(iterations / 6 * 5, 25'000);
        return std::min(iterations / 2, 15'000);
    }
    /// The mean takes in what iterations beyond this one leave, where average_after() says so.
    int average_begin() const {
        return std::max(static_cast<int>(average_from * iterations), densify_end());
    }
    bool averages() const { return average_begin() < iterations; }
    double position_falls_for() const {
        if (position_lr_falls >= 0) return position_lr_falls;
        return averages() && strategy != Strategy::mcmc ? 0.35 : 1.0;
    }
    double last_share() const {
        if (final_lr_share > 0) return final_lr_share;
        return averages() ? 1.0 : 0.3;
    }
    bool average_after(int iteration) const {
        const int interval = std::clamp(iterations / 160, 1, 10);
        return iteration > average_begin() && (iterations - iteration) % interval == 0;
    }
    /// The last iteration of adc that ends with an opacity reset; 0: there is none.
    int last_opacity_reset() const {
        const int last = densify_end() - (late_resets ? 1 : opacity_reset_interval);
        return std::max(last, 0) / opacity_reset_interval * opacity_reset_interval;
    }
};

}  // namespace darb
