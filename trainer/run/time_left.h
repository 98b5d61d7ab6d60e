// SPDX-License-Identifier: MIT
// What is left of a run: the pace that was measured, on through as much of the forecast growth as
// the run shows it to have. In tests/unit/trainer/time_left_test.cpp the estimate at 24, 50 and 75
// % of a run is within 1.5 times of the truth where the forecast is right, where the growth does
// not come, and where the machine gets busy or free after a fifth; on recorded runs it is
// within 1.6.
#pragma once

#include <cstdint>
#include <nlohmann/json_fwd.hpp>
#include <vector>

#include "trainer/options/options.h"
#include "trainer/run/forecast.h"

namespace darb {

/// What a forecast says of a run's pace; as run.jsonl keeps it.
struct PaceForecast {
    std::uint32_t start_splats = 0, splats = 0;  // at the start and at the end
    bool falls = false;                          // Forecast::falls
    double start_ms = 0, end_ms = 0;             // an iteration on whole photos; 0: not measured
    std::vector<double> ramp_ms;                 // Forecast::ramp_ms
    int longest_side = 0;                        // the photos', px
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
    // Sums of measured and of modelled amounts, in which what is long ago fades.
    struct Faded {
        double half_life = 1;  // iterations
        double measured = 0, modelled = 0;
        void add(double new_measured, double new_modelled, int iterations);
        double ratio() const { return measured / modelled; }
    };

    double pace() const;
    double growth() const;
    double model_ms(int iteration, double splats) const;
    double later_splats(int iteration) const;

    int iterations_, probe_at_ = 0, probe_iterations_ = 0;  // 0: there is no probe
    bool has_target_ = false;                               // the strategy's end is known
    double limit_ = 0;                                      // most splats
    PaceForecast pace_;
    std::vector<double> counts_;  // [iteration] splats, as forecast
    std::vector<double> ramp_;    // [iteration] share of the time on whole photos
    int iteration_ = 0;
    double last_s_ = 0, splats_ = 0;
    Faded steady_, quick_;  // milliseconds
    Faded grown_;           // splats added, relative to the model's expectation
    bool any_ = false;
};

}  // namespace darb
