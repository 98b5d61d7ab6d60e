// What is left of a run: the pace that was measured, on through the growth that is forecast.
#pragma once

#include <cstdint>
#include <nlohmann/json_fwd.hpp>
#include <vector>

#include "trainer/forecast.h"
#include "trainer/options.h"

namespace darb {

/// What a forecast says of a run's pace; as run.jsonl keeps it.
struct PaceForecast {
    std::uint32_t start_splats = 0, splats = 0;  // at the start and at the end
    bool falls = false;                          // Forecast::falls
    double start_ms = 0, end_ms = 0;             // an iteration on whole photos; 0: not measured
    std::vector<double> ramp_ms;                 // Forecast::ramp_ms
    int longest_side = 0;                        // of the photos, px
};

PaceForecast pace_of(const Forecast& forecast);
nlohmann::json pace_json(const PaceForecast& pace);
/// Throws nlohmann::json::exception where it is not as pace_json writes it.
PaceForecast pace_from_json(const nlohmann::json& json);

class TimeLeft {
  public:
    TimeLeft(const TrainOptions& options, const PaceForecast& pace);

    /// seconds: of the run so far, as a clock has them; from the first call on they are measured.
    void add(int iteration, double seconds, std::uint32_t splats);
    /// Seconds from the last iteration added to the end of the run. 0: nothing is known yet, which
    /// only is where there is no forecast either.
    double seconds() const;

  private:
    double model_ms(int iteration, double splats) const;
    double later_splats(int iteration) const;

    int iterations_, probe_at_ = 0, probe_iterations_ = 0;  // 0: there is no probe
    bool has_target_ = false;                               // the strategy's end is known
    PaceForecast pace_;
    std::vector<double> counts_;  // [iteration] splats, as forecast
    std::vector<double> ramp_;    // [iteration] share of the time on whole photos
    int iteration_ = 0;
    double last_s_ = 0, splats_ = 0;
    // Sums of measured and forecast time, in which what is long ago fades.
    double measured_ms_ = 0, modelled_ms_ = 0;
    bool any_ = false;
};

}  // namespace darb
