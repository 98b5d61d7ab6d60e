// The learning rates of `darb train` and the mean that a run ends with.
#include "tools/darb/train_flags.h"

namespace darb {

void add_rate_flags(CLI::App& command, TrainFlags& f) {
    TrainOptions& t = f.train;
    command
        .add_option("--position-lr-init", t.position_lr_init,
                    "default 1.6e-4, times sqrt(30000 / iterations) in shorter runs")
        ->check(CLI::PositiveNumber);
    command.add_option("--position-lr-final", t.position_lr_final, "default 1.6e-6, likewise")
        ->check(CLI::PositiveNumber);
    command
        .add_option("--scaling-lr", t.scale_lr,
                    "default 0.005, times 4000 / iterations (at most 5) in shorter runs; 1.5 times "
                    "with a kernel that covers less than a Gaussian, as raised_cosine")
        ->check(CLI::NonNegativeNumber);
    command.add_option("--rotation-lr", t.rotation_lr, "default 0.001, likewise")
        ->check(CLI::NonNegativeNumber);
    command.add_option("--opacity-lr", t.opacity_lr, "default 0.05, times the root of that")
        ->check(CLI::NonNegativeNumber);
    command
        .add_option("--position-lr-falls", t.position_lr_falls,
                    "share of the run for which it falls, and then stays; default 0.35 where the "
                    "run ends with a mean, 1 with mcmc and elsewhere, as 3DGS")
        ->check(CLI::Range(0.0, 1.0));
    command
        .add_option("--final-lr-share", t.final_lr_share,
                    "the other rates fall to it over the second half; default 1, as 3DGS, 0.3 "
                    "where the run does not end with a mean")
        ->check(CLI::Range(1e-6, 1.0));
    command
        .add_option("--average-from", t.average_from,
                    "share of the run from which on, after density control, the mean of the splats "
                    "is taken that it ends with; 1: none, as 3DGS")
        ->capture_default_str()
        ->check(CLI::Range(0.0, 1.0));
    command
        .add_option("--feature-lr", t.sh_dc_lr,
                    "of the first band; the others learn at a 20th, in short runs faster")
        ->capture_default_str()
        ->check(CLI::NonNegativeNumber);
}

}  // namespace darb
