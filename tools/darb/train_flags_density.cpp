// How splats grow and go: the flags of density control and of the regularisers.
#include "tools/darb/train_flags.h"

namespace darb {

void add_density_flags(CLI::App& command, TrainOptions& t) {
    command.add_option("--densify-grad-threshold", t.densify_grad_threshold)
        ->capture_default_str()
        ->check(CLI::PositiveNumber);
    command.add_option("--densification-interval", t.densify_interval)
        ->capture_default_str()
        ->check(CLI::PositiveNumber);
    command.add_option("--densify-from-iter", t.densify_from)
        ->capture_default_str()
        ->check(CLI::NonNegativeNumber);
    command.add_option("--densify-until-iter", t.densify_until,
                       "default: half of the run, at most 15,000");
    command.add_option("--opacity-reset-interval", t.opacity_reset_interval)
        ->capture_default_str()
        ->check(CLI::PositiveNumber);
    command
        .add_option("--percent-dense", t.clone_split_extent,
                    "share of the scene extent above which a splat splits rather than clones")
        ->capture_default_str()
        ->check(CLI::PositiveNumber);
    command.add_option("--prune-opacity", t.prune_opacity, "splats below this opacity go")
        ->capture_default_str()
        ->check(CLI::Range(0.0, 1.0));
    command.add_option("--opacity-reg", t.opacity_weight, "weight of the mean opacity in the loss")
        ->capture_default_str()
        ->check(CLI::NonNegativeNumber);
    command
        .add_option("--scale-reg", t.scale_weight,
                    "weight of the mean scale, in scene extents, in the loss")
        ->capture_default_str()
        ->check(CLI::NonNegativeNumber);
    command
        .add_option("--cap-max,--max-splats,--budget", t.max_splats,
                    "growth stops at this many splats")
        ->check(CLI::PositiveNumber);
    command
        .add_option("--max-memory", t.max_memory_bytes,
                    "budget of device memory, as 2GB or 800MB: growth stops before it")
        ->transform(CLI::AsSizeValue(true));
    command.add_option("--random-points", t.random_points,
                       "splats to start from where the data set has no points");
}

}  // namespace darb
