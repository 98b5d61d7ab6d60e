// SPDX-License-Identifier: MIT
// RunLog: run.jsonl (an event a line, flushed), metrics.json and report.html of one output folder.
#pragma once

#include <cstdio>
#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "engine/core/system_files.h"
#include "engine/plan/roofline.h"
#include "trainer/run/run.h"
#include "trainer/run/run_report.h"

namespace darb {

/// cfg_args as 3DGS writes it: one Python Namespace, which the ecosystem's viewers parse and 3DGS
/// evaluates; names are quoted so that nothing in them runs. Paths are as
/// seen from the output folder, that of the photos as seen from the data set.
std::string cfg_args(const Dataset& dataset, const TrainOptions& options,
                     const std::filesystem::path& output);

/// Samples, evaluations and the photos' sizes of a run's events into its report. A number that is
/// null, as JSON has NaN and infinity, becomes NaN, which the report leaves out of its curves.
void add_events(const std::vector<nlohmann::json>& events, ReportData& data);

/// What a probe found, in a line.
std::string probe_text(const Trainer::Probe& probe);

class RunLog {
  public:
    /// Touches nothing before begin() or go_on().
    explicit RunLog(const std::filesystem::path& folder) : folder_(folder) {}

    /// An empty run.jsonl. Throws Error where the folder cannot be written.
    void begin();
    /// The run.jsonl of an earlier part of the run, without what came after an iteration, which a
    /// resumed run writes again. Throws Error as read_events does, and where it cannot be written.
    void go_on(int iteration);

    /// rates: of the device, for the roofline.
    void start(const Device& device, const DeviceRates& rates, const Dataset& dataset,
               const Schedule& schedule, std::uint32_t splats, const std::string& effects_json,
               const std::optional<PaceForecast>& pace);
    /// The pace of the run that goes on, where it had one.
    std::optional<PaceForecast> pace() const;
    /// Keeps one line in kLogInterval. counters: of the run so far; totals: of the passes, as
    /// Trainer sums them.
    void iteration(const IterationResult& result, const TrainCounters& counters, double seconds,
                   const std::vector<PassTotal>& totals);
    /// The photos' sides are divided by so much from this iteration on.
    void resolution(int iteration, int divisor);
    /// What a probe found before this iteration.
    void probe(int iteration, const Trainer::Probe& probe);
    /// What limits the growth, "memory" or "pairs", and at how many splats.
    void growth_stopped(int iteration, const char* limit, std::uint32_t splats);
    /// There was no room for the mean that the run was to end with.
    void mean_left_out(int iteration);
    /// For a run that may end by itself: logs the PSNR of held-out photos, or that the run ends.
    void look(int iteration, double psnr_db);
    void ends_early(int iteration, int end, const std::string& reason);
    /// What was left out of the scene that was saved at the end, and what that does to held-out
    /// photos; NaN where none is held out.
    void cleaned(int iteration, const Clutter& clutter, double psnr_before, double psnr_after);
    /// What ended the run before its time; nothing where the log cannot be written.
    /// Settings were changed after this iteration; what: change_text().
    void changed(int iteration, const std::string& what, const Schedule& now);
    void failure(int iteration, const std::string& what);
    void evaluation(const Evaluation& evaluation);
    /// The passes of the run so far, in their order.
    std::vector<ReportPass> passes(const Trainer& trainer) const;
    /// metrics.json and, with_report, report.html; returns the path of the report, if any.
    std::filesystem::path finish(const TrainResult& summary, const Trainer& trainer,
                                 const Device& device, bool with_report);
    /// report.html of a run that has ended, from run.jsonl, metrics.json and held_out/; returns its
    /// path.
    std::filesystem::path report_again();

    static constexpr int kLogInterval = 50;  // iterations a line, values averaged over them

  private:
    void open();
    void write(const nlohmann::json& event);
    std::string shared_text(const std::string& text) const;  // without the folders of this machine
    ReportData report_data(const TrainResult& summary) const;

    std::filesystem::path folder_, root_;  // the run's and the data set's
    std::vector<nlohmann::json> events_;
    File file_;
    double loss_sum_ = 0, psnr_sum_ = 0;
    int summed_ = 0;
    FrameCounts counts_;  // sums over counted_ iterations
    double counted_ = 0;
    std::vector<PassTotal> written_;  // totals at the last line
    DeviceRates rates_;
    nlohmann::json start_;
};

}  // namespace darb
