// SPDX-License-Identifier: MIT
// The whole one-dimensional study: every signal, kernel, number of primitives and seed.
#pragma once

#include <functional>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "engine/report/report.h"
#include "tools/paper/approximate1d.h"

namespace darb {

struct Study1dOptions {
    std::vector<int> signals;  // indices of signals_1d()
    std::vector<int> kernels;  // ids, or kGeneralisedExponential
    std::vector<int> primitives{1, 5, 10};
    int seeds = 20;
    double target_share = 0.01;  // share of the signal's mean square: the time to this loss is
                                 // taken
    int threads = 0;             // 0: one per core; affects times, but not results
    Fit1dOptions fit;
};

/// One signal, kernel and number of primitives, over all seeds. A run fails where its loss is not
/// finite or explains less than half of the signal's mean square; medians and ranges are over the
/// other runs.
struct Study1dRow {
    int signal = 0, kernel = 0, primitives = 0;
    int failed = 0;
    double median = 0, low = 0, high = 0;  // final loss; NaN where every run failed
    double quartile1 = 0, quartile3 = 0;
    int reached = 0;                             // number of runs that reached the target
    std::optional<double> steps_to, seconds_to;  // medians over those
    double seconds = 0;                          // median over the runs
    std::vector<double> curve;                   // median loss at curve_steps
    std::vector<Primitive1d> shown;              // from the run with the median loss
};

struct Study1dResult {
    Study1dOptions options;
    std::vector<double> mean_squares;  // one for each of options.signals
    std::vector<Study1dRow> rows;      // by signal, kernel, primitives
    double seconds = 0;                // wall-clock time

    const Study1dRow& row(std::size_t signal, std::size_t kernel, std::size_t primitives) const {
        return rows[(signal * options.kernels.size() + kernel) * options.primitives.size() +
                    primitives];
    }
};

/// progress(done, all) is called now and then, from any thread, but never concurrently.
Study1dResult study_1d(const Study1dOptions& options,
                       const std::function<void(std::size_t, std::size_t)>& progress);

std::string study_1d_table(const Study1dResult& result);
nlohmann::json study_1d_json(const Study1dResult& result);
/// Tables, grids of fits (rows kernels, columns N) and loss curves.
Report study_1d_report(const Study1dResult& result);

}  // namespace darb
