#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "engine/core/error.h"
#include "engine/core/say.h"
#include "engine/core/text.h"
#include "engine/gpu/device_environment.h"
#include "engine/scene/merge_splats.h"
#include "engine/scene/sog.h"
#include "tools/darb/compare_scenes.h"
#include "tools/darb/convert_levels.h"
#include "tools/darb/refine_splats.h"

namespace darb {

namespace {

struct Row {
    std::filesystem::path file = {};
    std::size_t splats = 0, bytes = 0;
    SceneDifference difference = {};
    double photos_db = 0, refined_db = 0;
};

std::vector<SplatModel> merged(const SplatModel& model, const std::vector<std::size_t>& counts) {
    int said = -1;
    const auto progress = [&](double share) {
        const int tenth = static_cast<int>(10 * share);
        if (tenth > said && share < 1) say_note(fmt::format("merging: {} %", 10 * tenth));
        said = std::max(said, tenth);
    };
    return merge_levels(model, counts, {.progress = progress});
}

std::string decibels(const SceneDifference& difference, double db) {
    return difference.worst_view.empty() ? "-" : fmt::format("{:.2f}", db);
}

void print_table(const std::vector<Row>& rows, std::size_t views, double photos_db, bool refined,
                 std::FILE* to) {
    tell(to, "{:>9}  {:>11}  {:>8}  {:>8}{}  file\n", "splats", "bytes", "PSNR dB", "at worst",
         refined ? "  to photos   refined" : "");
    for (const Row& r : rows) {
        const std::string photos =
            refined ? fmt::format("  {:>9.2f}  {:>8.2f}", r.photos_db, r.refined_db) : "";
        tell(to, "{:>9}  {:>11}  {:>8}  {:>8}{}  {}\n", r.splats, r.bytes,
             decibels(r.difference, r.difference.mean_psnr_db),
             decibels(r.difference, r.difference.worst_psnr_db), photos,
             printable(r.file.string()));
    }
    tell(to, "PSNR of renders against those of the scene, {} views",
         rows.front().difference.worst_view.empty() ? 0 : views);
    if (refined) tell(to, "; photos: held-out ones, {:.2f} dB with all splats", photos_db);
    tell(to, "\n");
}

/// --refine, and how near the photos all splats come.
struct Refinement {
    Refinement(const LevelFlags& from, const SplatModel& model, const std::string& select)
        : flags(from), refiner(from.refine, from.data), device(command_device(select)) {
        photos_db = refiner.psnr_db(device, model);
    }
    void refine(SplatModel& level, Row& row) {
        row.photos_db = refiner.psnr_db(device, level);
        SplatModel refined = refiner.refine(device, level, flags.iterations);
        row.refined_db = refiner.psnr_db(device, refined);
        if (row.refined_db < row.photos_db) {  // the 3D filter of anti-aliasing comes twice
            row.refined_db = row.photos_db;
            return;
        }
        level = std::move(refined);
    }

    const LevelFlags& flags;
    Refiner refiner;
    Device device;
    double photos_db = 0;  // of the model
};

/// All levels as one scene; rows: of the model and the levels.
void write_streamed(const SplatModel& model, std::vector<SplatModel> levels, const LevelOutput& to,
                    std::vector<Row>& rows) {
    SplatModel finest = model;
    const EncodedSplats encoded = to.write(to.output, finest, std::move(levels));
    for (const auto& [name, bytes] : encoded.beside) {
        Row& row = rows[level_of_part(name)];
        row.bytes += bytes.size();
        if (row.file.empty()) row.file = (to.output.parent_path() / name).parent_path();
    }
    for (std::size_t i = 0; i < rows.size(); ++i) {
        const SplatModel level = load_streamed_level(to.output, i);
        rows[i].splats = level.size();
        if (to.measure) rows[i].difference = compare_scenes(model, level, to.views, to.device);
    }
}

}  // namespace

Paths write_levels(const LevelFlags& flags, const SplatModel& model, const LevelOutput& to) {
    if (model.size() == 0)
        throw Error("--levels", "there are no splats to merge", "Name another scene.");
    std::vector<SplatModel> levels = merged(model, level_counts(flags, model.size()));
    std::vector<Row> rows(levels.size());
    std::optional<Refinement> refinement;
    if (!flags.refine.empty()) refinement.emplace(flags, model, to.device);
    const bool one_scene = flags.levels > 0 && to.format == SplatFormat::streamed_sog;
    for (std::size_t i = 0; i < levels.size(); ++i) {
        Row& row = rows[i];
        if (refinement) refinement->refine(levels[i], row);
        if (one_scene) continue;
        row.file = flags.levels > 0 ? level_file(to.output, to.format, static_cast<int>(i) + 1)
                                    : to.output;
        row.bytes = to.write(row.file, levels[i], {}).bytes();
        row.splats = levels[i].size();
        if (to.measure)
            row.difference = compare_scenes(model, load_splats(row.file), to.views, to.device);
        levels[i] = SplatModel();
    }
    const double photos_db = refinement ? refinement->photos_db : 0;
    if (one_scene) {
        rows.insert(rows.begin(), {.photos_db = photos_db, .refined_db = photos_db});
        write_streamed(model, std::move(levels), to, rows);
    }
    print_table(rows, to.views.size(), photos_db, refinement.has_value(), to.say);
    Paths written;
    if (one_scene)
        written.push_back(to.output);
    else
        for (const Row& row : rows) written.push_back(row.file);
    return written;
}

}  // namespace darb
