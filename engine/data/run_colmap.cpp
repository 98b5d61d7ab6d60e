#include "engine/data/run_colmap.h"

#include <fmt/format.h>
#include <sys/wait.h>

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <deque>
#include <map>
#include <memory>

#include "engine/core/error.h"
#include "engine/data/colmap.h"

namespace darb {

namespace fs = std::filesystem;

namespace {

constexpr std::size_t kKeptLines = 8;  // shown when a command fails
constexpr std::size_t kMapper = 2;     // of colmap_commands

std::string joined(const auto& lines) {
    std::string text;
    for (const std::string& line : lines) text += "\n    " + line;
    return text;
}

constexpr const char* kPhotosHint =
    "Photos need 60 % overlap and texture; see what colmap says above.";
// A camera that stands still, or turns alone, shows no depth.
constexpr const char* kMotionHint =
    "The camera must move between photos, around the scene; they need 60 % overlap, texture, and "
    "no blur.";

void run_command(const std::string& command, const std::function<void(std::string_view)>& progress,
                 const char* hint = kPhotosHint) {
    const auto close = [](std::FILE* pipe) { ::pclose(pipe); };
    std::unique_ptr<std::FILE, decltype(close)> pipe(::popen((command + " 2>&1").c_str(), "r"),
                                                     close);
    if (!pipe) throw Error("colmap", "cannot be started", "Free memory or processes.");
    std::deque<std::string> last;
    char buffer[4096];
    std::string line;
    while (std::fgets(buffer, sizeof buffer, pipe.get())) {
        line += buffer;
        if (!line.ends_with('\n') && !std::feof(pipe.get())) continue;
        while (line.ends_with('\n') || line.ends_with('\r')) line.pop_back();
        if (progress && !line.empty()) progress(line);
        if (!line.empty()) last.push_back(line);
        if (last.size() > kKeptLines) last.pop_front();
        line.clear();
    }
    const int status = ::pclose(pipe.release());
    if (!WIFEXITED(status) || WEXITSTATUS(status) != 0)
        throw Error("colmap",
                    fmt::format("failed:\n    {}\n  It printed last:{}", command, joined(last)),
                    hint);
}

/// What a command prints, whatever becomes of it.
std::string output_of(const std::string& command) {
    std::string text;
    const auto collect = [&](std::string_view line) { text += std::string(line) + "\n"; };
    try {
        run_command("QT_QPA_PLATFORM=offscreen " + command, collect);
    } catch (const Error&) {  // some versions call their help a failure
    }
    return text;
}

std::map<std::string, std::size_t> models_below(const fs::path& sparse) {
    std::map<std::string, std::size_t> models;
    std::error_code ignored;
    for (const fs::directory_entry& entry : fs::directory_iterator(sparse, ignored))
        if (is_colmap_model(entry.path()))
            models[entry.path().filename().string()] = count_colmap_images(entry.path());
    return models;
}

}  // namespace

// The mapper need not number it 0.
std::string largest_colmap_model(const fs::path& sparse) {
    const std::map<std::string, std::size_t> models = models_below(sparse);
    if (models.empty()) return {};
    return std::max_element(models.begin(), models.end(),
                            [](const auto& a, const auto& b) { return a.second < b.second; })
        ->first;
}

std::string shell_quoted(const fs::path& path) {
    std::string text = "'";
    for (const char c : path.string()) {
        if (c == '\'')
            text += "'\\''";
        else
            text += c;
    }
    return text + "'";
}

bool is_installed(const std::string& program) {
    return std::system(
               ("command -v " + shell_quoted(fs::path(program)) + " > /dev/null 2>&1").c_str()) ==
           0;
}

bool has_new_names(std::string_view help) {
    return help.find("FeatureExtraction.use_gpu") != std::string_view::npos;
}

std::vector<std::string> colmap_commands(const ColmapRun& run) {
    const std::string colmap = "QT_QPA_PLATFORM=offscreen colmap ";
    const std::string database = shell_quoted(run.workspace / "database.db");
    const std::string photos = shell_quoted(run.photos);
    const std::string masks =
        run.masks.empty() ? "" : " --ImageReader.mask_path " + shell_quoted(run.masks);
    const char* part = run.new_names ? "Feature" : "Sift";
    // OPENCV: phones and consumer cameras; the undistorter turns it into a pinhole.
    return {
        fmt::format("{}feature_extractor --database_path {} --image_path {} "
                    "--ImageReader.single_camera {} --ImageReader.camera_model OPENCV "
                    "--{}Extraction.use_gpu 0{}",
                    colmap, database, photos, run.single_camera ? 1 : 0, part, masks),
        fmt::format("{}{}_matcher --database_path {} --{}Matching.use_gpu 0", colmap,
                    run.sequential ? "sequential" : "exhaustive", database, part),
        fmt::format("{}mapper --database_path {} --image_path {} --output_path {}", colmap,
                    database, photos, shell_quoted(run.workspace / "sparse")),
        fmt::format("{}image_undistorter --image_path {} --input_path {} --output_path {} "
                    "--output_type COLMAP --max_image_size {}",
                    colmap, photos, shell_quoted(run.workspace / "sparse" / run.model),
                    shell_quoted(run.workspace / "dense"), run.max_image_size),
    };
}

namespace {

std::string chosen_model(const ColmapRun& run,
                         const std::function<void(std::string_view)>& progress) {
    const fs::path sparse = run.workspace / "sparse";
    const std::string model = largest_colmap_model(sparse);
    if (model.empty())
        throw Error(run.photos.string(), "colmap found no common view of the photos", kMotionHint);
    if (const std::size_t count = models_below(sparse).size(); count > 1 && progress)
        progress(fmt::format("{} models: {}, of {} photos, is the largest and is used", count,
                             (sparse / model).string(), count_colmap_images(sparse / model)));
    return model;
}

}  // namespace

fs::path run_colmap(const ColmapRun& asked, const std::function<void(std::string_view)>& progress) {
    ColmapRun run = asked;
    if (!fs::is_directory(run.photos))
        throw Error(run.photos.string(), "is no folder of photos", "Check the path.");
    std::vector<std::string> commands = colmap_commands(run);
    if (!is_installed("colmap"))
        throw Error(
            run.photos.string(), "holds photos without cameras, and colmap is not installed",
            fmt::format("Install it (apt install colmap), or run elsewhere:\n    mkdir -p {}{}",
                        shell_quoted(run.workspace / "sparse"), joined(commands)));
    std::error_code failure;
    fs::create_directories(run.workspace / "sparse", failure);
    if (failure)
        throw Error(run.workspace.string(), "cannot be made: " + failure.message(),
                    "Choose another workspace folder.");
    run.new_names = has_new_names(output_of("colmap feature_extractor -h"));
    commands = colmap_commands(run);
    for (std::size_t i = 0; i < commands.size(); ++i) {
        if (progress) progress(fmt::format("[{}/{}] {}", i + 1, commands.size(), commands[i]));
        run_command(commands[i], progress, i == kMapper ? kMotionHint : kPhotosHint);
        if (i != kMapper) continue;
        run.model = chosen_model(run, progress);
        commands = colmap_commands(run);
    }
    return run.workspace / "dense";
}

}  // namespace darb
