#include "tools/darb/train_flags.h"

#include "engine/core/error.h"
#include "tools/darb/effect_flags.h"
#include "trainer/strategy.h"

namespace darb {

namespace {

// Options of the field whose features are not there yet: an error that says so, never ignored.
void add_missing(CLI::App& command, const std::string& name, const std::string& feature) {
    command
        .add_option_function<std::string>(
            name,
            [name, feature](const std::string&) {
                throw Error(name, feature + " is not part of this version",
                            "Leave the option out.");
            },
            "not available yet")
        ->expected(0, 1)
        ->group("");
}

void add_data_flags(CLI::App& command, TrainFlags& f) {
    command.add_option(
        "dataset,-s,--source-path", f.dataset,
        "COLMAP project, folder with transforms.json, a .json file, or a folder of photos");
    command.add_option("-o,-m,--model-path,--output", f.run.output, "output folder");
    command.add_option("-i,--images", f.data.images_folder, "photo folder of a COLMAP project")
        ->capture_default_str();
    command.add_option("-r,--resolution", f.data.resolution,
                       "1, 2, 4, 8: divide the photos' size; above 8: their width in px; "
                       "default: as they are, at most 1,600 px wide");
    command.add_flag("--eval", f.data.hold_out,
                     "hold out every 8th view, or the source's own test views");
    command.add_flag("-w,--white-background", f.train.white_background,
                     "compare pictures over white, not black");
    command.add_flag("--random-background,!--fixed-background", f.train.random_background,
                     "train over another background colour each iteration (default), or over the "
                     "one that pictures are compared over");
    command.add_flag("--sequential", f.sequential,
                     "photos without cameras: match neighbours in name order only");
}

// Before every option that it changes: values are taken over in this order.
void add_schedule_flag(CLI::App& command, TrainFlags& f) {
    command
        .add_option_function<std::string>(
            "--schedule",
            [&f](const std::string& schedule) {
                f.schedule = schedule;
                if (schedule != "3dgs") return;
                use_3dgs_schedule(f.train);
                f.schedule_effects = "+sh,-exposure,-antialias";
            },
            "3dgs: its rates, limits, resets and background, no regularisers, harmonics by the "
            "iteration, whole photos, in runs of any length; options that are given beside it "
            "count")
        ->check(CLI::IsMember({"darb", "3dgs"}))
        ->default_str("darb");
}

void add_schedule_flags(CLI::App& command, TrainFlags& f) {
    TrainOptions& t = f.train;
    command.add_option("--iterations", t.iterations, "length of the run")
        ->capture_default_str()
        ->check(CLI::Range(1, 10'000'000));
    command.add_option("--test-iterations", f.run.test_iterations,
                       "evaluate after these (default 7000 30000 and the last)");
    command.add_option("--save-iterations", f.run.save_iterations,
                       "write a PLY after these (default 7000 30000 and the last)");
    command.add_option("--checkpoint-iterations", f.run.checkpoint_iterations,
                       "keep a checkpoint of its own after these");
    command
        .add_option("--checkpoint-interval", f.run.checkpoint_interval,
                    "refresh checkpoint.darb every so many iterations; 0: at the end only")
        ->capture_default_str()
        ->check(CLI::NonNegativeNumber);
    command.add_option("--start-checkpoint", f.start_checkpoint, "go on from this checkpoint");
    command.add_flag("--resume", f.resume, "go on from OUT/checkpoint.darb");
    command.add_option("--sh-degree", t.sh_degree, "highest degree of view-dependent colour")
        ->capture_default_str()
        ->check(CLI::Range(0, 3));
    command.add_option("--lambda-dssim", t.lambda_dssim, "weight of 1 - SSIM in the loss")
        ->capture_default_str()
        ->check(CLI::Range(0.0, 1.0));
}

}  // namespace

void add_train_flags(CLI::App& command, TrainFlags& f) {
    add_schedule_flag(command, f);
    add_data_flags(command, f);
    add_schedule_flags(command, f);
    add_rate_flags(command, f);
    add_density_flags(command, f);
    command
        .add_option(
            "--kernel", f.kernel,
            "gaussian, raised_cosine, half_cosine_squared, sinc, inverse_quadratic, cosine, "
            "squared_raised_cosine, inverse_multiquadric, parabolic")
        ->capture_default_str();
    command
        .add_option("--pulses", f.pulses,
                    "of raised_cosine and sinc: 2 or 3 keep rings that the paper's limit removes")
        ->capture_default_str()
        ->check(CLI::Range(1, KERNEL_MAX_PULSES));
    add_accuracy_flags(command, f.accuracy, true);
    command.add_flag("--morton-order", f.train.morton_order,
                     "after each round of density control, splats that are neighbours in the scene "
                     "become neighbours in memory");
    command.add_option("--seed", f.train.seed)->capture_default_str();
    command.add_option("--device", f.device, "number or part of a name, see `darb devices`");
    command.add_flag("--view", f.view, "follow the run in a window; closing it goes on training");
    command.add_flag("--report,!--no-report", f.run.report,
                     "write OUT/report.html at the end (default): curves, time by pass, pictures");
    command.add_flag("-q,--quiet", f.run.quiet, "no progress");
    command.add_flag("--deterministic", f.deterministic,
                     "accepted: every run on one device already repeats bit by bit");
    add_effects_flag(command, f.effects);
    add_lens_flag(command, f.data);
    add_training_effect_flags(command, f.antialiasing, f.train);
    add_missing(command, "--depths,-d", "depth supervision");
}

}  // namespace darb
