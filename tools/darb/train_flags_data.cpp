// The options of `darb train` that say what it trains on and how long.
#include <fmt/format.h>

#include "engine/core/error.h"
#include "tools/darb/effect_flags.h"
#include "tools/darb/evaluation_flags.h"
#include "tools/darb/help.h"
#include "tools/darb/train_flags.h"
#include "trainer/options/presets.h"

namespace darb {

namespace {

// Before what it sets, as well.
void add_preset_flag(CLI::App& command, TrainFlags& f) {
    std::string help;
    for (const RunPreset& preset : kRunPresets)
        help +=
            fmt::format("{}{}: {}, {} iterations, photos of up to {} px", help.empty() ? "" : "; ",
                        preset.name, preset.summary, preset.iterations, preset.width);
    command
        .add_option_function<std::string>(
            "--preset",
            [&f](const std::string& name) {
                const RunPreset* preset = run_preset(name);
                if (preset == nullptr)
                    throw Error("--preset " + name, "no such preset", "Use preview, good or full.");
                f.request.preset = name;
                f.request.train.iterations = preset->iterations;
                f.request.data.resolution = preset->width;
            },
            help + "; --iterations and -r count beside it")
        ->type_name("TEXT:{preview,good,full}")
        ->group(option_group::kRun);
}

}  // namespace

void add_data_flags(CLI::App& command, TrainFlags& f) {
    add_preset_flag(command, f);
    command
        .add_option("dataset,-s,--source-path", f.request.dataset,
                    "COLMAP project, folder with transforms.json, a .json file, a folder of "
                    "photos, or a video")
        ->group(help_group::kInput);
    command.add_option("-o,--output,-m,--model-path", f.request.output, "output folder")
        ->group(help_group::kInput);
    command
        .add_option("-r,--resolution", f.request.data.resolution,
                    "1, 2, 4, 8: divide the photos' size; above 8: their width in px; default: as "
                    "they are, at most 1,600 px wide")
        ->group(help_group::kInput);
    command
        .add_flag("--eval", f.request.data.hold_out,
                  "hold out every 8th view, or the source's own test views")
        ->group(help_group::kInput);
    add_hold_out_flag(command, f.request.data)->group(help_group::kInput);
    command
        .add_option("-i,--images", f.request.data.images_folder, "photo folder of a COLMAP project")
        ->capture_default_str()
        ->group(option_group::kPhotos);
    command
        .add_flag("--sequential", f.request.sequential,
                  "photos without cameras: match neighbours in name order only; --preset preview "
                  "does so by itself where more than 40 photos follow each other")
        ->group(option_group::kPhotos);
    command
        .add_option("--frames", f.request.frames,
                    "of a video: so many pictures, the sharpest of as many intervals [two a second "
                    "of 30, 60 to 240]")
        ->check(CLI::Range(3, 2'000))
        ->group(option_group::kPhotos);
    add_lens_flag(command, f.request.data);
    command.get_option("--lens")->group(option_group::kPhotos);
    add_depth_scale_flag(command, f.request.data)->group(option_group::kPhotos);
}

}  // namespace darb
