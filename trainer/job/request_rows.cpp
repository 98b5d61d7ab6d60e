// SPDX-License-Identifier: MIT
// The rows of request_options.h, in the order of `darb train --help-all`.
#include <fmt/format.h>

#include <array>

#include "engine/core/error.h"
#include "engine/core/text.h"
#include "engine/kernels/kernel_definition.h"
#include "engine/plan/effect_plan.h"
#include "engine/render/cleaning.h"
#include "engine/scene/region.h"
#include "trainer/job/request_options.h"
#include "trainer/options/presets.h"
#include "trainer/options/strategy.h"
#include "trainer/run/run_folder.h"

namespace darb {

namespace {

namespace fs = std::filesystem;
using Rows = std::vector<RequestOption>;
using Request = TrainRequest;
using Text = const std::string&;

constexpr const char* kStarts[] = {"auto", "points", "dense", "random"};  // indexed by StartPoints

const char* lens_of(const DatasetOptions& data) {
    return data.original_lens ? "original" : data.original_where_wide ? "auto" : "undistort";
}

void take_lens(Request& r, Text text) {
    if (text != "auto" && text != "undistort" && text != "original")
        throw Error("--lens " + text, "is none of auto, undistort and original",
                    "Use one of these.");
    r.data.original_lens = text == "original";
    r.data.original_where_wide = text == "auto";
}

void take_preset(Request& r, Text text) {
    const RunPreset* preset = run_preset(text);
    if (preset == nullptr)
        throw Error("--preset " + text, "no such preset", "Use preview, good or full.");
    r.preset = text;
    r.train.iterations = preset->iterations;
    r.data.resolution = preset->width;
}

void take_start(Request& r, Text text) {
    for (int i = 0; i < int(std::size(kStarts)); ++i)
        if (lower(text) == kStarts[i]) {
            r.train.start = static_cast<StartPoints>(i);
            return;
        }
    throw Error("--start " + text, "is none of auto, points, dense, random", "Use one of these.");
}

void take_strategy(Request& r, Text text) {
    const auto strategy = strategy_from_name(text);
    if (!strategy)
        throw Error("--strategy " + text, "no such strategy",
                    fmt::format("Use {}.", strategy_names()));
    r.train.strategy = *strategy;
}

void take_pulses(Request& r, Text text) {
    const OptionRow& row = request_option("--pulses").row;
    const int pulses = option_whole(row, text), kernel = r.train.kernel;
    const auto with = kernel_with_pulses(kernel, pulses);
    if (!with)
        throw Error(fmt::format("--kernel {} --pulses {}", kernel_name(kernel), pulses),
                    "there is no such kernel",
                    "Only raised_cosine and sinc have --pulses 2 or 3; others have one.");
    r.train.kernel = *with;
}

// The footprint that the accuracy settings ask for.
void follow_accuracy(Request& r) {
    r.train.footprint =
        r.train.accuracy.value(kFootprint) == FOOTPRINT_EXACT ? Footprint::exact : Footprint::psi;
}

void take_accuracy(Request& r, Text text) {
    r.train.accuracy = preset_accuracy(preset_of_option(text), true);
    follow_accuracy(r);
}

std::string path_in_file(const Request& r, const fs::path& path) {
    return path.empty() ? std::string() : seen_from(r.output, path).generic_string();
}

fs::path path_of_file(const Request& r, Text text) {
    return text.empty() ? fs::path() : fs::weakly_canonical(r.output / text);
}

// What the photos' folder is called beside a data set that moves with the run.
std::string shared_images(const Request& r) {
    const fs::path images = r.data.images_folder;
    return (images.is_absolute() ? seen_from(r.dataset, images) : images).generic_string();
}

std::string preset_help() {
    std::string help;
    for (const RunPreset& preset : kRunPresets)
        help += fmt::format("{}{}: {}, {} iterations at up to {} px", help.empty() ? "" : "; ",
                            preset.name, preset.summary, preset.iterations, preset.width);
    return help + "; --iterations and -r overrule it";
}

std::string strategy_help() {
    std::string strategies;
    for (const Strategy strategy : all_strategies())
        strategies += fmt::format("{}{} ({})", strategies.empty() ? "" : "; ",
                                  strategy_name(strategy), strategy_row(strategy).summary);
    return "how the splats grow: " + strategies;
}

// What changes many others at once.
void whole_rows(Rows& rows) {
    static const std::string presets = preset_help();
    rows.push_back({.row = {.flags = "--schedule",
                            .group = option_group::kRates,
                            .help = "3dgs: the rates, limits, resets and background of 3DGS, no "
                                    "regularisers, harmonics by the iteration, whole photos, in "
                                    "runs of any length; options given beside it overrule it",
                            .usual = "darb"},
                    .words = "darb,3dgs",
                    .key = "schedule",
                    .place = [](Request& r) -> RequestPlace { return &r.schedule; },
                    .take = [](Request& r, Text text) { use_schedule(r, text); }});
    rows.push_back({.row = {.flags = "--preset", .help = presets.c_str()},
                    .words = "preview,good,full",
                    .key = "preset",
                    .place = [](Request& r) -> RequestPlace { return &r.preset; },
                    .take = take_preset});
}

void place_rows(Rows& rows) {
    rows.push_back({.row = {.flags = "dataset,-s,--source-path",
                            .group = option_group::kInput,
                            .help = "COLMAP project, folder with transforms.json, a .json file, a "
                                    "folder of photos, or a video"},
                    .section = "data",
                    .key = "dataset",
                    .place = [](Request& r) -> RequestPlace { return &r.dataset; },
                    .saved = [](const Request& r) { return path_in_file(r, r.dataset); },
                    .restore =
                        [](Request& r, Text text) {
                            if (text.empty()) throw Error("", "names no data set", "");
                            r.dataset = path_of_file(r, text).string();
                        }});
    rows.push_back({.row = {.flags = "-o,--output,-m,--model-path",
                            .group = option_group::kInput,
                            .help = "output folder"},
                    .place = [](Request& r) -> RequestPlace { return &r.output; }});
    rows.push_back({.row = {.flags = "-r,--resolution",
                            .group = option_group::kInput,
                            .help = "1, 2, 4, 8: divide the photos' size; above 8: their width in "
                                    "px; default: as they are, at most 1,600 px wide",
                            .least = -1,
                            .most = 1e9},
                    .section = "data",
                    .key = "resolution",
                    .place = [](Request& r) -> RequestPlace { return &r.data.resolution; }});
    rows.push_back({.row = {.flags = "--eval",
                            .group = option_group::kInput,
                            .help = "hold out every 8th view, or the source's own test views",
                            .is_switch = true},
                    .section = "data",
                    .key = "eval",
                    .place = [](Request& r) -> RequestPlace { return &r.data.hold_out; }});
    rows.push_back(
        {.row = {.flags = "--hold-out",
                 .group = option_group::kInput,
                 .help = "which views: every:N, arc:N of the way around, or both",
                 .usual = "every:8"},
         .section = "data",
         .key = "hold_out",
         .take =
             [](Request& r, Text text) {
                 r.data.held_out = parse_hold_out(text);
                 r.data.hold_out = true;
             },
         .saved = [](const Request& r) { return hold_out_text(r.data.held_out); },
         .restore = [](Request& r, Text text) { r.data.held_out = parse_hold_out(text); }});
}

void photo_rows(Rows& rows) {
    rows.push_back({.row = {.flags = "-i,--images",
                            .group = option_group::kPhotos,
                            .help = "photo folder of a COLMAP project",
                            .usual = "images"},
                    .section = "data",
                    .key = "images",
                    .place = [](Request& r) -> RequestPlace { return &r.data.images_folder; },
                    .saved = shared_images});
    rows.push_back(
        {.row =
             {.flags = "--sequential",
              .group = option_group::kPhotos,
              .help =
                  "photos without cameras: match only neighbours in the order of names; --preset "
                  "preview does so by itself where more than 40 photos follow each other",
              .is_switch = true},
         .section = "data",
         .key = "sequential",
         .place = [](Request& r) -> RequestPlace { return &r.sequential; }});
    rows.push_back({.row = {.flags = "--panoramas",
                            .group = option_group::kPhotos,
                            .help = "photos or a video without cameras: whether they are "
                                    "equirectangular panoramas of a 360-degree camera; auto: as "
                                    "their metadata says",
                            .usual = "auto"},
                    .words = "auto,on,off",
                    .section = "data",
                    .key = "panoramas",
                    .place = [](Request& r) -> RequestPlace { return &r.panoramas; }});
    rows.push_back(
        {.row = {.flags = "--frames",
                 .group = option_group::kPhotos,
                 .help = "take this many pictures from a video, the sharpest of as many intervals",
                 .usual = "about two a second, 60 to 240 in all",
                 .least = 3,
                 .most = 2'000},
         .section = "data",
         .key = "frames",
         .place = [](Request& r) -> RequestPlace { return &r.frames; }});
    rows.push_back({.row = {.flags = "--lens",
                            .group = option_group::kPhotos,
                            .help = "undistort: straight pictures; original: distorted as the "
                                    "photos are; auto: original for a fisheye that sees more than "
                                    "60 degrees to a side, straight for all others",
                            .usual = "auto"},
                    .words = "auto,undistort,original",
                    .section = "data",
                    .key = "lens",
                    .take = take_lens,
                    .saved = [](const Request& r) -> std::string { return lens_of(r.data); }});
    rows.push_back({.row = {.flags = "--depth-scale",
                            .group = option_group::kPhotos,
                            .help = "world units per metre in depths/ and depth/ beside the photos",
                            .usual = "from the points that photos saw, else 1",
                            .least = 1e-9,
                            .most = 1e9},
                    .section = "data",
                    .key = "depth_scale",
                    .place = [](Request& r) -> RequestPlace { return &r.data.depth_scale; }});
}

void run_rows(Rows& rows) {
    rows.push_back({.row = {.flags = "--resume",
                            .help = "continue from OUT/checkpoint.darb",
                            .is_switch = true},
                    .place = [](Request& r) -> RequestPlace { return &r.resume; }});
    rows.push_back({.row = {.flags = "--allow-mixed",
                            .group = option_group::kDevice,
                            .help = "let ranks of mpirun have different devices and drivers, on "
                                    "which the result then depends",
                            .is_switch = true},
                    .key = "allow_mixed",
                    .place = [](Request& r) -> RequestPlace { return &r.allow_mixed; }});
    rows.push_back({.row = {.flags = "--tune",
                            .group = option_group::kDevice,
                            .help = "run passes in these ways, such as "
                                    "blend=128x2,backward=buckets; an unknown name lists those of "
                                    "the device"},
                    .key = "tune",
                    .place = [](Request& r) -> RequestPlace { return &r.tune; }});
    rows.push_back(
        {.row = {.flags = "--device", .help = "number or part of a name, see `darb devices`"},
         .key = "device",
         .place = [](Request& r) -> RequestPlace { return &r.device; }});
}

void scene_rows(Rows& rows) {
    static const std::string kernels =
        kernel_names() +
        " (each splat learns its shape), or one of your own: \"expr: (1 - q/9)^3, support 9\"";
    static const std::string strategies = strategy_help(), first(strategy_name(Strategy{}));
    rows.push_back(
        {.row = {.flags = "--kernel",
                 .group = option_group::kScene,
                 .help = kernels.c_str(),
                 .usual = "gaussian"},
         .key = "kernel",
         .take = [](Request& r, Text text) { r.train.kernel = kernel_of_option(text, r.notes); },
         .saved = [](const Request& r) { return std::string(kernel_name(r.train.kernel)); }});
    rows.push_back({.row = {.flags = "--kernel-file",
                            .group = option_group::kScene,
                            .help = "JSON with kernels of your own, by expression or table "
                                    "(docs/kernels.md)"},
                    .several = true,
                    .before_others = true,
                    .take = [](Request& r, Text text) {
                        for (const int kernel : kernels_of_file(text, r.notes))
                            r.train.kernel = kernel;
                    }});
    rows.push_back(
        {.row = {.flags = "--strategy",
                 .group = option_group::kScene,
                 .help = strategies.c_str(),
                 .usual = first.c_str()},
         .key = "strategy",
         .take = take_strategy,
         .saved = [](const Request& r) { return std::string(strategy_name(r.train.strategy)); }});
    rows.push_back({.row = {.flags = "--points",
                            .group = option_group::kStart,
                            .help = "a PLY or LAS file of points, in the coordinates of the "
                                    "cameras, to start from in place of the data set's",
                            .usual = "the data set's"},
                    .section = "data",
                    .key = "points",
                    .place = [](Request& r) -> RequestPlace { return &r.points; },
                    .saved = [](const Request& r) { return path_in_file(r, r.points); },
                    .restore = [](Request& r, Text text) { r.points = path_of_file(r, text); }});
    rows.push_back(
        {.row = {.flags = "--start",
                 .group = option_group::kStart,
                 .help = "what splats start from; dense: surfaces found by stereo between the "
                         "photos; auto: the data set's points, else dense, else random",
                 .usual = "auto"},
         .words = "auto,points,dense,random",
         .key = "start",
         .take = take_start,
         .saved = [](const Request& r) -> std::string {
             return kStarts[static_cast<int>(r.train.start)];
         }});
}

void region_rows(Rows& rows) {
    static const std::string region =
        std::string("train this part of the scene: splats outside it do not grow in number. ") +
        kRegionHelp;
    rows.push_back({.row = {.flags = "--roi",
                            .group = option_group::kRegion,
                            .help = region.c_str(),
                            .usual = "the whole scene"},
                    .key = "roi",
                    .place = [](Request& r) -> RequestPlace { return &r.region; },
                    .take =
                        [](Request& r, Text text) {
                            check_region("--roi", text);
                            r.region = text;
                        }});
    rows.push_back({.row = {.flags = "--drop-outside",
                            .group = option_group::kRegion,
                            .help = "with --roi: leave splats outside of it out of the scene that "
                                    "is saved at the end",
                            .is_switch = true},
                    .key = "drop_outside",
                    .place = [](Request& r) -> RequestPlace { return &r.drop_outside; }});
    rows.push_back({.row = {.flags = "--clean-isolated",
                            .group = option_group::kRegion,
                            .help = "leave parts that touch nothing else out of the scene that is "
                                    "saved at the end, as `darb clean --isolated` does; 0.01 is a "
                                    "usual share",
                            .usual = "off",
                            .least = 0,
                            .most = 1},
                    .key = "clean_isolated",
                    .place = [](Request& r) -> RequestPlace { return &r.clean_isolated; }});
    rows.push_back({.row = {.flags = "--clean-haze",
                            .group = option_group::kRegion,
                            .help = "OPACITY,SIZE, such as 0.1,5: the same for haze, as `darb "
                                    "clean --haze` does",
                            .usual = "off"},
                    .key = "clean_haze",
                    .place = [](Request& r) -> RequestPlace { return &r.clean_haze; },
                    .take =
                        [](Request& r, Text text) {
                            CleaningRules checked;
                            take_haze("--clean-haze", text, checked);
                            r.clean_haze = text;
                        }});
    rows.push_back({.row = {.flags = "--clean-free-space",
                            .group = option_group::kRegion,
                            .help = "a number of views, such as 3: the same for what floats in "
                                    "free space, as `darb clean --free-space` does",
                            .usual = "off",
                            .least = 1,
                            .most = 1000},
                    .key = "clean_free_space",
                    .place = [](Request& r) -> RequestPlace { return &r.clean_free_space; }});
}

void effect_rows(Rows& rows) {
    rows.push_back(
        {.row = {.flags = "--effects",
                 .group = option_group::kScene,
                 .help = "auto: what the scene calls for, see `darb plan`; all; none; "
                         "or changes to one of them, auto where none is named: "
                         "+exposure,-sh or all,-lens",
                 .usual = "auto"},
         .key = "effects",
         .place = [](Request& r) -> RequestPlace { return &r.effects; },
         .take = [](Request& r, Text text) { r.effects = effects_beside(r.effects, text); }});
    rows.push_back({.row = {.flags = "--antialiasing",
                            .group = option_group::kEffects,
                            .help = "the same as --effects +antialias",
                            .is_switch = true},
                    .key = "antialiasing",
                    .place = [](Request& r) -> RequestPlace { return &r.antialiasing; }});
    rows.push_back({.row = {.flags = "-d,--depths",
                            .group = option_group::kEffects,
                            .help = "the same as --effects +depth; FOLDER: where the measured "
                                    "depths are, otherwise depths or depth in the data set"},
                    .place = [](Request& r) -> RequestPlace { return &r.depths; }});
    rows.push_back({.row = {.flags = "--refine-cameras",
                            .group = option_group::kEffects,
                            .help = "train poses and intrinsics along with the splats, as "
                                    "--effects +cameras does; auto: as planned, which is off",
                            .usual = "auto"},
                    .words = "auto,on,off",
                    .key = "refine_cameras",
                    .place = [](Request& r) -> RequestPlace { return &r.refine_cameras; }});
    rows.push_back({.row = {.flags = "--blocks",
                            .group = option_group::kScene,
                            .help = "train a scene too large for memory in parts"},
                    .words = "auto,NxM",
                    .key = "blocks",
                    .place = [](Request& r) -> RequestPlace { return &r.blocks; }});
}

// A row of the table of engine/plan. In training the degree of colour is an option of its own.
RequestOption accuracy_row(int setting) {
    static std::array<std::string, kAccuracyCount> flags, helps;
    const AccuracySetting& of = accuracy_settings()[static_cast<std::size_t>(setting)];
    std::string& help = helps[static_cast<std::size_t>(setting)];
    std::string& flag = flags[static_cast<std::size_t>(setting)];
    help = accuracy_help(of);
    if (setting != kShDegree) flag = accuracy_flag(of);
    const auto choose = [setting](Request& r, Text text) {
        r.train.accuracy.choice[static_cast<std::size_t>(setting)] =
            find_choice(setting, text, true);
    };
    return {
        .row = {.flags = flag.c_str(), .group = option_group::kAccuracy, .help = help.c_str()},
        .section = "accuracy",
        .key = std::string(of.name),
        .take =
            [choose](Request& r, Text text) {
                choose(r, text);
                follow_accuracy(r);
            },
        .saved =
            [setting](const Request& r) { return std::string(r.train.accuracy.of(setting).name); },
        .restore = choose};
}

void accuracy_rows(Rows& rows) {
    rows.push_back({.row = {.flags = "--pulses",
                            .group = option_group::kAccuracy,
                            .help = "pulses of raised_cosine and sinc: 2 or 3 keep rings that the "
                                    "paper's limit removes",
                            .usual = "1",
                            .least = 1,
                            .most = KERNEL_MAX_PULSES},
                    .take = take_pulses});
    rows.push_back({.row = {.flags = "--accuracy",
                            .group = option_group::kAccuracy,
                            .help = "fast, balanced (default) or exact; `darb cost` shows what "
                                    "each costs"},
                    .take = take_accuracy});
    for (int s = 0; s < kAccuracyCount; ++s) rows.push_back(accuracy_row(s));
    rows.push_back(
        {.key = "footprint",
         .take =
             [](Request& r, Text text) {
                 const auto footprint = footprint_from_name(text);
                 if (!footprint) throw Error("", "is neither psi nor exact", "");
                 r.train.footprint = *footprint;
             },
         .saved = [](const Request& r) { return std::string(footprint_name(r.train.footprint)); }});
}

// The name of a row of TrainOptions in the file: its flag, its place in the settings, or its own.
std::string key_in_file(const OptionRow& row) {
    if (*row.flags != '\0') return option_name(row).substr(2);
    return *row.setting != '\0' ? row.setting : row.name;
}

void saving_rows(Rows& rows) {
    const auto list = [&rows](const char* flags, const char* help, const char* key,
                              RequestPlace (*place)(Request&)) {
        rows.push_back({.row = {.flags = flags,
                                .group = option_group::kSaving,
                                .help = help,
                                .least = 1,
                                .most = 1e9},
                        .key = key,
                        .several = true,
                        .place = place});
    };
    list("--test-iterations", "evaluate after these (default 7000 30000 and the last)",
         "test_iterations", [](Request& r) -> RequestPlace { return &r.test_iterations; });
    list("--save-iterations", "write a PLY after these (default 7000 30000 and the last)",
         "save_iterations", [](Request& r) -> RequestPlace { return &r.save_iterations; });
    list("--checkpoint-iterations", "keep a checkpoint of its own after these",
         "checkpoint_iterations",
         [](Request& r) -> RequestPlace { return &r.checkpoint_iterations; });
    rows.push_back(
        {.row = {.flags = "--checkpoint-interval",
                 .group = option_group::kSaving,
                 .help = "refresh checkpoint.darb every this many iterations; 0: only at the end",
                 .usual = "1000"},
         .key = "checkpoint_interval",
         .place = [](Request& r) -> RequestPlace { return &r.checkpoint_interval; }});
    rows.push_back(
        {.row = {.flags = "--start-checkpoint",
                 .group = option_group::kSaving,
                 .help = "continue from this checkpoint"},
         .key = "start_checkpoint",
         .place = [](Request& r) -> RequestPlace { return &r.start_checkpoint; },
         .saved = [](const Request& r) { return path_in_file(r, r.start_checkpoint); },
         .restore = [](Request& r, Text text) { r.start_checkpoint = path_of_file(r, text); }});
    rows.push_back({.row = {.flags = "--report,!--no-report",
                            .group = option_group::kSaving,
                            .help = "write OUT/report.html at the end (default): curves, time by "
                                    "pass, pictures",
                            .is_switch = true},
                    .key = "report",
                    .place = [](Request& r) -> RequestPlace { return &r.report; }});
    rows.push_back({.row = {.flags = "--html",
                            .group = option_group::kSaving,
                            .help = "write OUT/scene.html at the end: a web page that shows the "
                                    "scene",
                            .is_switch = true},
                    .key = "page",
                    .place = [](Request& r) -> RequestPlace { return &r.page; }});
}

Rows make_rows() {
    Rows rows;
    for (const auto add : {whole_rows, place_rows, photo_rows, run_rows, scene_rows, region_rows,
                           effect_rows, accuracy_rows})
        add(rows);
    for (const OptionRow& row : option_rows())
        if (!std::holds_alternative<std::monostate>(row.member))
            rows.push_back({.row = row, .section = "train", .key = key_in_file(row)});
    saving_rows(rows);
    return rows;
}

}  // namespace

const std::vector<RequestOption>& request_options() {
    static const Rows rows = make_rows();
    return rows;
}

}  // namespace darb
