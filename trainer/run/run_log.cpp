// SPDX-License-Identifier: MIT
#include "trainer/run/run_log.h"

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstring>
#include <set>

#include "engine/core/error.h"
#include "engine/core/files.h"
#include "engine/core/system.h"
#include "engine/core/text.h"
#include "engine/data/image_io.h"
#include "engine/data/run_events.h"
#include "engine/kernels/kernel_definition.h"
#include "engine/kernels/kernel_registry.h"
#include "engine/plan/effect_plan.h"
#include "engine/plan/tuner.h"
#include "trainer/options/schedule.h"
#include "trainer/options/strategy.h"
#include "trainer/run/run_folder.h"
#include "trainer/step/checkpoint.h"

namespace darb {

namespace {

using Json = nlohmann::json;

/// Names and paths may hold any bytes.
std::string text_of(const Json& json, int indent = -1) {
    return json.dump(indent, ' ', false, Json::error_handler_t::replace);
}

/// JSON writes NaN and infinity as null, which reads as NaN here; 0 where the key is missing.
double number(const Json& event, const char* key) {
    const auto at = event.find(key);
    if (at == event.end()) return 0;
    return at->is_number() ? at->get<double>() : std::nan("");
}

constexpr const char* kCullNames[CULL_REASONS] = {"near",    "rotation", "opacity", "covariance",
                                                  "outside", "colour",   "",        ""};

Json evaluation_json(const Evaluation& e) {
    Json views = Json::array();
    for (const ViewMetrics& v : e.views) {
        views.push_back({{"name", v.name}, {"psnr_db", v.psnr_db}, {"ssim", v.ssim}});
        if (v.in_arc) views.back()["in_arc"] = true;
    }
    Json json{{"event", "evaluation"}, {"iteration", e.iteration}, {"seconds", e.seconds},
              {"splats", e.splats},    {"psnr_db", e.psnr_db},     {"ssim", e.ssim},
              {"views", views}};
    if (e.arc)
        json["arc"] = {{"views", e.arc->views}, {"psnr_db", e.arc->psnr_db}, {"ssim", e.arc->ssim}};
    return json;
}

Json culled_json(const TrainCounters& counters) {
    Json culled = Json::object();
    for (int r = 0; r < CULL_REASONS; ++r)
        if (kCullNames[r][0] != 0) culled[kCullNames[r]] = counters.culled[r];
    return culled;
}

}  // namespace

std::string cfg_args(const Dataset& dataset, const TrainOptions& options,
                     const std::filesystem::path& output) {
    const std::filesystem::path images = dataset.options.images_folder;
    return fmt::format(
        "Namespace(sh_degree={}, source_path={}, model_path={}, images={}, "
        "resolution={}, white_background={}, data_device='cpu', eval={})",
        options.sh_degree, python_string(seen_from(output, dataset.root).generic_string()),
        python_string("."),
        python_string(
            (images.is_absolute() ? seen_from(dataset.root, images) : images).generic_string()),
        dataset.options.resolution, options.white_background ? "True" : "False",
        std::any_of(dataset.views.begin(), dataset.views.end(),
                    [](const View& v) { return v.is_test; })
            ? "True"
            : "False");
}

void RunLog::open() {
    const auto path = folder_ / "run.jsonl";
    file_ = File(path, File::Open::append);
    if (!file_.is_open())
        throw Error(path.string(), "cannot be written: " + file_.error().message(),
                    "Choose another output folder with -o.");
}

void RunLog::begin() {
    std::error_code ignored;
    std::filesystem::create_directories(folder_, ignored);
    write_file_atomic(folder_ / "run.jsonl", std::string_view());
    open();
}

void RunLog::go_on(int iteration) {
    events_ = read_events(folder_ / "run.jsonl");
    std::erase_if(events_, [&](const Json& e) { return e.value("iteration", 0) > iteration; });
    std::string text;
    for (const Json& e : events_) text += text_of(e) + "\n";
    write_file_atomic(folder_ / "run.jsonl", text);
    open();
}

std::string RunLog::shared_text(const std::string& text) const {
    return without_folders(without_folders(text, root_), folder_);
}

void RunLog::write(const Json& event) {
    const std::string line = text_of(event) + "\n";
    if (!file_.write(std::as_bytes(std::span(line))))
        throw Error((folder_ / "run.jsonl").string(),
                    "cannot be written: " + file_.error().message(),
                    "Free space; the last checkpoint is intact, go on with --resume.");
    events_.push_back(event);
}

void RunLog::start(const Device& device, const DeviceRates& rates, const Dataset& dataset,
                   const Schedule& schedule, std::uint32_t splats, const std::string& effects_json,
                   const std::optional<PaceForecast>& pace) {
    const TrainOptions& options = schedule.options;
    root_ = dataset.root;
    std::vector<std::string> notes;
    for (const std::string& note : dataset.notes) notes.push_back(shared_text(note));
    rates_ = rates;
    counts_.rest_every = schedule.rest_every;
    const auto held_out = std::ranges::count_if(dataset.views, &View::is_test);
    start_ = {{"event", "start"},
              {"version", DARB_VERSION},
              {"device", device.info().name},
              {"driver", device.info().driver},
              {"tuning", names_text(tuning_names(device.tuning()))},
              {"dataset", shared_name(folder_, dataset.root)},
              {"source", dataset.source},
              {"notes", notes},
              {"train_views", dataset.views.size() - held_out},
              {"held_out_views", held_out},
              {"hold_out", dataset.options.hold_out ? hold_out_text(dataset.options.held_out) : ""},
              {"splats", splats},
              {"strategy", strategy_name(options.strategy)},
              {"copy_bytes_per_s", rates_.bytes_per_s},
              {"fma_per_s", rates_.fma_per_s},
              {"settings", Json::parse(settings_text(schedule))}};
    if (!effects_json.empty()) start_["effects"] = Json::parse(effects_json);
    if (pace) start_["forecast"] = pace_json(*pace);
    write(start_);
}

std::optional<PaceForecast> RunLog::pace() const {
    for (const Json& e : events_)
        if (e.value("event", "") == "start" && e.contains("forecast")) try {
                return pace_from_json(e["forecast"]);
            } catch (const Json::exception&) {  // written by something else: as if there were none
            }
    return std::nullopt;
}

namespace {

// Floats to six digits: 0.01 rather than 0.009999999776.
std::string setting_text(const Json& value) {
    if (value.is_string()) return value.get<std::string>();
    if (value.is_number_float()) return fmt::format("{:.6g}", value.get<double>());
    if (!value.is_array()) return text_of(value);
    std::string text;
    for (const Json& item : value) text += (text.empty() ? "" : ", ") + setting_text(item);
    return text;
}

}  // namespace

void RunLog::resolution(int iteration, int divisor) {
    write({{"event", "resolution"}, {"iteration", iteration}, {"divisor", divisor}});
}

std::string probe_text(const Trainer::Probe& probe) {
    const bool shutter = probe.effect == EFFECT_SHUTTER;
    const std::string reason = !std::isnan(probe.gain_db)
                                   ? fmt::format("{:+.3f} dB on photos set aside", probe.gain_db)
                               : probe.admitted && probe.degree > 1 ? "follows the first"
                               : probe.admitted || shutter ? "too few photos to set some aside"
                                                           : "--max-memory has no room for it";
    return fmt::format(
        "iteration {}: {} {} ({})", probe.iteration,
        shutter ? "rolling shutters" : fmt::format("colour of degree {}", probe.degree),
        probe.admitted ? "admitted" : "refused", reason);
}

void RunLog::probe(int iteration, const Trainer::Probe& probe) {
    write({{"event", "probe"},
           {"iteration", iteration},
           {"after", probe.iteration},
           {"effect", effect_name(probe.effect)},
           {"degree", probe.degree},
           {"gain_db", probe.gain_db},
           {"admitted", probe.admitted},
           {"text", probe_text(probe)}});
}

void RunLog::growth_stopped(int iteration, const char* limit, std::uint32_t splats) {
    write({{"event", "growth_stopped"},
           {"iteration", iteration},
           {"limit", limit},
           {"splats", splats}});
}

void RunLog::mean_left_out(int iteration) {
    write({{"event", "mean_left_out"}, {"iteration", iteration}});
}

void RunLog::look(int iteration, double psnr_db) {
    write({{"event", "look"}, {"iteration", iteration}, {"psnr_db", psnr_db}});
}

void RunLog::ends_early(int iteration, int end, const std::string& reason) {
    write({{"event", "ends_early"}, {"iteration", iteration}, {"end", end}, {"reason", reason}});
}

void RunLog::cleaned(int iteration, const Clutter& clutter, double psnr_before, double psnr_after) {
    nlohmann::json rules = nlohmann::json::array();
    const auto add = [&rules](const ClutterOfRule& rule) {
        rules.push_back(
            {{"rule", rule.rule}, {"splats", count_of(rule.set)}, {"light_share", rule.light}});
    };
    for (const ClutterOfRule& rule : clutter.rules) add(rule);
    if (clutter.rules.size() > 1) add(clutter.together);
    write({{"event", "cleaned"},
           {"iteration", iteration},
           {"rules", rules},
           {"psnr_before", psnr_before},
           {"psnr_after", psnr_after}});
}

void RunLog::changed(int iteration, const std::string& what, const Schedule& now) {
    write({{"event", "changed"},
           {"iteration", iteration},
           {"what", what},
           {"settings", Json::parse(settings_text(now))}});
}

void RunLog::failure(int iteration, const std::string& what) {
    try {
        write({{"event", "failure"}, {"iteration", iteration}, {"what", shared_text(what)}});
    } catch (const Error&) {  // a full disk, which may be the failure itself
    }
}

void RunLog::iteration(const IterationResult& r, const TrainCounters& counters, double seconds,
                       const std::vector<PassTotal>& totals) {
    counts_.splats += r.splats;
    counts_.visible += r.visible;
    counts_.intersections += r.intersections;
    counts_.pixels += r.pixels;
    counts_.rest_floats += r.rest_floats;
    ++counted_;
    loss_sum_ += r.loss;
    psnr_sum_ += r.psnr_db;
    ++summed_;
    if (r.iteration % kLogInterval != 0) return;
    Json passes = Json::object();
    for (size_t p = 0; p < totals.size(); ++p) {
        const double before = p < written_.size() ? written_[p].ms : 0;
        passes[totals[p].name] = (totals[p].ms - before) / summed_;
    }
    written_ = totals;
    write({{"event", "iteration"},
           {"iteration", r.iteration},
           {"seconds", seconds},
           {"loss", loss_sum_ / summed_},
           {"psnr_db", psnr_sum_ / summed_},
           {"splats", r.splats},
           {"visible", r.visible},
           {"pairs", r.intersections},
           {"bad_gradients", counters.bad_gradients},
           {"overflows", counters.overflows},
           {"redone_iterations", counters.redone_iterations},
           {"culled_splat_frames", culled_json(counters)},
           {"passes_ms", passes}});
    loss_sum_ = psnr_sum_ = 0;
    summed_ = 0;
}

void RunLog::evaluation(const Evaluation& evaluation) {
    write(evaluation_json(evaluation));
}

void add_events(const std::vector<Json>& events, ReportData& data) {
    std::string sizes;  // the photos' sizes, where they changed
    for (const Json& e : events) {
        const std::string kind = e.value("event", "");
        if (kind == "iteration") {
            ReportSample sample{e.value("iteration", 0), number(e, "seconds"), number(e, "loss"),
                                number(e, "psnr_db"), e.value("splats", 0u)};
            const Json passes = e.value("passes_ms", Json::object());
            if (!passes.empty())
                for (const ReportPass& pass : data.passes)
                    sample.pass_ms.push_back(number(passes, pass.name.c_str()));
            data.samples.push_back(std::move(sample));
        }
        if (kind == "evaluation" && e.contains("views") && !e["views"].empty())
            data.evaluations.push_back({e.value("iteration", 0), number(e, "seconds"),
                                        number(e, "psnr_db"), number(e, "ssim"),
                                        e.value("splats", 0u)});
        if (const Json arc = e.value("arc", Json::object()); kind == "evaluation" && !arc.empty())
            data.arcs.push_back({e.value("iteration", 0), number(arc, "psnr_db"),
                                 number(arc, "ssim"), arc.value("views", 0u)});
        if (kind == "changed")
            data.notes.push_back(fmt::format("After iteration {} settings were changed: {}.",
                                             e.value("iteration", 0), e.value("what", "")));
        if (kind == "ends_early")
            data.notes.push_back(fmt::format("The run ended itself at iteration {}: {}.",
                                             e.value("end", 0), e.value("reason", "")));
        if (kind == "resolution") {
            const int divisor = e.value("divisor", 1);
            sizes += fmt::format("{}{} from iteration {}", sizes.empty() ? "" : ", ",
                                 divisor == 1 ? "whole" : fmt::format("1/{} of the sides", divisor),
                                 e.value("iteration", 0));
        }
    }
    if (!sizes.empty())
        data.notes.push_back("Photos: " + sizes +
                             "; loss and PSNR of the training photos jump where these change.");
}

ReportData RunLog::report_data(const TrainResult& summary) const {
    ReportData data;
    data.title = std::filesystem::path(start_.value("dataset", "")).filename().string();
    data.device = start_.value("device", "") + ", " + start_.value("driver", "");
    data.passes = summary.passes;
    add_events(events_, data);
    if (rates_.bytes_per_s > 0)
        data.notes.push_back(fmt::format(
            "Roofline: bytes and multiply-adds of a pass, estimated from counts, at the rates "
            "measured at the start: {:.1f} GB/s of copies, {:.1f} billion multiply-adds a second.",
            1e-9 * rates_.bytes_per_s, 1e-9 * rates_.fma_per_s));
    data.settings.emplace_back("strategy",
                               start_.value("strategy", std::string(strategy_name(Strategy{}))));
    Json settings = start_.value("settings", Json::object());
    for (const Json& e : events_)
        if (e.value("event", "") == "changed") settings = e.value("settings", settings);
    for (const auto& [name, value] : settings.items())
        if (name != "effects" && name != "strategy")
            data.settings.emplace_back(name, setting_text(value));
    for (const Json& effect : start_.value("effects", Json::array()))
        data.settings.emplace_back(
            "effect " + effect.value("effect", ""),
            (effect.value("on", false) ? "on: " : "off: ") + effect.value("reason", ""));
    data.pictures = summary.pictures;
    for (const Json& note : start_.value("notes", Json::array()))
        data.notes.push_back(note.get<std::string>());
    for (const Json& e : events_)
        if (e.value("event", "") == "probe" && e.contains("text"))  // earlier versions have none
            data.notes.push_back(e.value("text", ""));
    return data;
}

std::vector<ReportPass> RunLog::passes(const Trainer& trainer) const {
    std::vector<ReportPass> passes;
    FrameCounts mean = counts_;
    for (double* sum :
         {&mean.splats, &mean.visible, &mean.intersections, &mean.pixels, &mean.rest_floats})
        *sum /= std::max(counted_, 1.0);
    for (const PassTotal& p : trainer.pass_totals()) {
        const double ms = p.ms / std::max<double>(1.0, double(trainer.timed_iterations()));
        ReportPass pass{p.name, ms, std::nullopt};
        if (const auto work = pass_work(p.name, mean))
            pass.roofline = roofline_share(*work, rates_, ms);
        passes.push_back(std::move(pass));
    }
    return passes;
}

namespace {

// Events of earlier versions name no effect.
bool is_probe_of(int effect, const Json& e) {
    return e.value("event", "") == "probe" &&
           e.value("effect", std::string(effect_name(EFFECT_VIEW_COLOUR))) == effect_name(effect);
}

Json probes_of(const std::vector<Json>& events) {
    Json probes = Json::array();
    for (const Json& e : events)
        if (is_probe_of(EFFECT_VIEW_COLOUR, e))
            probes.push_back({{"iteration", e.value("after", 0)},
                              {"degree", e.value("degree", 0)},
                              {"gain_db", number(e, "gain_db")},
                              {"admitted", e.value("admitted", false)}});
    return probes;
}

/// The last probe of shutters that roll; null: there was none.
Json shutter_probe_of(const std::vector<Json>& events) {
    Json found;
    for (const Json& e : events)
        if (is_probe_of(EFFECT_SHUTTER, e))
            found = {{"iteration", e.value("after", 0)},
                     {"gain_db", number(e, "gain_db")},
                     {"admitted", e.value("admitted", false)}};
    return found;
}

Json changes_of(const std::vector<Json>& events) {
    Json changes = Json::array();
    for (const Json& e : events)
        if (e.value("event", "") == "changed") changes.push_back(e);
    return changes;
}

/// The splats at which a limit stopped the growth last; 0: it did not.
std::uint32_t stopped_by(const std::vector<Json>& events, const char* limit) {
    std::uint32_t splats = 0;
    for (const Json& e : events)
        if (e.value("event", "") == "growth_stopped" && e.value("limit", "") == limit)
            splats = e.value("splats", 0u);
    return splats;
}

}  // namespace

std::filesystem::path RunLog::finish(const TrainResult& summary, const Trainer& trainer,
                                     const Device& device, bool with_report) {
    const TrainCounters& c = trainer.counters();
    Json passes = Json::array();
    for (const ReportPass& pass : summary.passes) {
        passes.push_back({{"name", pass.name}, {"ms", pass.ms}});
        if (pass.roofline) passes.back()["roofline"] = *pass.roofline;
    }
    Json evaluations = Json::array();
    for (const Json& e : events_)
        if (e.value("event", "") == "evaluation") evaluations.push_back(e);
    Json metrics{{"start", start_},
                 {"iteration", summary.iteration},
                 {"interrupted", summary.interrupted},
                 {"seconds", summary.seconds},
                 {"ms_per_iteration", summary.seconds * 1000.0 / std::max(summary.iteration, 1)},
                 {"splats", trainer.splat_count()},
                 {"saved_splats", summary.saved},
                 {"undrawn_splats", summary.undrawn},
                 {"dropped_splats", c.undrawn},
                 {"strategy", start_.value("strategy", std::string(strategy_name(Strategy{})))},
                 {"passes_ms", passes},
                 {"peak_device_bytes", device.peak_bytes()},
                 {"planned_device_bytes", trainer.planned_bytes()},
                 {"peak_host_bytes", peak_memory_bytes()},
                 {"redone_iterations", c.redone_iterations},
                 {"overflows", c.overflows},
                 {"longest_list", c.longest_list},
                 {"huge_splats", c.huge_splats},
                 {"most_pairs", c.most_intersections},
                 {"splats_stopped_by_memory", stopped_by(events_, "memory")},
                 {"splats_stopped_by_pairs", stopped_by(events_, "pairs")},
                 {"bad_gradients", c.bad_gradients},
                 {"cloned_or_split", c.cloned_or_split},
                 {"pruned", c.pruned},
                 {"culled_splat_frames", culled_json(c)},
                 {"effects", start_.value("effects", Json::array())},
                 {"sh_probes", probes_of(events_)},
                 {"sh_degree", trainer.sh_degree()},
                 {"evaluations", evaluations}};
    if (trainer.schedule().options.learn_kernel > 0)
        if (const KernelDefinition* own = kernel_definition(trainer.kernel()))
            metrics["kernel_definition"] = definition_json(*own);
    if (const Json changes = changes_of(events_); !changes.empty()) metrics["changes"] = changes;
    if (const Json probe = shutter_probe_of(events_); !probe.is_null())
        metrics["shutter_probe"] = probe;
    if (!summary.ended_early.empty()) metrics["ended_early"] = summary.ended_early;
    if (const std::optional<CameraMoves> m = trainer.camera_moves()) {
        metrics["cameras"] = {{"refined", m->cameras},
                              {"median_px", m->median_px},
                              {"largest_px", m->largest_px},
                              {"median_degrees", m->median_degrees},
                              {"largest_degrees", m->largest_degrees},
                              {"largest_focal_share", m->largest_focal},
                              {"largest_centre_px", m->largest_centre_px}};
        if (m->shutters) {
            metrics["cameras"]["median_rolled_px"] = m->median_rolled_px;
            metrics["cameras"]["largest_rolled_px"] = m->largest_rolled_px;
        }
    }
    write_file_atomic(folder_ / "metrics.json", text_of(metrics, 2) + "\n");
    if (!with_report) return {};
    const auto report = folder_ / "report.html";
    write_report(report, report_data(summary));
    return report;
}

namespace {

std::vector<ReportPass> passes_of(const Json& metrics) {
    std::vector<ReportPass> passes;
    for (const Json& p : metrics.value("passes_ms", Json::array())) {
        passes.push_back({p.value("name", ""), number(p, "ms"), std::nullopt});
        if (p.contains("roofline")) passes.back().roofline = number(p, "roofline");
    }
    return passes;
}

// Those of the last evaluation that are still there, under the names that they were written with.
std::vector<ReportPicture> pictures_of(const Json& evaluation, const std::filesystem::path& root) {
    std::vector<ReportPicture> pictures;
    std::set<std::string> used;
    const auto folder = root / std::to_string(evaluation.value("iteration", 0));
    for (const Json& view : evaluation.value("views", Json::array())) {
        const std::string name = view.value("name", "");
        const auto file = folder / picture_name(name, used);
        if (std::filesystem::exists(file))
            pictures.push_back({name, file, number(view, "psnr_db"), number(view, "ssim")});
    }
    return pictures;
}

}  // namespace

std::filesystem::path RunLog::report_again() {
    const Json metrics = read_metrics(folder_ / "metrics.json");
    start_ = metrics.value("start", Json::object());
    rates_.bytes_per_s = number(start_, "copy_bytes_per_s");
    rates_.fma_per_s = number(start_, "fma_per_s");
    TrainResult summary;
    summary.passes = passes_of(metrics);
    if (const Json list = metrics.value("evaluations", Json::array()); !list.empty())
        summary.pictures = pictures_of(list.back(), folder_ / "held_out");
    const auto report = folder_ / "report.html";
    write_report(report, report_data(summary));
    return report;
}

}  // namespace darb
