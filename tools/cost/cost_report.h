// SPDX-License-Identifier: MIT
// The results of `darb cost` as a table, as JSON and as a page.
#pragma once

#include <nlohmann/json.hpp>
#include <string>

#include "engine/report/report.h"
#include "tools/cost/accuracy_cost.h"

namespace darb {

nlohmann::json spread_json(const Spread& spread);
std::string cost_table(const CostResult& result);
nlohmann::json cost_json(const CostResult& result);
/// title: name of the scene.
Report cost_report(const CostResult& result, const std::string& title);

}  // namespace darb
