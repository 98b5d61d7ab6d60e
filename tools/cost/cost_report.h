// SPDX-License-Identifier: MIT
// The results of `darb cost` as a table, as JSON and as a page.
#pragma once

#include <nlohmann/json.hpp>
#include <string>

#include "tools/cost/accuracy_cost.h"

namespace darb {

nlohmann::json spread_json(const Spread& spread);
std::string cost_table(const CostResult& result);
nlohmann::json cost_json(const CostResult& result);
/// A whole page without external resources. title: name of the scene.
std::string cost_html(const CostResult& result, const std::string& title);

}  // namespace darb
