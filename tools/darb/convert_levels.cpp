#include "tools/darb/convert_levels.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "engine/core/error.h"
#include "engine/core/say.h"
#include "engine/core/text.h"
#include "engine/scene/merge_splats.h"
#include "tools/darb/compare_scenes.h"
#include "tools/darb/device_options.h"
#include "tools/darb/refine_splats.h"

namespace darb {

namespace {

constexpr double kHalf = 0.5;    // share of a level of the one before
constexpr int kMostLevels = 20;  // a million times fewer

struct Row {
    std::filesystem::path file;
    std::size_t splats = 0, bytes = 0;
    SceneDifference difference;
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

void print_table(const std::vector<Row>& rows, std::size_t views, double photos_db, bool refined,
                 std::FILE* to) {
    tell(to, "{:>9}  {:>11}  {:>8}  {:>8}{}  file\n", "splats", "bytes", "PSNR dB", "at worst",
         refined ? "  to photos   refined" : "");
    for (const Row& r : rows) {
        const std::string photos =
            refined ? fmt::format("  {:>9.2f}  {:>8.2f}", r.photos_db, r.refined_db) : "";
        tell(to, "{:>9}  {:>11}  {:>8.2f}  {:>8.2f}{}  {}\n", r.splats, r.bytes,
             r.difference.mean_psnr_db, r.difference.worst_psnr_db, photos,
             printable(r.file.string()));
    }
    tell(to, "PSNR of renders against those of the scene, {} views", views);
    if (refined) tell(to, "; photos: held-out ones, {:.2f} dB with all splats", photos_db);
    tell(to, "\n");
}

}  // namespace

void add_level_options(CLI::App& app, LevelFlags& flags) {
    app.add_option("--splats", flags.splats, "merge the scene to so many splats")
        ->check(CLI::PositiveNumber);
    app.add_option("--share", flags.share,
                   "merge it to this share of its splats; of --levels each to this share of the "
                   "one before (default there: 0.5)")
        ->check(CLI::Range(0.0, 1.0));
    app.add_option("--levels", flags.levels,
                   "write so many levels, fewer and fewer splats: OUT.1.ply, OUT.2.ply, ...")
        ->check(CLI::Range(1, kMostLevels));
    app.add_option("--refine", flags.refine,
                   "a data set: train the merged splats on its photos for a little while");
    app.add_option("--refine-iterations", flags.iterations, "of --refine")
        ->check(CLI::PositiveNumber)
        ->capture_default_str();
    app.add_option("--refine-resolution", flags.data.resolution,
                   "of its photos, as -r of darb train")
        ->needs(app.get_option("--refine"));
}

void check_level_options(const LevelFlags& flags) {
    if (flags.splats > 0 && flags.share && flags.levels == 0)
        throw Error("--share", "and --splats both say how many splats to keep",
                    "Leave out one of them, or add --levels.");
    if (flags.share && !(*flags.share > 0))
        throw Error("--share", "0 leaves no splats", "Use 0.25.");
    if (!flags.refine.empty() && !flags.asked())
        throw Error("--refine", "is for merged splats", "Add --splats, --share or --levels.");
}

std::vector<std::size_t> level_counts(const LevelFlags& flags, std::size_t splats) {
    const double share = flags.share.value_or(kHalf);
    std::vector<std::size_t> counts;
    double count =
        flags.splats > 0 ? static_cast<double>(flags.splats) : share * static_cast<double>(splats);
    for (int level = 0; level < std::max(flags.levels, 1); ++level, count *= share)
        counts.push_back(std::clamp<std::size_t>(static_cast<std::size_t>(std::lround(count)), 1,
                                                 std::max<std::size_t>(splats, 1)));
    return counts;
}

std::filesystem::path level_file(const std::filesystem::path& output, SplatFormat format, int n) {
    std::string name = output.filename().string();
    const std::string small = lower(name);
    std::size_t ending = 0;
    for (const std::string& known : endings_of(format))
        if (small.ends_with(known)) ending = std::max(ending, known.size());
    if (ending == 0 || ending == name.size())
        throw Error(output.string(), "is the name of one scene, and --levels writes several",
                    "Let it end in .ply, for example.");
    name.insert(name.size() - ending, fmt::format(".{}", n));
    return output.parent_path() / name;
}

Paths write_levels(const LevelFlags& flags, const SplatModel& model, const LevelOutput& to) {
    if (model.size() == 0)
        throw Error("--levels", "there are no splats to merge", "Name another scene.");
    const std::vector<std::size_t> counts = level_counts(flags, model.size());
    std::vector<SplatModel> levels = merged(model, counts);
    const bool refines = !flags.refine.empty();
    std::optional<Refiner> refiner;
    std::optional<Device> device;
    double photos_db = 0;
    if (refines) {
        refiner.emplace(flags.refine, flags.data);
        DeviceOptions options = command_device(to.device);
        device.emplace(options);
        photos_db = refiner->psnr_db(*device, model);
    }
    std::vector<Row> rows;
    for (std::size_t i = 0; i < levels.size(); ++i) {
        Row row;
        row.file = flags.levels > 0 ? level_file(to.output, to.format, static_cast<int>(i) + 1)
                                    : to.output;
        if (refines) {
            row.photos_db = refiner->psnr_db(*device, levels[i]);
            levels[i] = refiner->refine(*device, levels[i], flags.iterations);
            row.refined_db = refiner->psnr_db(*device, levels[i]);
        }
        row.bytes = to.write(row.file, levels[i]);
        row.splats = levels[i].size();
        row.difference = compare_scenes(model, load_splats(row.file), to.views, to.device);
        rows.push_back(row);
        levels[i] = SplatModel();
    }
    print_table(rows, to.views.size(), photos_db, refines, to.say);
    Paths written;
    for (const Row& row : rows) written.push_back(row.file);
    return written;
}

}  // namespace darb
