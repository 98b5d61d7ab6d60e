// How splats grow and go: the flags of the strategies, of density control and of the regularisers.
#include <fmt/format.h>

#include "engine/core/error.h"
#include "tools/darb/train_flags.h"
#include "trainer/strategy.h"

namespace darb {

namespace {

/// Keeps the option for these strategies: finish_strategy refuses it with another.
CLI::Option* only_with(const std::string& strategies, CLI::Option* option, TrainFlags& f) {
    return option->each([&f, strategies, name = option->get_name()](const std::string&) {
        f.of_strategies.emplace_back(name, strategies);
    });
}

void add_strategy_flags(CLI::App& command, TrainFlags& f) {
    TrainOptions& t = f.train;
    command
        .add_option("--strategy", f.strategy,
                    "how the splats grow: adc (by the screen gradient, as 3DGS), mcmc (dead splats "
                    "move onto live ones, with noise) or budget (to a fixed count, where the error "
                    "is)")
        ->capture_default_str();
    command
        .add_option(
            "--cap-max,--max-splats,--budget", t.max_splats,
            "growth stops at this many splats; mcmc and budget grow up to it, by default to "
            "what adc is forecast to end with")
        ->check(CLI::PositiveNumber);
    only_with("mcmc", command.add_option("--noise-lr", t.noise_lr, "of the noise on positions"), f)
        ->capture_default_str()
        ->check(CLI::NonNegativeNumber);
    only_with(
        "budget",
        command.add_option("--opacity-decay", t.opacity_decay,
                           "share of its opacity that a splat loses in a round (default 0.01)"),
        f)
        ->check(CLI::Range(0.0, 0.99));
    command
        .add_option("--resolution-ramp", f.resolution_ramp,
                    "on: the first tenth of the run sees photos of a quarter of their sides, the "
                    "next fifth of half, their longest side never below 100 px (default: on; with "
                    "--schedule 3dgs off)")
        ->check(CLI::IsMember({"on", "off"}));
    command
        .add_option("--sh-rest-every", t.sh_rest_every,
                    "harmonics above the first band make a step in every so many iterations, of "
                    "the mean gradient of these; default: 1, with budget 16")
        ->check(CLI::Range(1, 1'000));
}

}  // namespace

void add_density_flags(CLI::App& command, TrainFlags& f) {
    TrainOptions& t = f.train;
    add_strategy_flags(command, f);
    only_with("adc", command.add_option("--densify-grad-threshold", t.densify_grad_threshold), f)
        ->capture_default_str()
        ->check(CLI::PositiveNumber);
    command
        .add_option("--densification-interval", t.densify_interval,
                    "default 100; fewer in runs below 4,000 iterations, down to 20")
        ->check(CLI::PositiveNumber);
    command
        .add_option("--densify-from-iter", t.densify_from,
                    "default 500; sooner in runs below 4,000 iterations, down to 100")
        ->check(CLI::NonNegativeNumber);
    command
        .add_option("--densify-until-iter", t.densify_until,
                    "default: half of the run, at most 15,000; mcmc: 5/6 of it, at most 25,000")
        ->check(CLI::NonNegativeNumber);
    only_with("adc",
              command.add_option("--opacity-reset-interval", t.opacity_reset_interval,
                                 "none where density control ends before the next one would come"),
              f)
        ->capture_default_str()
        ->check(CLI::PositiveNumber);
    only_with("adc budget",
              command.add_option(
                  "--percent-dense", t.clone_split_extent,
                  "share of the scene extent above which a splat splits rather than clones; longer "
                  "with a kernel that covers less than a Gaussian (1.28 times with raised_cosine)"),
              f)
        ->capture_default_str()
        ->check(CLI::PositiveNumber);
    command
        .add_option("--prune-opacity", t.prune_opacity,
                    "splats below this opacity go, with mcmc elsewhere (default 0.1; mcmc 0.005)")
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
        .add_option(
            "--largest-scale", t.largest_scale,
            "in scene extents, or in half distances to the points where these are more, times what "
            "the kernel's lengths are longer than a Gaussian's (raised_cosine: 1.28): no splat "
            "grows beyond it; 0: no limit (default 1 with a kernel that covers less than a "
            "Gaussian, as raised_cosine, else 0)")
        ->check(CLI::NonNegativeNumber);
    command
        .add_option("--clearance", t.clearance,
                    "share of the way from a training camera to its nearest points within which "
                    "splats fade; 0: none does")
        ->capture_default_str()
        ->check(CLI::Range(0.0, 1.0));
    command
        .add_option("--max-memory", t.max_memory_bytes,
                    "budget of device memory, as 2GB or 800MB: growth stops before it")
        ->transform(CLI::AsSizeValue(true));
    command.add_option("--random-points", t.random_points,
                       "splats to start from where the data set has no points");
}

void finish_strategy(TrainFlags& f) {
    const auto strategy = strategy_from_name(f.strategy);
    if (!strategy)
        throw Error("--strategy " + f.strategy, "no such strategy",
                    fmt::format("Use {}.", strategy_names()));
    if (f.schedule == "3dgs" && !strategy_row(*strategy).follows_3dgs)
        throw Error("--schedule 3dgs", fmt::format("means nothing with --strategy {}", f.strategy),
                    "Leave one of the two out.");
    f.train.strategy = *strategy;
    for (const auto& [name, strategies] : f.of_strategies)
        if (strategies.find(f.strategy) == std::string::npos)
            throw Error(name, fmt::format("means nothing with --strategy {}", f.strategy),
                        fmt::format("Leave it out; it goes with --strategy {}.", strategies));
    if (!f.resolution_ramp.empty()) f.train.resolution_ramp = f.resolution_ramp == "on";
}

}  // namespace darb
