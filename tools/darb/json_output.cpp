#include "tools/darb/json_output.h"

#include "engine/core/files.h"
#include "engine/core/say.h"
#include "trainer/run/run_folder.h"

namespace darb {

CLI::Option* add_json_option(CLI::App& command, std::filesystem::path& json) {
    return command.add_option("--json", json, "write every number to this file; - is stdout");
}

std::FILE* stream_beside_json(const std::filesystem::path& json, bool quiet) {
    return quiet ? nullptr : json == "-" ? stderr : stdout;
}

void write_json(const std::filesystem::path& to, const nlohmann::json& json) {
    if (to.empty()) return;
    const bool shown = to == "-";  // names may hold any bytes, and what steers a terminal
    const std::string text =
        json.dump(2, ' ', shown, nlohmann::json::error_handler_t::replace) + "\n";
    shown ? tell_text(text) : write_file_atomic(to, text);
}

std::string name_in_json(const std::filesystem::path& to, const std::filesystem::path& path) {
    const std::filesystem::path folder = to == "-" ? "." : to.parent_path();
    return shared_name(folder.empty() ? "." : folder, path);
}

void leave_folders_out(nlohmann::json& texts, const std::filesystem::path& path) {
    if (texts.is_string()) texts = without_folders(texts.get<std::string>(), path);
    if (texts.is_structured())
        for (nlohmann::json& one : texts) leave_folders_out(one, path);
}

}  // namespace darb
