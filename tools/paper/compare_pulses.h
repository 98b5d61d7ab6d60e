// The paper's claim that more pulses than one take less memory and give less quality, on the runs
// of a comparison.
#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "tools/paper/compare_runs.h"

namespace darb {

/// A kernel with several pulses against the same kernel with one, medians over seeds. None where
/// one of the two has no such number.
struct PulseChange {
    std::string kernel;  // of one pulse
    int pulses = 0;
    std::optional<double> psnr_db, ssim;                 // differences
    std::optional<double> splats, model, peak, seconds;  // ratios

    bool less_memory() const { return model && *model < 1; }
    bool less_psnr() const { return psnr_db && *psnr_db < 0; }
    bool less_ssim() const { return ssim && *ssim < 0; }
};

/// Every kernel of the comparison that was run with one pulse and with more.
std::vector<PulseChange> pulse_changes(const Comparison& comparison, const ComparedDataset& dataset,
                                       int iteration);

/// All empty where there is no such kernel.
std::string pulse_lines(const Comparison& comparison, const ComparedDataset& dataset);
std::string pulse_html(const Comparison& comparison, const ComparedDataset& dataset);
nlohmann::json pulse_json(const Comparison& comparison, const ComparedDataset& dataset);

}  // namespace darb
