// SPDX-License-Identifier: MIT
// darb edit SCENE --script EDITS.json -o OUT: the edits of the window, without a window.
#include <fmt/format.h>
#include <CLI/CLI.hpp>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "engine/core/count_text.h"
#include "engine/core/error.h"
#include "engine/core/say.h"
#include "engine/scene/edit.h"
#include "engine/scene/edit_script.h"
#include "engine/scene/splat_file.h"
#include "tools/darb/command_list.h"
#include "tools/darb/flags.h"
#include "tools/darb/outputs.h"
#include "trainer/job/edited_scene.h"
#include "trainer/job/scene_file.h"

namespace darb {

namespace {

struct EditFlags {
    std::filesystem::path scene, output, script, record;
    Paths add;
    std::vector<std::string> keep, remove;
    std::string rotate, about, translate, layer;
    double scale = 1;
    bool force = false, quiet = false;
    StoredUnits units;
};

/// The options as edits, in the order of the help.
std::vector<EditOperation> edits_of_options(const EditFlags& flags) {
    std::vector<EditOperation> operations;
    const auto select = [&](Selector what, Combine how) {
        operations.emplace_back(edits::Select{std::move(what), how});
    };
    for (const std::filesystem::path& file : flags.add)
        operations.emplace_back(edits::Add{file, scene_name(file)});
    if (!flags.keep.empty()) {
        select(by::Nothing{}, Combine::replace);
        for (const std::string& text : flags.keep)
            select(selector_from_text("--keep", text), Combine::add);
        operations.emplace_back(edits::Remove{std::nullopt, true});
    }
    for (const std::string& text : flags.remove)
        operations.emplace_back(edits::Remove{selector_from_text("--delete", text), false});
    const auto vector = [](const char* option, const std::string& text) {
        if (text.empty()) return glm::dvec3(0.0);
        const std::vector<double> v = numbers_from(option, text, 3);
        return glm::dvec3(v[0], v[1], v[2]);
    };
    Similarity move;
    move.scale = flags.scale;
    if (!flags.rotate.empty()) move.turn = turn_of_degrees(vector("--rotate", flags.rotate));
    const glm::dvec3 about = vector("--about", flags.about);
    move.translation =
        vector("--translate", flags.translate) + about - move.scale * (move.turn * about);
    if (move == Similarity{}) return operations;
    select(by::Nothing{}, Combine::replace);
    operations.emplace_back(edits::Transform{move, ""});
    return operations;
}

SplatFormat checked_format(const EditFlags& flags) {
    const std::optional<SplatFormat> format = format_to_write(flags.output);
    if (!format)
        throw Error(flags.output.string(), "names no format that can be written",
                    "Let it end in " + endings_to_write() + ".");
    return *format;
}

/// Does the edits, and says what each did.
void perform_all(const std::vector<EditOperation>& operations, std::FILE* say_to,
                 const StoredUnits& units, EditedScene& scene) {
    const ReadScene read = [&](const std::filesystem::path& file) {
        return load_scene(file, nullptr, units);
    };
    for (std::size_t i = 0; i < operations.size(); ++i) {
        if (scene.edit.perform(operations[i], scene.model, read) > 0)
            tell(say_to, "{}: {}\n", i + 1, scene.edit.last());
        else
            tell(say_to, "{}: changed nothing\n", i + 1);
    }
}

SplatModel result_of(const EditFlags& flags, const EditedScene& scene) {
    if (flags.layer.empty()) return scene.saved();
    return scene.saved(scene.edit.layers()[scene.edit.layer_named(flags.layer)]);
}

int edit_as_asked(const EditFlags& flags) {
    Paths inputs = together({files_of(flags.scene), files_of(flags.script)});
    for (const std::filesystem::path& file : flags.add) inputs = together({inputs, files_of(file)});
    refuse_to_overwrite_inputs({flags.output, flags.record}, inputs, Replaces::all);
    const SplatFormat format = checked_format(flags);
    std::vector<EditOperation> operations;
    if (!flags.script.empty()) operations = read_edit_script(flags.script);
    for (EditOperation& one : edits_of_options(flags)) operations.push_back(std::move(one));
    if (operations.empty() && flags.layer.empty())
        throw Error("edit", "names no edits",
                    "Add --script EDITS.json, --keep, --delete, --add, or a move.");
    const WrittenFiles written(files_of(flags.scene), flags.force);
    written.check({flags.output, flags.record});
    EditedScene scene = load_edited_scene(flags.scene, nullptr, flags.units);
    const std::size_t before = scene.model.size() - scene.edit.removed_count();
    perform_all(operations, flags.quiet ? nullptr : stdout, flags.units, scene);
    SplatModel model = result_of(flags, scene);
    if (model.size() == 0)
        throw Error(flags.scene.string(), "nothing would be left of its splats",
                    "Select less in what is deleted, or more in what is kept.");
    for (const std::string& loss : scene.edit.losses_together())
        if (flags.layer.empty()) say("warning: {}\n", loss);
    for (const std::string& loss : losses_of(format, model, flags.output.string()))
        say("warning: {}: {}\n", flags.output.string(), loss);
    drop_unwritable(format, model);
    const EncodedSplats encoded = encode_scene(format, model, flags.output.string());
    const Paths outputs = outputs_of(flags.output, encoded);
    refuse_to_overwrite_inputs(outputs, inputs, Replaces::all);
    written.check(outputs);
    write_encoded(flags.output, encoded);
    written.wrote(outputs);
    if (!flags.record.empty()) {
        write_edit_script(flags.record, scene.edit.operations());
        written.wrote({flags.record});
    }
    tell(flags.quiet ? nullptr : stdout, "{}: {} splats, {} before\n", flags.output.string(),
         count_text(model.size()), count_text(before));
    tell_paths(flags.quiet, {flags.output, flags.record});
    return 0;
}

}  // namespace

void add_edit(CLI::App& app, Action& action) {
    auto flags = std::make_shared<EditFlags>();
    CLI::App* command = app.add_subcommand(
        "edit", "Do the edits of a script, or those that the options name, without a window");
    command
        ->add_option("scene", flags->scene,
                     "splat file, project, or the output folder of darb train")
        ->required();
    command->add_option("-o,--output", flags->output, "the edited scene: " + endings_to_write())
        ->required();
    command->add_flag("--force", flags->force, "replace a file that darb did not write");
    command->add_option("--script", flags->script,
                        "edits as JSON, such as the window saves; they come before the options "
                        "below, which follow in this order");
    command->add_option("--add", flags->add, "scenes to add, each as a layer");
    command->add_option("--keep", flags->keep,
                        "keep only these splats: all, sphere:X,Y,Z,RADIUS, "
                        "box:MINX,MINY,MINZ,MAXX,MAXY,MAXZ, opacity:LOW,HIGH, size:LOW,HIGH, "
                        "colour:R,G,B,WITHIN, isolated:SHARE, haze:OPACITY,SIZE or layer:NAME; "
                        "more than one may be named");
    command->add_option("--delete", flags->remove, "delete these splats, named as for --keep");
    command->add_option("--scale", flags->scale, "scale everything by this factor")
        ->check(above_zero());
    command->add_option("--rotate", flags->rotate, "X,Y,Z degrees, about x, then y, then z");
    command
        ->add_option("--about", flags->about,
                     "X,Y,Z, the point that --scale and --rotate leave where it is")
        ->default_str("0,0,0");
    command->add_option("--translate", flags->translate, "X,Y,Z, after --scale and --rotate");
    command->add_option("--layer", flags->layer,
                        "write this layer alone, not all visible ones together");
    command->add_option("--record", flags->record, "write all edits to this file as a script");
    add_quiet_flag(*command, flags->quiet);
    add_unit_options(*command, flags->units);
    command->callback([flags, &action] { action = [flags] { return edit_as_asked(*flags); }; });
}

}  // namespace darb
