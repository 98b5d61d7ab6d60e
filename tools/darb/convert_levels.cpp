#include "tools/darb/convert_levels.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "engine/core/error.h"
#include "engine/core/text.h"
#include "tools/darb/numbers.h"

namespace darb {

namespace {

constexpr double kHalf = 0.5;    // share of a level of the one before
constexpr int kMostLevels = 20;  // a million times fewer

}  // namespace

void add_level_options(CLI::App& app, LevelFlags& flags) {
    app.add_option("--splats", flags.splats, "merge the scene to so many splats")
        ->check(above_zero());
    app.add_option("--share", flags.share,
                   "merge it to this share of its splats; of --levels each to this share of the "
                   "one before (default there: 0.5)")
        ->check(CLI::Range(0.0, 1.0));
    app.add_option("--levels", flags.levels,
                   "write so many levels, fewer and fewer splats: OUT.1.ply, OUT.2.ply, ...; of "
                   "OUT/lod-meta.json, so many below the scene itself")
        ->check(CLI::Range(1, kMostLevels));
    app.add_option("--refine", flags.refine,
                   "a data set: train the merged splats on its photos for a little while");
    app.add_option("--refine-iterations", flags.iterations, "of --refine")
        ->check(above_zero())
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

}  // namespace darb
