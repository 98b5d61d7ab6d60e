// SPDX-License-Identifier: MIT
// TrainOptions: everything that decides a training run, as it was asked for. What is absent takes
// its default by the length of the run, the kernel and the strategy: Schedule has what comes of it.
#pragma once

#include <cstdint>
#include <limits>
#include <optional>

#include "engine/kernels/kernel_family.h"
#include "engine/plan/accuracy.h"
#include "engine/raster/forward_options.h"
#include "engine/scene/region.h"

#define DARB_STRATEGIES(ROW) \
    ROW(adc)                 \
    ROW(mcmc)                \
    ROW(budget)

namespace darb {

/// How the splats grow in number; see trainer/options/strategy.h.
enum class Strategy {
#define DARB_STRATEGY(name) name,
    DARB_STRATEGIES(DARB_STRATEGY)
#undef DARB_STRATEGY
};

constexpr std::uint32_t kAnyNumberOfSplats = std::numeric_limits<std::uint32_t>::max();

// What training starts from. automatic: the points of the data set; where it has none those of
// Dataset::start, and random ones where that is empty, too. dense: points that stereo finds on the
// surfaces (engine/stereo), beside those of the data set.
enum class StartPoints { automatic, points, dense, random };

struct TrainOptions {
    int iterations = 30'000;
    // The run ends itself where held-out photos gained nothing for so many iterations; 0: never.
    // Off by default, as a run whose length held-out photos decide is no longer measured by photos
    // that it knows nothing of.
    int end_without_gain = 0;
    std::uint64_t seed = 0;
    // Views a step, a power of two: their gradients are added by a binary tree over the views'
    // places in the batch, then the optimizer makes one step of their mean. Iterations count views.
    int batch = 1;

    int kernel = KERNEL_GAUSSIAN;
    Footprint footprint = Footprint::psi;
    Accuracy accuracy;  // footprint and SH degree aside: they are the two here
    int sh_degree = 3;
    std::optional<int>
        sh_interval;  // iterations to the next degree; absent: 1,000 over Schedule::speedup
    // false: a degree is added at each interval. true: the first only where a probe on training
    // photos set aside gains, tried again after as many iterations as before. The others follow:
    // probes of a few iterations refuse them wrongly, and without these degrees the shipped scene
    // has 31.62 dB after 4,000, with them 32.20.
    bool probe_sh = false;
    // With refined cameras: shutters that roll are trained where a probe on training photos set
    // aside gains. ProjectionEffects::shutter trains them from the start.
    bool probe_shutter = false;
    bool antialias = false;  // opacity compensation and the 3D smoothing filter of Mip-Splatting
    bool exposure = false;   // an affine map of colours per photo, trained beside the splats
    bool exposure_grid = false;  // with exposure: a bilateral grid of maps per photo in its place
    float exposure_lr_init = 0.001f, exposure_lr_final = 0.0001f;
    // Rendered depths are compared with those that were measured: see depth_loss.h.
    bool depth = false;
    float depth_weight = 0.1f;
    // Terms of the loss that lay splats on surfaces: the distortion of DepthLoss, and the
    // regulariser of the smallest scales.
    bool surface = false;
    float surface_from = 0.5f;        // share of the run before these terms count
    float distortion_weight = 0.03f;  // of splats of a pixel that lie apart along its ray
    float flatness_weight = 0;        // of the mean of smallest scales, scene extents
    // Poses and intrinsics of the photos are trained beside the splats: see camera_refinement.h.
    bool refine_cameras = false;
    // px a visit, falling to a fiftieth over the run; absent: 0.1 where tracks anchor them, else
    // 0.5.
    std::optional<float> camera_lr;
    float camera_from = 0.1f;      // share of the run before the first step
    float camera_anchor = 0.01f;   // weight of half the squared reprojection of tracks, px^2
    ProjectionEffects projection;  // but for its antialias and smoothing, which are antialias
    bool alpha = true;             // false: every photo is opaque, its alpha is not read
    HugeSplatPath huge_splat_path = HugeSplatPath::by_counters;
    bool white_background = false;  // what pictures are compared over; black otherwise
    bool random_background = true;  // train over another colour each iteration: no surface can
                                    // stay half transparent to borrow the background's colour
    // Weight of 1 - SSIM in the loss. Absent: resolve() takes 0.3 for photos of 0.4
    // megapixels or more, which gain by it (docs/experiments/real_scale.md); else it is 0.2.
    std::optional<float> lambda_dssim;
    float dssim_weight() const { return lambda_dssim.value_or(0.2f); }

    // Where splats grow in number; absent: everywhere. Those outside are trained and pruned, but
    // not cloned, split or drawn as places for others, so that they stay as coarse as they began.
    std::optional<Region> region;

    // Learning rates of Adam; position is log-linear over the run and in units of the scene extent.
    // Absent: 1.6e-4 to 1.6e-6, higher by the root of 30,000 / iterations, without which short runs
    // end before positions settle (fox at 200 px, after 2,500 of 4,000: 27.95 dB with, 27.81
    // without); 0.005 and 0.001 times Schedule::speedup, 0.05 times its root.
    std::optional<float> position_lr_init, position_lr_final;
    std::optional<float> scale_lr, rotation_lr, opacity_lr;
    float sh_dc_lr = 2.5e-3f;
    // The rate of a kernel with shapes; absent: 0.004 times Schedule::speedup
    // (docs/experiments/learned_shapes.md).
    std::optional<float> shape_lr;
    // How often the profile of the kernel changes over the run, which starts from `kernel`; 0: it
    // stays. See engine/kernels/learned_profile.h.
    int learn_kernel = 0;
    float kernel_lr = 0.4f;  // how far such a change moves what the profile is made of
    // Whether the rate of the other bands, a twentieth of it, is multiplied by 30,000 / iterations,
    // at most 10: they come late in a run. docs/experiments/harmonics.md has what that brings.
    bool speed_up_sh_rest = true;
    // These bands make a step in every so many iterations, of their mean gradient, at the root of
    // as many times the rate: what Adam reads and writes for them is most of what it moves.
    int sh_rest_every = 1;
    // From this share of the run on, once density control is over, the mean of the splats is taken,
    // and the run ends with it; 1: never, as 3DGS. See optimizer.h.
    double average_from = 0.85;
    // The position's rate falls for this share of the run and stays. Absent: for the whole, as
    // 3DGS, but where a mean settles what large steps scatter.
    std::optional<double> position_lr_falls;
    // Over the second half the other rates fall to this share, log-linear. Absent: not, as 3DGS,
    // where the run ends with a mean, else to 0.3.
    std::optional<double> final_lr_share;

    // Whether runs of fewer than 4,000 iterations learn shapes and opacities, grow, and come to
    // their degrees of colour faster; see Schedule::speedup.
    bool speed_up_short_runs = true;

    // Density control. Absent: rounds after 500 iterations and then every 100, over
    // Schedule::speedup, until the part of the run that the strategy has.
    Strategy strategy{};  // the first of the table
    std::optional<int> densify_from, densify_until, densify_interval;
    float densify_grad_threshold = 2e-4f;  // NDC units
    float clone_split_extent = 0.01f;      // share of the scene extent
    // Absent, here and below: as the strategy has it, see StrategyDefaults.
    std::optional<float> prune_opacity;
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
    std::optional<std::uint32_t> max_splats;        // absent: any number
    std::optional<std::uint64_t> max_memory_bytes;  // device memory: growth stops before this

    float noise_lr = 5e5f;  // mcmc: noise on positions, over the rate of positions
    // The first iterations see smaller photos; see trainer/step/photos.h.
    bool resolution_ramp = true;

    // Share of scene_reach beyond which no scale grows; 0: no limit. A splat that outgrows the
    // scene is a veil before cameras that no photo was taken from. Absent: 1 for kernels that cover
    // less than a Gaussian, which gain from a limit, and none for the others.
    std::optional<float> largest_scale;

    // Share of the way from a training camera to its nearest points within which splats fade, as
    // nothing stands there: between two cameras they would be veils; 0: none does.
    float clearance = 0.6f;

    // Regularisers of 3DGS-MCMC: weights of the mean opacity and of the mean scale (in scene
    // extents) in the loss. They take from splats what no photo holds up: a quarter fewer on
    // monstree at 200 px, at equal quality.
    float opacity_weight = 0.01f, scale_weight = 0.01f;

    // The lengths above and below are a Gaussian's. A kernel that covers less of the picture at the
    // same scale has them longer and learns its scales faster; one that covers more keeps them
    // (docs/experiments/kernel_lengths.md has both). false: as they are, for every kernel.
    bool lengths_by_area = true;

    // Start.
    StartPoints start = StartPoints::automatic;
    std::optional<float> initial_opacity;
    std::optional<float> initial_scale;          // times the distance to the neighbours
    std::optional<std::uint32_t> random_points;  // without a point cloud; absent: from the pixels
};

}  // namespace darb
