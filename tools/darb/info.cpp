// darb info X: what a splat scene, or a data set, holds.

#include <fmt/format.h>

#include <memory>

#include "engine/core/files.h"
#include "engine/core/say.h"
#include "engine/data/camera_list.h"
#include "tools/darb/command_list.h"
#include "tools/darb/dataset_info.h"
#include "tools/darb/info_text.h"
#include "tools/darb/json_output.h"
#include "tools/darb/outputs.h"
#include "tools/darb/scene_info.h"
#include "tools/darb/unit_flags.h"
#include "trainer/job/scene_file.h"

namespace darb {

namespace {

struct InfoFlags {
    std::filesystem::path path, json;
    bool quiet = false;
    DatasetOptions data;
    StoredUnits units;
};

bool is_dataset(const std::filesystem::path& path) {
    if (scene_file_in(path)) return false;
    if (std::filesystem::is_directory(path)) return !std::filesystem::exists(path / "point_cloud");
    return has_extension(path, ".json") && !names_scene_folder(path);
}

int info(const InfoFlags& flags) {
    refuse_to_overwrite_inputs({flags.json}, files_of(flags.path));
    const bool dataset = is_dataset(flags.path);
    if (dataset && std::filesystem::is_regular_file(flags.json))
        refuse_to_overwrite_inputs({flags.json}, files_of(load_cameras(flags.path, flags.data)));
    const nlohmann::json facts = dataset ? dataset_info(flags.path, flags.data)
                                         : scene_info(find_scene(flags.path), flags.units);
    if (!flags.json.empty()) {
        nlohmann::json shared = facts;
        for (const char* texts : {"notes", "warnings"})
            if (shared.contains(texts)) leave_folders_out(shared[texts], flags.path);
        shared["path"] = name_in_json(flags.json, facts["path"].get<std::string>());
        write_json(flags.json, shared);
    }
    tell_paths(flags.quiet, {flags.json});
    if (flags.json != "-" && !flags.quiet)
        dataset ? print_dataset_info(facts) : print_scene_info(facts);
    return 0;
}

}  // namespace

void add_info(CLI::App& app, Action& action) {
    auto flags = std::make_shared<InfoFlags>();
    CLI::App* command = app.add_subcommand("info", "Describe a scene or a data set");
    command
        ->add_option("path", flags->path,
                     "splat file, output folder of darb train, data set, or cameras.json")
        ->required();
    add_json_option(*command, flags->json);
    command
        ->add_option("-i,--images", flags->data.images_folder, "photo folder of a COLMAP project")
        ->capture_default_str();
    command->add_option("-r,--resolution", flags->data.resolution,
                        "sizes as in training: 1, 2, 4, 8 or a width in px");
    add_quiet_flag(*command, flags->quiet);
    add_unit_options(*command, flags->units);
    command->callback([flags, &action] { action = [flags] { return info(*flags); }; });
}

}  // namespace darb
