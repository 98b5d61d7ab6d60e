#include "viewer/recovery.h"

#include <fmt/format.h>

#include <functional>

#include "engine/core/error.h"
#include "engine/scene/splat_file.h"

namespace darb {

namespace {

namespace fs = std::filesystem;

// Nothing that is there is written over, links that lead nowhere among it.
fs::path free_name(const fs::path& folder, const std::string& stem, const std::string& extension) {
    for (int n = 1;; ++n) {
        const std::string number = n == 1 ? "" : fmt::format("_{}", n);
        const fs::path file = folder / (stem + "_recovered" + number + extension);
        std::error_code none;
        if (fs::symlink_status(file, none).type() == fs::file_type::not_found) return file;
    }
}

// A sentence: where it is, or why it is lost.
std::string keep(const char* what, const fs::path& beside, const std::string& stem,
                 const std::string& extension, const std::function<void(const fs::path&)>& write) {
    std::error_code none;
    std::string reason;
    for (const fs::path& folder :
         {beside.parent_path(), fs::path("."), fs::temp_directory_path(none)}) {
        try {
            const fs::path file = free_name(folder, stem, extension);
            write(file);
            return fmt::format("{} that was not saved is in {}", what, file.string());
        } catch (const std::exception& e) {
            reason = e.what();
        }
    }
    return fmt::format("{} that was not saved is lost: {}", what, reason);
}

}  // namespace

std::string recover_unsaved(const Session& s) {
    std::string said;
    if (s.scene && s.edit.unsaved())
        said = keep("The edited scene", s.save_file, scene_name(s.scene->file), ".ply",
                    [&](const fs::path& file) {
                        save_splats(file, SplatFormat::ply, s.edit.apply(s.scene->model));
                    });
    if (s.path.unsaved())
        said += (said.empty() ? "" : ". ") +
                keep("The camera path", s.path.file, s.path.file.stem().string(), ".json",
                     [&](const fs::path& file) { write_camera_path(file, s.path.path); });
    return said.empty() ? said : said + ".";
}

}  // namespace darb
