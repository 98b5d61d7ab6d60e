#include "tools/darb/effect_flags.h"

#include "trainer/job/request_options.h"

namespace darb {

void add_effects_flag(CLI::App& command, std::string& text) {
    command.add_option("--effects", text, request_option("--effects").row.help)
        ->capture_default_str();
}

void add_lens_flag(CLI::App& command, DatasetOptions& data) {
    const RequestOption& lens = request_option("--lens");
    data.original_where_wide = true;
    command
        .add_option_function<std::string>(
            "--lens",
            [&data](const std::string& text) {
                data.original_lens = text == "original";
                data.original_where_wide = text == "auto";
            },
            lens.row.help)
        ->check(CLI::IsMember({"auto", "undistort", "original"}))
        ->default_str(lens.row.usual);
}

}  // namespace darb
