// SPDX-License-Identifier: MIT
// Progress on stderr: one line rewritten in place on a terminal, a plain line now and then
// elsewhere.
#pragma once

#include <chrono>
#include <optional>
#include <string>

#include "trainer/run/time_left.h"
#include "trainer/step/trainer.h"

namespace darb {

class Progress {
  public:
    Progress(int first_iteration, int last_iteration, bool quiet);

    /// How the pace will change; without, what is left is told by the pace so far.
    void expect(const TrainOptions& options, const PaceForecast& pace);
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
