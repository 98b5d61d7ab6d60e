// SPDX-License-Identifier: MIT
#include "tools/paper/compare_merge.h"

#include <fmt/format.h>
#include <algorithm>
#include <cmath>
#include <optional>
#include <set>
#include <utility>

#include "engine/core/error.h"
#include "engine/core/files.h"
#include "engine/core/json_text.h"
#include "engine/data/image_io.h"
#include "engine/report/html.h"
#include "tools/paper/compare_stats.h"

namespace darb {

namespace fs = std::filesystem;

namespace {

using Json = nlohmann::json;

constexpr const char* kNoReport =
    "Name a compare.json of darb compare. One of an earlier version is made again by the same "
    "command, which trains nothing anew.";

// JSON has null in place of NaN and infinity.
double number_or_nan(const Json& json, const char* key) {
    const Json& v = json.at(key);
    return v.is_null() ? std::nan("") : v.get<double>();
}

std::optional<double> optional_number(const Json& json, const char* key) {
    const auto at = json.find(key);
    return at == json.end() || at->is_null() ? std::nullopt : std::optional(at->get<double>());
}

ComparedAt parse_at(const Json& json, const fs::path& folder) {
    ComparedAt at;
    at.iteration = json.at("iteration");
    at.seconds = number_or_nan(json, "training_s");
    at.psnr_db = number_or_nan(json, "psnr_db");
    at.ssim = number_or_nan(json, "ssim");
    at.lpips = optional_number(json, "lpips");
    at.flip = optional_number(json, "flip");
    at.splats = json.at("splats");
    at.model_mb = optional_number(json, "model_mb");
    at.arc_db = optional_number(json, "arc_psnr_db");
    at.off_path_db = optional_number(json, "off_path_psnr_db");
    std::set<std::string> used;
    const fs::path pictures = folder / "held_out" / std::to_string(at.iteration);
    for (const Json& v : json.at("views")) {
        const std::string name = v.at("name");
        at.views.push_back({name, number_or_nan(v, "psnr_db"), number_or_nan(v, "ssim"),
                            optional_number(v, "lpips"), pictures / picture_name(name, used),
                            optional_number(v, "flip")});
    }
    for (const Json& s : json.at("scales"))
        at.scales.push_back({s.at("scale"), number_or_nan(s, "psnr_db"), number_or_nan(s, "ssim")});
    return at;
}

ComparedRun parse_run(const Json& json, const fs::path& folder) {
    ComparedRun run;
    run.kernel = json.at("kernel");
    run.trained_here = json.at("trained_here");
    run.machine = json.value("machine", "");
    run.seed = json.at("seed");
    run.folder = folder / json.at("folder").get<std::string>();
    run.failure = json.at("failure");
    run.notes = json.at("notes");
    run.peak_mb = optional_number(json, "peak_mb");
    for (const Json& at : json.at("at")) run.at.push_back(parse_at(at, run.folder));
    for (const Json& p : json.at("curve"))
        run.curve.push_back({p.at("iteration"), number_or_nan(p, "seconds"),
                             number_or_nan(p, "loss"), number_or_nan(p, "splats")});
    if (const auto b = json.find("blending"); b != json.end()) {
        run.blending.emplace();
        run.blending->blended_per_pixel = number_or_nan(*b, "blended_per_pixel");
        run.blending->intersections_per_splat = number_or_nan(*b, "pairs_per_splat");
        run.blending->ns_per_splat_pixel = number_or_nan(*b, "ns_per_splat_pixel");
        run.blending->blend_ms = number_or_nan(*b, "blend_ms");
        run.blending->frame_ms = number_or_nan(*b, "frame_ms");
    }
    if (const auto s = json.find("shapes"); s != json.end()) {
        run.shapes.emplace();
        run.shapes->edges = s->at("edges").get<std::vector<double>>();
        run.shapes->shares = s->at("shares").get<std::vector<double>>();
        for (const int p : LearnedShapes::kPercentiles)
            run.shapes->percentiles.push_back(s->at(fmt::format("p{}", p)));
    }
    return run;
}

}  // namespace

Comparison parse_comparison(const Json& json, const fs::path& file) {
    if (!json.is_object() || json.value("format", "") != "darb-compare")
        throw Error(file.string(), "is no report of darb compare", kNoReport);
    if (json.value("format_version", 0) != kCompareFormatVersion)
        throw Error(file.string(),
                    fmt::format("has version {} of the format, and this darb reads {}",
                                json.value("format_version", 0), kCompareFormatVersion),
                    kNoReport);
    Comparison c;
    try {
        for (const Json& machine : json.at("machines"))
            c.machines.push_back({machine.at("device"), machine.at("driver")});
        c.device = json.at("device");
        c.settings = json.at("settings");
        c.seeds = json.at("seeds");
        c.lpips_note = json.at("lpips");
        c.iterations = json.at("iterations").get<std::vector<int>>();
        c.kernels = json.at("kernels").get<std::vector<std::string>>();
        c.added = json.at("added").get<std::vector<std::string>>();
        c.scales = json.at("scales").get<std::vector<double>>();
        for (const Json& one : json.at("datasets")) {
            ComparedDataset& dataset = c.datasets.emplace_back();
            dataset.name = one.at("name");
            dataset.path = file.parent_path() / one.at("path").get<std::string>();
            dataset.fingerprint = one.at("fingerprint");
            dataset.width = one.at("width");
            dataset.height = one.at("height");
            for (const Json& run : one.at("runs"))
                dataset.runs.push_back(parse_run(run, file.parent_path()));
        }
    } catch (const Json::exception& e) {
        throw Error(file.string(), json_reason(e), kNoReport);
    }
    return c;
}

Comparison read_comparison(const fs::path& file) {
    return parse_comparison(parse_json_text(read_text_file(file), file.string(), kNoReport), file);
}

// Merging.

namespace {

constexpr const char* kApart =
    "Their figures are not comparable. Merge reports of the same command, run on several machines "
    "or with other kernels, seeds or data sets.";

std::string list_text(const std::vector<int>& numbers) {
    std::string text;
    for (const int n : numbers) text += (text.empty() ? "" : ", ") + format_number(n);
    return text;
}

bool measured(const std::string& lpips_note) {
    return lpips_note.starts_with("LPIPS: ");
}

void refuse(const fs::path& first, const fs::path& second, const std::string& what) {
    throw Error("--merge " + first.string() + " " + second.string(), what, kApart);
}

std::vector<std::string> held_out_names(const ComparedDataset& dataset) {
    std::vector<std::string> names;
    for (const ComparedRun& run : dataset.runs)
        for (const ComparedAt& at : run.at)
            for (std::size_t v = 0; names.size() < at.views.size(); ++v)
                names.push_back(at.views[v].name);
    return names;
}

void check_same_photos(const fs::path& a, const fs::path& b, const ComparedDataset& first,
                       const ComparedDataset& second) {
    if (first.width != second.width || first.height != second.height)
        refuse(a, b,
               fmt::format("{} has photos of {} x {} px in one and of {} x {} px in the other",
                           first.name, first.width, first.height, second.width, second.height));
    const std::vector<std::string> names = held_out_names(first), others = held_out_names(second);
    if (names != others && !names.empty() && !others.empty())
        refuse(a, b,
               fmt::format("{} holds other views out: {} ({}, ...) and {} ({}, ...)", first.name,
                           names.size(), names.front(), others.size(), others.front()));
}

void check_mergeable(const fs::path& a, const fs::path& b, const Comparison& first,
                     const Comparison& second) {
    if (first.iterations != second.iterations)
        refuse(a, b,
               fmt::format("one is after {} iterations and the other after {}",
                           list_text(first.iterations), list_text(second.iterations)));
    if (first.settings != second.settings)
        refuse(
            a, b,
            fmt::format("the settings differ: \"{}\" and \"{}\"", first.settings, second.settings));
    if (measured(first.lpips_note) && measured(second.lpips_note) &&
        first.lpips_note != second.lpips_note)
        refuse(
            a, b,
            fmt::format("LPIPS differs: \"{}\" and \"{}\"", first.lpips_note, second.lpips_note));
    for (const ComparedDataset& dataset : first.datasets)
        for (const ComparedDataset& other : second.datasets)
            if (dataset.name == other.name) check_same_photos(a, b, dataset, other);
}

/// Which report a run comes from.
struct Origin {
    std::string file;
    ComparedRun run;
};

std::string machine_of(const Comparison& report, const ComparedRun& run) {
    return !run.machine.empty() || report.machines.empty() ? run.machine
                                                           : report.machines[0].device;
}

RepeatedCell repeated_cell(const std::string& dataset, const Origin& a, const Origin& b,
                           const ComparedAt& first, const ComparedAt& second) {
    RepeatedCell cell{dataset, a.run.kernel, a.run.seed, first.iteration, a.file, b.file};
    cell.psnr_db = second.psnr_db - first.psnr_db;
    cell.ssim = second.ssim - first.ssim;
    cell.same_bits = first.views.size() == second.views.size() && first.splats == second.splats;
    cell.same_machine = a.run.machine == b.run.machine;
    for (std::size_t v = 0; v < std::min(first.views.size(), second.views.size()); ++v) {
        const ComparedView &one = first.views[v], &other = second.views[v];
        cell.same_bits &= one.psnr_db == other.psnr_db && one.ssim == other.ssim;
        cell.largest_view_db =
            std::max(cell.largest_view_db, std::abs(one.psnr_db - other.psnr_db));
    }
    return cell;
}

/// Adds the run to those of its data set, and its cells that others have to `repeated`.
void take_run(const std::string& dataset, const Origin& origin, std::vector<Origin>& taken,
              std::vector<RepeatedCell>& repeated) {
    bool is_there = false;
    for (const Origin& other : taken) {
        if (other.run.kernel != origin.run.kernel || other.run.seed != origin.run.seed ||
            other.run.trained_here != origin.run.trained_here)
            continue;
        is_there |= other.run.machine == origin.run.machine;
        for (const ComparedAt& first : other.run.at)
            for (const ComparedAt& second : origin.run.at)
                if (first.iteration == second.iteration)
                    repeated.push_back(repeated_cell(dataset, other, origin, first, second));
    }
    if (!is_there) taken.push_back(origin);
}

template <class T>
void unite(std::vector<T>& all, const std::vector<T>& more) {
    for (const T& one : more)
        if (std::find(all.begin(), all.end(), one) == all.end()) all.push_back(one);
}

void take_heads(const std::vector<Comparison>& reports, Comparison& merged) {
    merged.iterations = reports.front().iterations;
    merged.settings = reports.front().settings;
    merged.lpips_note = reports.front().lpips_note;
    merged.seeds = 0;
    for (const Comparison& report : reports) {
        unite(merged.machines, report.machines);
        unite(merged.kernels, report.kernels);
        unite(merged.added, report.added);
        unite(merged.scales, report.scales);
        merged.seeds = std::max(merged.seeds, report.seeds);
        if (measured(report.lpips_note)) merged.lpips_note = report.lpips_note;
    }
    std::sort(merged.scales.begin(), merged.scales.end());
    for (const Machine& machine : merged.machines)
        merged.device += fmt::format("{}{}, {}", merged.device.empty() ? "" : "; ", machine.device,
                                     machine.driver);
}

/// Where machines differ, methods carry their names: their times are not comparable otherwise.
void name_by_machine(Comparison& merged) {
    if (merged.machines.size() < 2) return;
    std::vector<std::string> kernels, added;
    for (const std::string& kernel : merged.kernels)
        for (const Machine& machine : merged.machines) {
            const std::string name = kernel + " on " + machine.device;
            bool there = false;
            for (ComparedDataset& dataset : merged.datasets)
                for (ComparedRun& run : dataset.runs)
                    if (run.kernel == kernel && run.machine == machine.device) {
                        run.kernel = name;
                        there = true;
                    }
            if (!there || std::find(kernels.begin(), kernels.end(), name) != kernels.end())
                continue;
            kernels.push_back(name);
            if (std::find(merged.added.begin(), merged.added.end(), kernel) != merged.added.end())
                added.push_back(name);
        }
    merged.kernels = std::move(kernels);
    merged.added = std::move(added);
}

}  // namespace

MergedComparison merge_comparisons(const std::vector<fs::path>& files,
                                   const std::vector<Comparison>& reports) {
    DARB_CHECK(files.size() == reports.size() && !files.empty(), "{} files, {} reports",
               files.size(), reports.size());
    for (std::size_t i = 0; i < reports.size(); ++i)
        for (std::size_t j = 0; j < i; ++j)
            check_mergeable(files[j], files[i], reports[j], reports[i]);
    MergedComparison merged;
    for (std::size_t i = 1; i < reports.size(); ++i)
        for (const ComparedDataset& dataset : reports[i].datasets)
            for (const ComparedDataset& first : reports[0].datasets)
                if (first.name == dataset.name && first.fingerprint != dataset.fingerprint)
                    merged.notes.push_back(fmt::format(
                        "{}: the photos or cameras of {} and {} are not the same bits, as with "
                        "another decoder; small differences may come from that",
                        dataset.name, files[0].filename().string(), files[i].filename().string()));
    take_heads(reports, merged.comparison);
    std::vector<std::vector<Origin>> taken;  // [data set]
    std::vector<ComparedDataset>& sets = merged.comparison.datasets;
    for (std::size_t i = 0; i < reports.size(); ++i)
        for (const ComparedDataset& dataset : reports[i].datasets) {
            auto at = std::find_if(sets.begin(), sets.end(), [&](const ComparedDataset& one) {
                return one.name == dataset.name;
            });
            if (at == sets.end()) {
                at = sets.insert(sets.end(), dataset);
                at->runs.clear();
                taken.emplace_back();
            }
            for (const ComparedRun& run : dataset.runs) {
                Origin origin{files[i].string(), run};
                origin.run.machine = machine_of(reports[i], run);
                take_run(dataset.name, origin, taken[static_cast<std::size_t>(at - sets.begin())],
                         merged.repeated);
            }
        }
    for (std::size_t s = 0; s < sets.size(); ++s)
        for (Origin& origin : taken[s]) sets[s].runs.push_back(std::move(origin.run));
    name_by_machine(merged.comparison);
    return merged;
}

// What is said of cells that several reports have.

bool RepeatedCell::agree() const {
    return std::abs(psnr_db) < 0.005 && std::abs(ssim) < 0.00005;
}

namespace {

std::string verdict(const RepeatedCell& cell) {
    return cell.same_bits ? "bit for bit" : cell.agree() ? "as printed" : "no";
}

}  // namespace

Table repeated_table(const std::vector<RepeatedCell>& repeated) {
    using Kind = TableColumn::Kind;
    Table table{"repeated",
                "What several reports have",
                "The second report less the first. The tables show the first of those of one "
                "machine.",
                {{"data set", "", Better::neither, 0, Kind::name},
                 {"kernel", "", Better::neither, 0, Kind::name},
                 {"seed", "", Better::neither, 0},
                 {"iterations", "", Better::neither, 0},
                 {"first", "", Better::neither, 0, Kind::name},
                 {"second", "", Better::neither, 0, Kind::name},
                 {"PSNR", "dB", Better::neither, 4},
                 {"SSIM", "", Better::neither, 6},
                 {"most of a view", "dB", Better::neither, 4},
                 {"agree", "", Better::neither, 0, Kind::name}},
                {}};
    for (const RepeatedCell& c : repeated)
        table.rows.push_back({{c.dataset, c.kernel, double(c.seed), double(c.iteration), c.first,
                               c.second, c.psnr_db, c.ssim, c.largest_view_db, verdict(c)},
                              true,
                              !c.agree()});
    return table;
}

Json repeated_json(const std::vector<RepeatedCell>& repeated) {
    Json rows = Json::array();
    for (const RepeatedCell& c : repeated)
        rows.push_back({{"data_set", c.dataset},
                        {"kernel", c.kernel},
                        {"seed", c.seed},
                        {"iteration", c.iteration},
                        {"first", c.first},
                        {"second", c.second},
                        {"psnr_db_difference", c.psnr_db},
                        {"ssim_difference", c.ssim},
                        {"largest_view_db", c.largest_view_db},
                        {"same_bits", c.same_bits},
                        {"same_machine", c.same_machine},
                        {"agree", c.agree()}});
    return rows;
}

std::string repeated_lines(const std::vector<RepeatedCell>& repeated) {
    if (repeated.empty()) return {};
    std::string text;
    std::size_t agree = 0, same = 0;
    for (const RepeatedCell& c : repeated) {
        agree += c.agree() ? 1 : 0;
        same += c.same_bits ? 1 : 0;
        if (!c.agree())
            text += fmt::format(
                "disagreement: {}, {}, seed {}, {} iterations: {} has {:+.4f} dB and {:+.6f} in "
                "SSIM to {}{}\n",
                c.dataset, c.kernel, c.seed, format_number(c.iteration), c.second, c.psnr_db,
                c.ssim, c.first, c.same_machine ? ", on the same machine" : "");
    }
    return text + fmt::format(
                      "{} cell{} in two reports: {} agree as printed, {} of them bit for "
                      "bit\n",
                      repeated.size(), repeated.size() == 1 ? " is" : "s are", agree, same);
}

}  // namespace darb
