// What the accuracy settings, and the other shortcuts and departures of training, cost and change:
// gradients against double precision, time an iteration, seconds to given held-out PSNRs, final
// PSNR, over several seeds.
#pragma once

#include <functional>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "engine/data/dataset.h"
#include "engine/ranks/ranks.h"
#include "tools/cost/accuracy_cost.h"
#include "trainer/options/options.h"

namespace darb {

struct TrainCostPlan {
    int seeds = 3;
    int evaluations = 10;    // of held-out views, evenly over a run
    Ranks* ranks = nullptr;  // that do the runs by turns; null: this process does all
};

struct TrainCostRow {
    Accuracy accuracy;
    std::string name;
    std::function<void(TrainOptions&)> change;  // what a row that is no accuracy setting does
    // |g - g*| / |g*| over all parameters of a trained scene, over some photos; none where the row
    // changes what is trained, not how exactly.
    std::optional<Spread> gradient_error;
    Spread ms;                       // an iteration, over the seeds
    Spread psnr_db;                  // held out, at the end
    std::vector<Spread> seconds_to;  // by TrainCostResult::targets; over the seeds that
    std::vector<int> reached;        // reached it
    std::vector<std::pair<double, double>> curve;  // (seconds, PSNR) of the first seed
};

struct TrainCostResult {
    std::vector<TrainCostRow> rows;  // balanced first
    std::vector<double> targets;     // dB: 3, 1 and 0.3 below balanced's median at the end
    int seeds = 0, iterations = 0;
    std::string device, driver, dataset;
};

/// The rows of a run with these options, not measured yet: settings of accuracy that the kernel has
/// and that mean something in training, presets, departures from 3DGS.
std::vector<TrainCostRow> training_rows(const Device& device, const TrainOptions& options);

/// Trains every row with every seed, row after row within a seed, so that drift hits all alike.
/// dataset needs held-out views. Throws Error without.
TrainCostResult measure_train_cost(Device& device, const Dataset& dataset,
                                   const TrainOptions& options, const TrainCostPlan& plan,
                                   const std::function<void(const std::string&)>& progress);

std::string train_cost_table(const TrainCostResult& result);
nlohmann::json train_cost_json(const TrainCostResult& result);
std::string train_cost_html(const TrainCostResult& result);

}  // namespace darb
