// SPDX-License-Identifier: MIT
#include "tools/cost/train_cost.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <map>

#include "engine/check/device_walk.h"
#include "engine/core/error.h"
#include "engine/reference/reference_loss.h"
#include "engine/report/html.h"
#include "tools/cost/cost_report.h"
#include "trainer/growth/initial_model.h"
#include "trainer/options/schedule.h"
#include "trainer/options/strategy.h"
#include "trainer/run/run_report.h"
#include "trainer/step/checkpoint.h"
#include "trainer/step/rank_group.h"
#include "trainer/step/trainer.h"

namespace darb {

namespace {

using Clock = std::chrono::steady_clock;

constexpr double kBelow[] = {3, 1, 0.3};  // dB below the end of balanced
constexpr size_t kGradientPhotos = 3;

struct TrainedRun {
    double ms = 0;
    std::vector<std::pair<double, double>> curve;  // (seconds, PSNR)
    SplatModel model;
};

// What training does besides the accuracy settings that changes a gradient or a picture, each
// reversed.
std::vector<TrainCostRow> departures(const Schedule& schedule) {
    const TrainOptions& options = schedule.options;
    std::vector<TrainCostRow> rows;
    const auto add = [&](std::string name, std::function<void(TrainOptions&)> change) {
        rows.emplace_back();
        rows.back().name = std::move(name);
        rows.back().change = std::move(change);
    };
    for (int degree = 0; degree <= options.sh_degree; ++degree)
        if (options.probe_sh || degree < options.sh_degree)
            add(fmt::format("sh degree {} by the iteration", degree),
                [degree, every = schedule.degree_interval](TrainOptions& o) {
                    o.sh_degree = degree;
                    o.sh_interval = std::max(1, std::min(every, o.iterations / 8));
                    o.probe_sh = false;
                });
    add(options.antialias ? "without antialias" : "with antialias",
        [](TrainOptions& o) { o.antialias = !o.antialias; });
    add(options.exposure ? "without exposure" : "with exposure",
        [](TrainOptions& o) { o.exposure = !o.exposure; });
    if (options.depth) add("without measured depths", [](TrainOptions& o) { o.depth = false; });
    if (options.surface)
        add("without terms of surfaces", [](TrainOptions& o) { o.surface = false; });
    add(options.resolution_ramp ? "without resolution ramp" : "with resolution ramp",
        [](TrainOptions& o) { o.resolution_ramp = !o.resolution_ramp; });
    if (options.sh_degree > 0)
        add(schedule.rest_every > 1 ? "harmonics step in every iteration"
                                    : "harmonics step in every 16th",
            [every = schedule.rest_every > 1 ? 1 : 16](TrainOptions& o) {
                o.sh_rest_every = every;
            });
    if (options.random_background)
        add("one background", [](TrainOptions& o) { o.random_background = false; });
    if (options.opacity_weight > 0 || options.scale_weight > 0)
        add("no regularisers", [](TrainOptions& o) { o.opacity_weight = o.scale_weight = 0; });
    if (options.clearance > 0)
        add("splats beside photos", [](TrainOptions& o) { o.clearance = 0; });
    if (schedule.speedup > 1)
        add("rates and rounds of a long run",
            [](TrainOptions& o) { o.speed_up_short_runs = false; });
    TrainOptions late = options;
    late.late_resets = true;
    const bool follows_3dgs = strategy_row(options.strategy).follows_3dgs;
    if (follows_3dgs && Schedule(late).resets.last != schedule.resets.last)
        add("late opacity resets", [](TrainOptions& o) { o.late_resets = true; });
    if (follows_3dgs) add("schedule of 3DGS", [](TrainOptions& o) { use_3dgs_schedule(o); });
    return rows;
}

}  // namespace

std::vector<TrainCostRow> training_rows(const Device& device, const Schedule& schedule) {
    const TrainOptions& options = schedule.options;
    std::vector<TrainCostRow> rows(1);
    for (int s = 0; s < kAccuracyCount; ++s) {
        // one of the departures, because it has its own schedule in training
        if (s == kShDegree) continue;
        for (size_t c = 1; c < accuracy_settings()[s].choices.size(); ++c) {
            TrainCostRow row;
            row.accuracy.choice[s] = static_cast<int>(c);
            if (!row.accuracy.of(s).in_training) continue;
            if (s == kEvaluation && !changes_evaluation(device, row.accuracy, options.kernel))
                continue;
            if (s == kFootprint && (row.accuracy.value(s) == FOOTPRINT_PSI ||  // the default
                                    !has_exact_footprint(options.kernel)))
                continue;
            if (s == kArithmetic &&
                !(device.info().half_arithmetic && has_half_blend(options.kernel)))
                continue;
            rows.push_back(row);
        }
    }
    for (const int preset : {int(kFast), int(kExact)}) {
        TrainCostRow row;
        row.accuracy = preset_accuracy(preset, true);
        rows.push_back(row);
    }
    for (TrainCostRow& row : rows) row.name = accuracy_text(row.accuracy);
    for (TrainCostRow& row : departures(schedule)) rows.push_back(std::move(row));
    return rows;
}

namespace {

TrainOptions with(TrainOptions options, const TrainCostRow& row, int seed) {
    if (row.change) {
        row.change(options);
    } else {
        options.accuracy = row.accuracy;
        if (row.accuracy.value(kFootprint) == FOOTPRINT_EXACT &&
            has_exact_footprint(options.kernel))
            options.footprint = Footprint::exact;
    }
    options.seed += static_cast<std::uint64_t>(seed);
    return options;
}

TrainedRun train_once(Device& device, const Dataset& dataset, const std::vector<ImageU8>& photos,
                      const TrainOptions& options, int evaluations) {
    Trainer trainer(device, dataset, photos, initial_model(dataset, options), options);
    TrainedRun run;
    double seconds = 0;
    for (int e = 1; e <= evaluations; ++e) {
        const int until = options.iterations * e / evaluations;
        const auto start = Clock::now();
        while (trainer.iteration() < until) trainer.step();
        trainer.drain();
        seconds += std::chrono::duration<double>(Clock::now() - start).count();
        run.curve.emplace_back(seconds, evaluate_held_out(trainer, dataset, photos).psnr_db);
    }
    run.ms = 1e3 * seconds / options.iterations;
    run.model = trainer.model();
    return run;
}

/// The time at which the curve first crosses a PSNR, linear between evaluations; < 0: never.
double seconds_to(const std::vector<std::pair<double, double>>& curve, double psnr_db) {
    for (size_t i = 0; i < curve.size(); ++i) {
        if (curve[i].second < psnr_db) continue;
        if (i == 0) return curve[0].first;
        const double t = (psnr_db - curve[i - 1].second) / (curve[i].second - curve[i - 1].second);
        return curve[i - 1].first + t * (curve[i].first - curve[i - 1].first);
    }
    return -1;
}

/// Indices of views, in their order.
std::vector<size_t> views_of(const Dataset& dataset, bool test) {
    std::vector<size_t> views;
    for (size_t i = 0; i < dataset.views.size(); ++i)
        if (dataset.views[i].is_test == test) views.push_back(i);
    if (views.empty())
        throw Error(dataset.root.string(),
                    test ? "holds out no photo to measure on" : "has no photo to train on",
                    "Use a data set with at least two photos.");
    return views;
}

/// Gradients of a trained scene for the losses of some photos, compared with those in double
/// precision at the most accurate settings, which are computed once for each footprint.
class GradientErrors {
  public:
    GradientErrors(Device& device, SplatModel model, const Dataset& dataset,
                   const std::vector<ImageU8>& photos, const TrainOptions& options)
        : device_(device), model_(std::move(model)) {
        const glm::vec3 background(options.white_background ? 1.0f : 0.0f);
        exact_.background = background;
        exact_.alpha_cutoff = static_cast<float>(preset_accuracy(kExact).value(kAlphaCutoff));
        exact_.transmittance_stop =
            static_cast<float>(preset_accuracy(kExact).value(kTransmittanceStop));
        lambda_dssim_ = options.dssim_weight();
        const std::vector<size_t> views = views_of(dataset, false);
        const size_t count = std::min(views.size(), kGradientPhotos);
        for (size_t k = 0; k < count; ++k) {
            const size_t view = views[k * views.size() / count];
            photos_.push_back({dataset.views[view].camera, composite(photos[view], background)});
        }
    }

    Spread of(const Accuracy& accuracy) {
        const FrameAccuracy frame = frame_accuracy(accuracy, model_);
        model_.footprint = frame.footprint;
        check::WalkSettings walk;
        walk.background = exact_.background;
        walk.evaluation = frame.options.evaluation;
        walk.polynomial_degree = frame.options.polynomial_degree;
        walk.storage = frame.options.storage;
        walk.depth_order = frame.options.depth_order;
        walk.projection = frame.options.projection;
        walk.arithmetic = frame.options.arithmetic;
        walk.alpha_cutoff = frame.options.alpha_cutoff;
        walk.transmittance_stop = frame.options.transmittance_stop;
        std::vector<double> errors;
        for (Photo& photo : photos_) {
            const Truth& truth = truth_of(photo);
            const auto got =
                check::walk_on_device(device_, model_, photo.camera, truth.d_image, walk);
            errors.push_back(distance(truth.walk.d, got.d));
        }
        return spread_of(std::move(errors));
    }

  private:
    struct Truth {
        Image<double> d_image;
        check::WalkTruth walk;
    };
    struct Photo {
        Camera camera;
        ImageF target;
        std::map<Footprint, Truth> truths = {};
    };

    const Truth& truth_of(Photo& photo) {
        const auto found = photo.truths.find(model_.footprint);
        if (found != photo.truths.end()) return found->second;
        Image<double> wanted(photo.target.width, photo.target.height, 3), shown = wanted;
        std::copy(photo.target.data.begin(), photo.target.data.end(), wanted.data.begin());
        shown.data = check::walk_in_double(model_, photo.camera, {}, exact_).image;
        Truth truth{reference::loss(shown, wanted, {lambda_dssim_}).d_image, {}};
        truth.walk = check::walk_in_double(model_, photo.camera, truth.d_image, exact_);
        return photo.truths.emplace(model_.footprint, std::move(truth)).first->second;
    }

    /// |g - g*| / |g*|, mean over the kinds of parameters that have a gradient.
    template <class Gradients, class Others>
    static double distance(const Gradients& truth, const Others& got) {
        double off = 0;
        int attributes = 0;
        for (int a = 0; a < kAttributeCount; ++a) {
            double difference = 0, size = 0;
            for (size_t i = 0; i < truth[a].size(); ++i) {
                const double e = truth[a][i] - got[a][i];
                difference += e * e;
                size += truth[a][i] * truth[a][i];
            }
            if (!(size > 0)) continue;
            off += std::sqrt(difference / size);
            ++attributes;
        }
        return off / std::max(attributes, 1);
    }

    Device& device_;
    SplatModel model_;
    check::WalkSettings exact_;
    float lambda_dssim_ = 0;
    std::vector<Photo> photos_;
};

// [row][seed]. On the first rank, this process does the first run itself and keeps only its splats.
std::vector<std::vector<TrainedRun>> train_by_turns(
    Device& device, const Dataset& dataset, const std::vector<ImageU8>& photos,
    const TrainOptions& options, const TrainCostPlan& plan, const std::vector<TrainCostRow>& rows,
    const std::function<void(const std::string&)>& progress) {
    OneRank alone;
    Ranks& ranks = plan.ranks ? *plan.ranks : static_cast<Ranks&>(alone);
    std::vector<double> own;  // ms and curve of each run of this rank
    SplatModel model;
    for (int seed = 0; seed < plan.seeds; ++seed)
        for (size_t r = 0; r < rows.size(); ++r) {
            const size_t item = static_cast<size_t>(seed) * rows.size() + r;
            if (!has_turn(ranks, item)) continue;
            progress(fmt::format("seed {} of {}, {} of {}: {}", seed + 1, plan.seeds, r + 1,
                                 rows.size(), rows[r].name));
            TrainedRun run =
                train_once(device, dataset, photos, with(options, rows[r], seed), plan.evaluations);
            own.push_back(run.ms);
            for (const auto& [seconds, psnr_db] : run.curve)
                own.insert(own.end(), {seconds, psnr_db});
            if (item == 0) model = std::move(run.model);
        }
    const size_t each = 1 + 2 * static_cast<size_t>(plan.evaluations);
    const std::vector<double> all = by_turns(ranks, own, each);
    std::vector<std::vector<TrainedRun>> runs(rows.size());
    for (size_t at = 0; at < all.size(); at += each) {
        TrainedRun run;
        run.ms = all[at];
        for (size_t e = 1; e < each; e += 2) run.curve.emplace_back(all[at + e], all[at + e + 1]);
        runs[at / each % rows.size()].push_back(std::move(run));
    }
    runs[0][0].model = std::move(model);
    return runs;
}

}  // namespace

TrainCostResult measure_train_cost(Device& device, const Dataset& dataset,
                                   const TrainOptions& options, const TrainCostPlan& plan,
                                   const std::function<void(const std::string&)>& progress) {
    TrainCostResult result;
    views_of(dataset, false);  // throws an Error before any photo is read
    views_of(dataset, true);
    const std::vector<ImageU8> photos = load_photos(dataset.views);
    if (plan.ranks && plan.ranks->count() > 1) {
        RankFacts facts = rank_facts(device);
        facts.emplace_back("data set", dataset_fingerprint(dataset, photos));
        facts.emplace_back("settings", settings_text(options));
        facts.emplace_back("seeds", std::to_string(plan.seeds));
        check_same(*plan.ranks, facts);
    }
    result.rows = training_rows(device, options);
    const std::vector<std::vector<TrainedRun>> runs =
        train_by_turns(device, dataset, photos, options, plan, result.rows, progress);
    if (plan.ranks && !plan.ranks->is_first()) return result;
    std::vector<double> ends;
    for (const TrainedRun& run : runs[0]) ends.push_back(run.curve.back().second);
    for (const double below : kBelow) result.targets.push_back(spread_of(ends).median - below);

    GradientErrors gradients(device, runs[0][0].model, dataset, photos, options);
    for (size_t r = 0; r < result.rows.size(); ++r) {
        TrainCostRow& row = result.rows[r];
        std::vector<double> ms, psnr;
        for (const TrainedRun& run : runs[r]) {
            ms.push_back(run.ms);
            psnr.push_back(run.curve.back().second);
        }
        row.ms = spread_of(ms);
        row.psnr_db = spread_of(psnr);
        for (const double target : result.targets) {
            std::vector<double> seconds;
            for (const TrainedRun& run : runs[r])
                if (const double s = seconds_to(run.curve, target); s >= 0) seconds.push_back(s);
            row.reached.push_back(static_cast<int>(seconds.size()));
            row.seconds_to.push_back(spread_of(std::move(seconds)));
        }
        row.curve = runs[r][0].curve;
        if (!row.change) row.gradient_error = gradients.of(row.accuracy);
    }
    result.seeds = plan.seeds;
    result.iterations = options.iterations;
    result.device = device.info().name;
    result.driver = device.info().driver;
    result.dataset = dataset.root.string();
    return result;
}

// The results of `darb cost --train` as a table, as JSON and as a page.

namespace {

using Json = nlohmann::json;

std::string error_text(const TrainCostRow& row) {
    return row.gradient_error ? fmt::format("{:.2e}", row.gradient_error->median) : "-";
}

std::string seconds_text(const TrainCostRow& row, size_t target, int seeds) {
    if (row.reached[target] == 0) return "-";
    std::string text = fmt::format("{:.2f}", row.seconds_to[target].median);
    if (row.reached[target] < seeds) text += fmt::format(" ({}/{})", row.reached[target], seeds);
    return text;
}

Table every_setting(const TrainCostResult& result) {
    using Kind = TableColumn::Kind;
    Table table{"settings", "Every setting", "", {}, {}};
    table.columns = {{"setting", "", Better::neither, 0, Kind::prose},
                     {"gradient error", "", Better::neither, 2, Kind::scientific},
                     {"ms an iteration", "", Better::neither, 3},
                     {"quartiles", "", Better::neither, 3},
                     {"PSNR", "dB", Better::neither, 3},
                     {"quartiles", "", Better::neither, 3}};
    for (const double target : result.targets)
        table.columns.push_back({fmt::format("s to {:.2f} dB", target)});
    for (const TrainCostRow& row : result.rows) {
        TableRow& cells = table.rows.emplace_back();
        cells.cells = {row.name,
                       row.gradient_error ? TableCell(row.gradient_error->median) : TableCell("-"),
                       row.ms.median,
                       TableCell::between(row.ms.low, row.ms.high),
                       row.psnr_db.median,
                       TableCell::between(row.psnr_db.low, row.psnr_db.high)};
        for (size_t t = 0; t < result.targets.size(); ++t)
            cells.cells.push_back(seconds_text(row, t, result.seeds));
    }
    return table;
}

}  // namespace

std::string train_cost_table(const TrainCostResult& result) {
    size_t width = 10;
    for (const TrainCostRow& row : result.rows) width = std::max(width, row.name.size());
    std::string text = fmt::format("{:<{}}  {:>9} {:>9} {:>15} {:>9} {:>15}", "setting", width,
                                   "gradient", "ms/iter", "quartiles", "PSNR dB", "quartiles");
    for (const double target : result.targets) text += fmt::format("  s to {:.2f} dB", target);
    text += "\n";
    for (const TrainCostRow& row : result.rows) {
        text += fmt::format(
            "{:<{}}  {:>9} {:>9.3f} {:>15} {:>9.3f} {:>15}", row.name, width, error_text(row),
            row.ms.median, fmt::format("{:.3f}-{:.3f}", row.ms.low, row.ms.high),
            row.psnr_db.median, fmt::format("{:.2f}-{:.2f}", row.psnr_db.low, row.psnr_db.high));
        for (size_t t = 0; t < result.targets.size(); ++t)
            text += fmt::format("  {:>13}", seconds_text(row, t, result.seeds));
        text += "\n";
    }
    return text;
}

Json train_cost_json(const TrainCostResult& result) {
    Json rows = Json::array();
    for (const TrainCostRow& row : result.rows) {
        Json choices = Json::object(), seconds = Json::array();
        for (int s = 0; s < kAccuracyCount && !row.change; ++s)
            choices[std::string(accuracy_settings()[s].name)] = row.accuracy.of(s).name;
        for (size_t t = 0; t < result.targets.size(); ++t)
            seconds.push_back({{"psnr_db", result.targets[t]},
                               {"seeds_that_reached_it", row.reached[t]},
                               {"seconds", spread_json(row.seconds_to[t])}});
        rows.push_back(
            {{"name", row.name},
             {"accuracy", choices},
             {"gradient_error", row.gradient_error ? spread_json(*row.gradient_error) : Json()},
             {"ms_per_iteration", spread_json(row.ms)},
             {"psnr_db", spread_json(row.psnr_db)},
             {"seconds_to", seconds}});
    }
    return {{"version", DARB_VERSION},
            {"device", result.device},
            {"driver", result.driver},
            {"dataset", result.dataset},
            {"seeds", result.seeds},
            {"iterations", result.iterations},
            {"rows", rows}};
}

Report train_cost_report(const TrainCostResult& result) {
    Plot ends{"Time and quality", "ms an iteration", "PSNR, held out (dB)", {}};
    ends.log_x = true;
    ends.series = {{"settings", {}, true, false, false, {}}};
    Plot gradients{"Gradients", "ms an iteration", "gradient error", {}};
    gradients.log_x = gradients.log_y = true;
    gradients.series = {{"settings", {}, true, false, false, {}}};
    Plot curves{"Held-out PSNR, first seed", "training time (s)", "PSNR (dB)", {}};
    for (const TrainCostRow& row : result.rows) {
        ends.series[0].points.emplace_back(row.ms.median, row.psnr_db.median);
        ends.series[0].titles.push_back(
            fmt::format("{}: {:.3f} ms, {:.3f} dB", row.name, row.ms.median, row.psnr_db.median));
        if (row.gradient_error) {
            gradients.series[0].points.emplace_back(row.ms.median, row.gradient_error->median);
            gradients.series[0].titles.push_back(
                fmt::format("{}: {:.3f} ms, {}", row.name, row.ms.median, error_text(row)));
        }
        const bool shown = row.accuracy == Accuracy{} ||
                           row.accuracy == preset_accuracy(kFast, true) ||
                           row.accuracy == preset_accuracy(kExact, true);
        if (shown && !row.change)
            curves.series.push_back({row.name, row.curve, true, true, false, {}});
    }
    Report report(result.dataset,
                  fmt::format("What accuracy costs in training: seeds {}, iterations {}; {}, {}",
                              result.seeds, result.iterations, result.device, result.driver));
    report.plots({{"", ends}, {"", gradients}, {"", curves}});
    report.table(every_setting(result), 2);
    report.html(
        "<h2>How to read it</h2><p>Each setting alone, the presets, and what training does "
        "beside the settings, each turned the other way; row after row within a "
        "seed, so that drift hits all alike. Quartiles over the seeds. Gradient error: "
        "|g - g*| / |g*|, mean over the kinds of parameters, median over three photos, of the "
        "scene that balanced trained, g* in double precision with the true kernel profile, "
        "cut-off 1/1024 "
        "and stop 1e-6. Seconds count training alone.</p>\n");
    return report;
}

}  // namespace darb
