#include "tools/darb/evaluation_flags.h"

#include <string>

#include "trainer/job/request_options.h"

namespace darb {

Dataset off_path_of(const std::filesystem::path& dataset, const DatasetOptions& options) {
    const std::filesystem::path folder = dataset / "off_path";
    if (!std::filesystem::exists(folder / "transforms_test.json")) return {};
    DatasetOptions own = options;
    own.images_folder = DatasetOptions{}.images_folder;  // --images is of the data set's photos
    own.held_out = {};
    return load_dataset(folder, own);
}

CLI::Option* add_hold_out_flag(CLI::App& command, DatasetOptions& data) {
    return command
        .add_option_function<std::string>(
            "--hold-out",
            [&data](const std::string& text) {
                data.held_out = parse_hold_out(text);
                data.hold_out = true;
            },
            request_option("--hold-out").row.help)
        ->default_str(request_option("--hold-out").row.usual);
}

CLI::Option* add_depth_scale_flag(CLI::App& command, DatasetOptions& data) {
    const OptionRow& row = request_option("--depth-scale").row;
    return command.add_option(row.flags, data.depth_scale, row.help)
        ->default_str(row.usual)
        ->check(CLI::Range(row.least, row.most));
}

CLI::Option* add_scales_flag(CLI::App& command, std::vector<double>& scales) {
    return command
        .add_option("--scales", scales,
                    "sizes to measure at, as multiples of that of -r, with commas: 0.5,1,2,4")
        ->delimiter(',')
        ->allow_extra_args(false)
        ->check(CLI::Range(0.01, 100.0));
}

}  // namespace darb
