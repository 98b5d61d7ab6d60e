// Does a scene want one kernel or many? The shapes that splats learned in the runs of a comparison.
#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "engine/scene/splat_model.h"
#include "tools/paper/compare_runs.h"

namespace darb {

/// Of the splats that are drawn (opacity at or over the cut-off). None where the kernel has no
/// shape, and where no splat is drawn.
std::optional<LearnedShapes> learned_shapes(const SplatModel& model);

/// run.shapes, of the last saved model.
void read_shapes_of(ComparedRun& run);

/// A plot for each kernel that learns shapes, with a curve for each data set, and a table of
/// percentiles, all of the first seed that is there; empty where there is no such kernel.
std::string shapes_html(const Comparison& comparison);
nlohmann::json shapes_json(const LearnedShapes& shapes);

}  // namespace darb
