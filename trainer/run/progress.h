// SPDX-License-Identifier: MIT
// Progress on stderr: one line rewritten in place on a terminal, a plain line now and then
// elsewhere.
#pragma once

#include <chrono>
#include <cstdint>
#include <map>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <vector>

#include "trainer/options/schedule.h"
#include "trainer/run/forecast.h"
#include "trainer/step/trainer.h"

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
    TimeLeft(const Schedule& schedule, const PaceForecast& pace);

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

    int iterations_;
    std::map<int, int> probes_;  // iteration: those of the probe that precedes the next
    bool has_target_ = false;    // the strategy's end is known
    double limit_ = 0;           // most splats
    PaceForecast pace_;
    std::vector<double> counts_;  // [iteration] splats, as forecast
    std::vector<double> ramp_;    // [iteration] share of the time on whole photos
    int iteration_ = 0;
    double last_s_ = 0, splats_ = 0;
    Faded steady_, quick_;  // milliseconds
    Faded grown_;           // splats added, relative to the model's expectation
    bool any_ = false;
};

class Progress {
  public:
    Progress(int first_iteration, int last_iteration, bool quiet);

    /// The run ends with another iteration.
    void set_last(int iteration) { last_ = iteration; }
    /// Seconds that are left after this iteration; 0: nothing is known yet.
    double seconds_left(int iteration) const;
    /// How the pace will change; without, what is left is told by the pace so far.
    void expect(const Schedule& schedule, const PaceForecast& pace);
    /// After every finished iteration; decides itself when to print.
    void update(const IterationResult& result, const Device& device);
    /// A line of its own (evaluation, saved file), leaving the bar intact.
    void note(const std::string& line);
    /// The same with "warning: " before it, also of a quiet run.
    void warn(const std::string& line);
    /// From this iteration on they take another time: rate and time left count from here.
    void restart_rate(int iteration);
    /// So many seconds were no training: a pause.
    void leave_out(double seconds);
    void finish();

  private:
    using Clock = std::chrono::steady_clock;
    void line_of_its_own(const std::string& line) const;
    std::string text(const IterationResult& result, const Device& device) const;

    int first_, last_;
    bool quiet_, terminal_;
    Clock::time_point start_, last_print_;
    Clock::time_point begin_;  // the whole run's begin, which restart_rate() keeps
    std::optional<TimeLeft> left_;
    double loss_ = 0, psnr_db_ = 0;  // smoothed
    bool any_ = false;
};

/// "3 min 20 s" and "1.2 GiB".
std::string format_duration(double seconds);
std::string format_bytes(double bytes);

}  // namespace darb
