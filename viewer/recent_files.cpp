#include "viewer/recent_files.h"

#include <algorithm>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>

#include "engine/core/error.h"
#include "engine/core/files.h"

namespace darb {

namespace {

constexpr std::size_t kMostRecent = 10;

// None where the file is something else; empty where it is not there.
std::optional<std::vector<std::string>> read_recent(const std::filesystem::path& list) {
    if (!std::filesystem::exists(list)) return std::vector<std::string>();
    try {
        return nlohmann::json::parse(read_text_file(list))
            .at("scenes")
            .get<std::vector<std::string>>();
    } catch (const std::exception&) {
        return {};
    }
}

}  // namespace

std::vector<std::filesystem::path> RecentFiles::read() const {
    std::vector<std::filesystem::path> files;
    if (list_.empty()) return files;
    const std::optional<std::vector<std::string>> names = read_recent(list_);
    if (!names) return files;
    for (const std::string& name : *names) {
        std::error_code none;
        if (std::filesystem::exists(name, none)) files.emplace_back(name);
    }
    return files;
}

void RecentFiles::opened(const std::filesystem::path& scene) const {
    if (list_.empty()) return;
    std::optional<std::vector<std::string>> names = read_recent(list_);
    if (!names) return;
    std::filesystem::path path = std::filesystem::absolute(scene).lexically_normal();
    if (!path.has_filename()) path = path.parent_path();  // a folder, named with a slash
    const std::string name = path.string();
    std::erase(*names, name);
    names->insert(names->begin(), name);
    names->resize(std::min(names->size(), kMostRecent));
    std::filesystem::create_directories(list_.parent_path());
    const nlohmann::json json{{"scenes", *names}};
    write_file_atomic(list_,
                      json.dump(1, ' ', false, nlohmann::json::error_handler_t::replace) + "\n");
}

}  // namespace darb
