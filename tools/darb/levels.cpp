// SPDX-License-Identifier: MIT
#include "tools/darb/levels.h"

#include <fmt/format.h>
#include <algorithm>
#include <cmath>
#include <filesystem>
#include <utility>

#include "engine/core/error.h"
#include "engine/core/say.h"
#include "engine/core/text.h"
#include "engine/data/dataset.h"
#include "engine/data/metrics.h"
#include "engine/gpu/device.h"
#include "engine/plan/effect_plan.h"
#include "engine/render/renderer.h"
#include "engine/scene/merge_splats.h"
#include "engine/scene/sog.h"
#include "engine/scene/splat_model.h"
#include "tools/cost/plan_subject.h"
#include "tools/darb/flags.h"
#include "tools/darb/open_cameras.h"
#include "trainer/job/job.h"
#include "trainer/step/trainer.h"

namespace darb {

/// Refines levels on photos, and measures them on photos that are held out.
class Refiner {
  public:
    /// Loads the data set with its photos; where the source has no split, every 8th is held out.
    Refiner(const std::filesystem::path& dataset, const DatasetOptions& options);

    /// The splats after this many iterations on the photos. None are added or removed, the rates
    /// are those at the end of a long run, and kernel, footprint, degree and antialias stay.
    SplatModel refine(Device& device, const SplatModel& model, int iterations) const;
    /// The mean over the held-out photos, dB.
    double psnr_db(Device& device, const SplatModel& model) const;
    const Dataset& dataset() const { return dataset_; }

  private:
    Dataset dataset_;
    std::vector<ImageU8> photos_;
};

namespace {

constexpr double kHalf = 0.5;    // share of the previous level
constexpr int kMostLevels = 20;  // a millionth of the splats is left after so many

}  // namespace

void add_level_options(CLI::App& app, LevelFlags& flags) {
    app.add_option("--splats", flags.splats, "merge the scene to this many splats")
        ->check(above_zero());
    app.add_option("--share", flags.share,
                   "merge it to this share of its splats; with --levels, each level to this share "
                   "of the previous one (default there: 0.5)")
        ->check(CLI::Range(0.0, 1.0));
    app.add_option("--levels", flags.levels,
                   "write this many levels with fewer and fewer splats: OUT.1.ply, OUT.2.ply, ...; "
                   "for OUT/lod-meta.json, this many below the scene itself")
        ->check(CLI::Range(1, kMostLevels));
    app.add_option("--refine", flags.refine,
                   "train the merged splats for a short while on the photos of this data set");
    app.add_option("--refine-iterations", flags.iterations, "iterations of --refine")
        ->check(above_zero())
        ->capture_default_str();
    app.add_option("--refine-resolution", flags.data.resolution,
                   "size of its photos, as -r of darb train")
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

/// The refiner of --refine, and how near all splats come to the photos.
struct Refinement {
    Refinement(const LevelFlags& from, const SplatModel& model, const std::string& select)
        : flags(from), refiner(from.refine, from.data), device(command_device(select)) {
        photos_db = refiner.psnr_db(device, model);
    }
    void refine(SplatModel& level, Row& row) {
        row.photos_db = refiner.psnr_db(device, level);
        SplatModel refined = refiner.refine(device, level, flags.iterations);
        row.refined_db = refiner.psnr_db(device, refined);
        if (row.refined_db < row.photos_db) {  // the 3D filter of anti-aliasing is applied twice
            row.refined_db = row.photos_db;
            return;
        }
        level = std::move(refined);
    }

    const LevelFlags& flags;
    Refiner refiner;
    Device device;
    double photos_db = 0;  // PSNR of the whole model on the held-out photos
};

/// Writes all levels as one scene. rows: one for the model and one for each level.
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

namespace {

constexpr double kEqualDb = 100;

}  // namespace

std::string difference_text(const SceneDifference& d, std::size_t views) {
    return fmt::format("{:.2f} dB mean over {} views, {:.2f} dB at worst ({})", d.mean_psnr_db,
                       views, d.worst_psnr_db, printable(d.worst_view));
}

std::vector<View> views_around(const SplatModel& scene) {
    if (scene.size() == 0) throw Error("scene", "there are no splats to look at", "Name another.");
    const CostViews around = orbit_views(scene, 8, 480, 360);
    std::vector<View> views(around.cameras.size());
    for (std::size_t i = 0; i < views.size(); ++i) {
        views[i].name = around.names[i];
        views[i].camera = around.cameras[i];
    }
    return views;
}

SceneDifference compare_scenes(const SplatModel& scene, const SplatModel& other,
                               const std::vector<View>& views, const std::string& device) {
    DeviceOptions options = command_device(device);
    Device chosen(options);
    Renderer first(chosen, scene), second(chosen, other);
    SceneDifference difference{0, 1e9, ""};
    for (const View& view : views) {
        const double db =
            std::min(psnr(second.render(view.camera), first.render(view.camera)), kEqualDb);
        difference.mean_psnr_db += db / static_cast<double>(views.size());
        if (db >= difference.worst_psnr_db) continue;
        difference.worst_psnr_db = db;
        difference.worst_view = view.name;
    }
    return difference;
}

namespace {

// The rates with which 3DGS ends: the splats are in place and only settle.
constexpr float kPositionRate = 1.6e-5f, kLastPositionRate = 1.6e-6f;

TrainRequest refine_request(const SplatModel& model, int iterations) {
    TrainRequest request;
    TrainOptions& t = request.train;
    t.iterations = iterations;
    t.kernel = model.kernel;
    t.footprint = model.footprint;
    t.sh_degree = model.sh_degree;
    return request;
}

// Applied after the plan of effects, which is that of a run from points.
void keep_splats_as_they_are(const SplatModel& model, TrainOptions& t) {
    t.antialias = model.antialias;
    t.probe_sh = false;
    t.sh_degree = model.sh_degree;
    t.sh_interval = 1;
    t.densify_until = 0;
    t.resolution_ramp = false;
    t.speed_up_short_runs = t.speed_up_sh_rest = false;
    t.position_lr_init = kPositionRate;
    t.position_lr_final = kLastPositionRate;
    t.opacity_weight = t.scale_weight = 0;
    t.exposure = false;
}

}  // namespace

Refiner::Refiner(const std::filesystem::path& dataset, const DatasetOptions& options) {
    DatasetOptions with_split = options;
    with_split.hold_out = true;
    dataset_ = load_dataset(dataset, with_split);
    say_notes(dataset_.notes);
    bool trains = false, tests = false;
    for (const View& view : dataset_.views) (view.is_test ? tests : trains) = true;
    if (!trains || !tests)
        throw Error(dataset.string(), "has no photos both to train on and to hold out",
                    "Refine with at least nine photos, or leave out --refine.");
    photos_ = load_photos(dataset_.views);
}

SplatModel Refiner::refine(Device& device, const SplatModel& model, int iterations) const {
    TrainJob job = resolve(refine_request(model, iterations), dataset_, photos_);
    keep_splats_as_they_are(model, job.options);
    Trainer trainer(device, job.dataset, photos_, model, job.options);
    while (trainer.iteration() < iterations) trainer.step();
    trainer.drain();
    return trainer.model();
}

double Refiner::psnr_db(Device& device, const SplatModel& model) const {
    std::vector<View> views = dataset_.views;
    const EffectPlan plan = plan_rendering(model, views, {});
    apply_plan(plan, views);
    Renderer renderer(device, model, {}, plan.projection(), plan.huge_splat_path());
    double sum = 0;
    int count = 0;
    for (std::size_t i = 0; i < views.size(); ++i) {
        if (!views[i].is_test) continue;
        const ImageF picture = renderer.render(views[i].camera);
        const double db =
            compare_view(views[i].name, picture, photos_[i], glm::vec3(0), dataset_.alpha_is_mask)
                .psnr_db;
        if (std::isnan(db)) continue;  // everything is masked
        sum += db;
        ++count;
    }
    return count > 0 ? sum / count : std::nan("");
}

}  // namespace darb
