// SPDX-License-Identifier: MIT
// darb check: the numerical checks on the user's own device, and the arrays of a view of a scene.

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <memory>
#include <nlohmann/json.hpp>

#include "engine/check/dump.h"
#include "engine/check/run_checks.h"
#include "engine/core/error.h"
#include "engine/core/files.h"
#include "engine/core/say.h"
#include "engine/core/text.h"
#include "engine/gpu/device.h"
#include "tools/darb/command_list.h"
#include "tools/darb/flags.h"
#include "tools/darb/open_cameras.h"
#include "tools/darb/outputs.h"
#include "tools/darb/tune_flags.h"
#include "trainer/job/scene_file.h"

namespace darb {

namespace {

struct CheckFlags {
    std::string device;
    std::filesystem::path json, scene, cameras, dump;
    int view = 0;
    bool reference = false, quiet = false;
    TuneFlags tune;
    DatasetOptions data;
    check::CheckOptions checks;
    KernelFlags kernel;
    StoredUnits units;
};

nlohmann::json row_json(const check::Row& row) {
    nlohmann::json json{{"group", row.group},  {"name", row.name},
                        {"error", row.error},  {"allowed", row.allowed},
                        {"values", row.count}, {"outside", row.outside},
                        {"band", row.band},    {"seconds", row.seconds},
                        {"pass", row.pass},    {"detail", row.detail}};
    if (row.float_alone) json["float_alone"] = *row.float_alone;
    return json;
}

void print_row(std::FILE* out, const check::Row& row, std::string& group) {
    if (row.group != group) tell(out, "\n{}\n", group = row.group);
    std::string outside;
    if (row.outside > 0 || row.band > 0)
        outside = fmt::format("{} of {} outside, {} may be", row.outside, row.count, row.band);
    tell(out, "  {:<44} {:>9.2e} {:>9.2e}  {}  {}{}\n", row.name, row.error, row.allowed,
         row.pass ? "pass" : "FAIL", outside, row.detail);
}

int dump_view(const CheckFlags& flags) {
    if (flags.scene.empty() || flags.cameras.empty() || flags.dump.empty())
        throw Error("darb check", "--scene, --cameras and --dump belong together",
                    "darb check --scene S.ply --cameras cameras.json --view 0 --dump DIR");
    if (!flags.json.empty() || flags.checks.every_kernel)
        throw Error(flags.json.empty() ? "darb check --every-kernel" : "darb check --json",
                    "cannot be combined with --dump", "Leave one of them out.");
    const SplatModel model = in_kernel(flags.kernel, load_scene(flags.scene, nullptr, flags.units));
    const std::vector<View> views = open_cameras(flags.cameras, flags.data);
    if (flags.view < 0 || static_cast<size_t>(flags.view) >= views.size())
        throw Error(flags.cameras.string(), fmt::format("there is no view {}", flags.view),
                    fmt::format("--view takes 0 to {}.", views.size() - 1));
    const View& view = views[static_cast<size_t>(flags.view)];
    refuse_to_overwrite_inputs(check::dump_files(flags.dump), files_of(flags.scene));
    std::string from = "the reference in double";
    if (flags.reference) {
        check::dump_from_reference(model, view.camera, flags.dump);
    } else {
        DeviceOptions options = command_device(flags.device);
        Device device(options);
        settle_tuning(device, flags.tune);
        check::dump_from_device(device, model, view.camera, flags.dump);
        from = device.info().name;
    }
    tell_paths(flags.quiet, {flags.dump});
    tell(flags.quiet ? nullptr : stdout,
         "{}: image and gradients of view {} ({}), {} splats, {} x {} px, from {}\n",
         flags.dump.string(), flags.view, printable(view.name), model.size(), view.camera.width,
         view.camera.height, from);
    return 0;
}

int check_command(CheckFlags flags) {
    if (!flags.scene.empty() || !flags.cameras.empty() || !flags.dump.empty())
        return dump_view(flags);
    if (flags.reference)
        throw Error("darb check --reference", "is for a view of a scene",
                    "Add --scene, --cameras and --dump.");
    flags.checks.kernel = chosen_kernel(flags.kernel);
    DeviceOptions options = command_device(flags.device);
    options.keep_pipelines = true;  // most checks use the same ones
    Device device(options);
    settle_tuning(device, flags.tune);
    const DeviceInfo& info = device.info();
    std::FILE* const out = stream_beside_json(flags.json, flags.quiet);
    tell(out, "darb {}\ndevice   {}\ndriver   {}\nsubgroup {} lanes\n{:<46} {:>9} {:>9}\n",
         DARB_VERSION, info.name, info.driver, info.subgroup_size, "", "error", "allowed");
    const auto start = std::chrono::steady_clock::now();
    std::string group;
    const std::vector<check::Row> rows = check::run_checks(
        device, flags.checks, [&](const check::Row& row) { print_row(out, row, group); });
    const std::chrono::duration<double> seconds = std::chrono::steady_clock::now() - start;
    nlohmann::json list = nlohmann::json::array();
    for (const check::Row& row : rows) list.push_back(row_json(row));
    const auto failed = std::ranges::count(rows, false, &check::Row::pass);
    tell(out, "\n{} checks in {:.1f} s, {} failed: {}\n", rows.size(), seconds.count(), failed,
         failed == 0 ? "PASS" : "FAIL");
    write_json(flags.json, nlohmann::json{{"version", DARB_VERSION},
                                          {"device", info.name},
                                          {"driver", info.driver},
                                          {"subgroup_size", info.subgroup_size},
                                          {"seconds", seconds.count()},
                                          {"failed", failed},
                                          {"checks", list}});
    tell_paths(flags.quiet, {flags.json});
    return failed == 0 ? 0 : 1;
}

}  // namespace

void add_check(CLI::App& app, Action& action) {
    auto flags = std::make_shared<CheckFlags>();
    CLI::App* command = app.add_subcommand(
        "check", "Check a device and its driver against double precision; exit code 1: failed");
    add_json_option(*command, flags->json);
    command->add_flag(
        "--every-kernel", flags->checks.every_kernel,
        "check walks and hard cases with every kernel and footprint: minutes, not seconds");
    add_kernel_flags(*command, flags->kernel, "check only this kernel; with --scene: draw with it");
    command->add_option("--device", flags->device, "number or part of a name, see `darb devices`");
    add_tune_flags(*command, flags->tune);
    command->add_option("--scene", flags->scene, "a PLY file whose view --dump writes");
    command->add_option("--cameras", flags->cameras, "a cameras.json, transforms.json or data set");
    command->add_option("--view", flags->view, "number of the view, counted from 0")
        ->capture_default_str();
    command->add_option("--dump", flags->dump,
                        "write image and gradients of sum(image * linspace(0, 1)) to this folder");
    command->add_flag("--reference", flags->reference,
                      "write --dump from the double-precision reference, not from the device");
    add_quiet_flag(*command, flags->quiet);
    add_unit_options(*command, flags->units);
    command->callback([flags, &action] { action = [flags] { return check_command(*flags); }; });
}

}  // namespace darb
