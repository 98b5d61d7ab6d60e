// SPDX-License-Identifier: MIT
// What the accuracy settings, and the other shortcuts and departures of training, cost and change:
// gradients against double precision, time per iteration, seconds to given held-out PSNRs, and
// final PSNR, over several seeds.
#pragma once

#include <functional>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "engine/data/dataset.h"
#include "engine/ranks/ranks.h"
#include "engine/report/report.h"
#include "tools/cost/accuracy_cost.h"
#include "trainer/options/schedule.h"

namespace darb {

struct TrainCostPlan {
    int seeds = 3;
    int evaluations = 10;    // evaluations of the held-out views, evenly spread over a run
    Ranks* ranks = nullptr;  // take turns with the runs; null: this process does all
};

struct TrainCostRow {
    Accuracy accuracy;
    std::string name;
    std::function<void(TrainOptions&)> change;  // what a row does that is not an accuracy setting
    // |g - g*| / |g*| over all parameters of a trained scene and some photos; empty where the row
    // changes what is trained rather than how exactly.
    std::optional<Spread> gradient_error;
    Spread ms;                       // per iteration, over the seeds
    Spread psnr_db;                  // on held-out views, at the end
    std::vector<Spread> seconds_to;  // by TrainCostResult::targets; over the seeds that
    std::vector<int> reached;        // reached it
    std::vector<std::pair<double, double>> curve;  // (seconds, PSNR) in the first seed
};

struct TrainCostResult {
    std::vector<TrainCostRow> rows;  // balanced first
    std::vector<double> targets;     // dB: 3, 1 and 0.3 below balanced's final median
    int seeds = 0, iterations = 0;
    std::string device, driver, dataset;
};

/// The rows for a run with these options, not measured yet: accuracy settings that the kernel has
/// and that matter in training, presets, and departures from 3DGS.
std::vector<TrainCostRow> training_rows(const Device& device, const Schedule& schedule);

/// Trains every row with every seed, row after row within a seed, so that drift affects all rows
/// alike. Throws Error where the data set has no held-out views.
TrainCostResult measure_train_cost(Device& device, const Dataset& dataset,
                                   const TrainOptions& options, const TrainCostPlan& plan,
                                   const std::function<void(const std::string&)>& progress);

std::string train_cost_table(const TrainCostResult& result);
nlohmann::json train_cost_json(const TrainCostResult& result);
Report train_cost_report(const TrainCostResult& result);

}  // namespace darb
