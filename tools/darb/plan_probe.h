// The probe of darb plan: whether anti-aliasing pays on a data set, found out by trying. Two short
// runs, without and with it, and their pictures of held-out photos at several sizes.
#pragma once

#include <cstdio>
#include <nlohmann/json_fwd.hpp>

#include "engine/data/dataset.h"
#include "engine/gpu/device.h"
#include "engine/plan/antialias_probe.h"
#include "trainer/options/options.h"

namespace darb {

/// Trains on the views that are not held out; every 8th is where the source names none. options:
/// kernel and iterations count. Throws Error where there are no photos both to train on and to
/// hold out.
AntialiasProbe probe_antialias(const DeviceOptions& device, const Dataset& dataset,
                               const TrainOptions& options, const EffectPlan& plan);

/// Of options.kernel, whose shape each splat learns, beside the Gaussian; both as the plan has it.
Trial try_shape(const DeviceOptions& device, const Dataset& dataset, const TrainOptions& options,
                const EffectPlan& plan);
/// Of --exposure-grid beside one map a photo, where the plan has exposure. Pictures are fitted to
/// the held-out photos' exposure before they are measured.
Trial try_exposure_grid(const DeviceOptions& device, const Dataset& dataset,
                        const TrainOptions& options, const EffectPlan& plan);

void print_probe(std::FILE* out, const AntialiasProbe& probe);
void print_trial(std::FILE* out, const Trial& trial);
nlohmann::json trial_json(const Trial& trial);
nlohmann::json probe_json(const AntialiasProbe& probe);

}  // namespace darb
