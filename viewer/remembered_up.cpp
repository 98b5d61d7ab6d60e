#include "viewer/remembered_up.h"

#include <cmath>
#include <nlohmann/json.hpp>

#include "engine/core/error.h"
#include "engine/core/files.h"

namespace darb {

namespace {

namespace fs = std::filesystem;
using nlohmann::json;

constexpr std::size_t kMostScenes = 500;

std::string key_of(const fs::path& scene) {
    std::error_code error;
    const fs::path whole = fs::weakly_canonical(fs::absolute(scene), error);
    return (error ? scene : whole).string();
}

/// [{"scene": path, "up": [x, y, z]}, ...], latest last.
json read_list(const fs::path& list) {
    if (list.empty() || !fs::is_regular_file(list)) return json::array();
    json entries = json::parse(read_text_file(list), nullptr, false);
    if (!entries.is_array())
        throw Error(list.string(), "is no list of scenes and their up",
                    "Move it away to have a new one.");
    return entries;
}

bool is_of(const json& entry, const std::string& key) {
    return entry.is_object() && entry.contains("scene") && entry["scene"].is_string() &&
           entry["scene"] == key;
}

}  // namespace

std::optional<glm::dvec3> RememberedUp::find(const fs::path& scene) const {
    try {
        const std::string key = key_of(scene);
        for (const json& entry : read_list(list_)) {
            if (!is_of(entry, key) || !entry.contains("up")) continue;
            const auto up = entry["up"].get<std::vector<double>>();
            const glm::dvec3 v = up.size() == 3 ? glm::dvec3(up[0], up[1], up[2]) : glm::dvec3(0.0);
            if (std::isfinite(glm::length(v)) && glm::length(v) > 0.5) return glm::normalize(v);
        }
    } catch (const std::exception&) {  // as if nothing were known
    }
    return {};
}

void RememberedUp::keep(const fs::path& scene, const glm::dvec3& up) const {
    if (list_.empty()) return;
    json entries = read_list(list_);
    const std::string key = key_of(scene);
    json kept = json::array();
    for (json& entry : entries)
        if (!is_of(entry, key)) kept.push_back(std::move(entry));
    kept.push_back({{"scene", key}, {"up", {up.x, up.y, up.z}}});
    while (kept.size() > kMostScenes) kept.erase(kept.begin());
    fs::create_directories(list_.parent_path());
    write_file_atomic(list_, kept.dump(1, ' ', false, json::error_handler_t::replace) + "\n");
}

}  // namespace darb
