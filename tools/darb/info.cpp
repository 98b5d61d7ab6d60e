// darb info X: what a splat scene, or a data set, holds.

#include <fmt/format.h>

#include <memory>

#include "engine/core/files.h"
#include "engine/data/camera_list.h"
#include "tools/darb/command_list.h"
#include "tools/darb/dataset_info.h"
#include "tools/darb/info_text.h"
#include "tools/darb/outputs.h"
#include "tools/darb/scene_file.h"
#include "tools/darb/scene_info.h"

namespace darb {

namespace {

struct InfoFlags {
    std::filesystem::path path, json;
    DatasetOptions data;
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
    const nlohmann::json facts =
        dataset ? dataset_info(flags.path, flags.data) : scene_info(find_scene(flags.path));
    // Names may hold any bytes.
    const std::string text =
        facts.dump(2, ' ', false, nlohmann::json::error_handler_t::replace) + "\n";
    if (flags.json == "-") {
        fmt::print("{}", text);
        return 0;
    }
    dataset ? print_dataset_info(facts) : print_scene_info(facts);
    if (!flags.json.empty()) write_file_atomic(flags.json, text);
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
    command->add_option("--json", flags->json,
                        "write the facts to this file too; - prints them, and nothing else");
    command
        ->add_option("-i,--images", flags->data.images_folder, "photo folder of a COLMAP project")
        ->capture_default_str();
    command->add_option("-r,--resolution", flags->data.resolution,
                        "sizes as in training: 1, 2, 4, 8 or a width in px");
    command->callback([flags, &action] { action = [flags] { return info(*flags); }; });
}

}  // namespace darb
