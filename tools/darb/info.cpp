// darb info X: what a splat scene, or a data set, holds.

#include <fmt/format.h>

#include <memory>

#include "tools/darb/commands.h"
#include "tools/darb/dataset_info.h"
#include "tools/darb/info_text.h"
#include "tools/darb/scene_file.h"
#include "tools/darb/scene_info.h"

namespace darb {

namespace {

struct InfoFlags {
    std::filesystem::path path;
    bool json = false;
    DatasetOptions data;
};

bool is_dataset(const std::filesystem::path& path) {
    if (std::filesystem::is_directory(path)) return !std::filesystem::exists(path / "point_cloud");
    return path.extension() == ".json";
}

int info(const InfoFlags& flags) {
    const bool dataset = is_dataset(flags.path);
    const nlohmann::json facts =
        dataset ? dataset_info(flags.path, flags.data) : scene_info(find_scene(flags.path));
    if (flags.json)  // names may hold any bytes
        fmt::print("{}\n", facts.dump(2, ' ', false, nlohmann::json::error_handler_t::replace));
    else if (dataset)
        print_dataset_info(facts);
    else
        print_scene_info(facts);
    return 0;
}

}  // namespace

void add_info(CLI::App& app, Action& action) {
    auto flags = std::make_shared<InfoFlags>();
    CLI::App* command = app.add_subcommand("info", "Describe a scene or a data set");
    command
        ->add_option("path", flags->path,
                     "PLY file, output folder of darb train, data set, or cameras.json")
        ->required();
    command->add_flag("--json", flags->json, "print JSON");
    command
        ->add_option("-i,--images", flags->data.images_folder, "photo folder of a COLMAP project")
        ->capture_default_str();
    command->add_option("-r,--resolution", flags->data.resolution,
                        "sizes as in training: 1, 2, 4, 8 or a width in px");
    command->callback([flags, &action] { action = [flags] { return info(*flags); }; });
}

}  // namespace darb
