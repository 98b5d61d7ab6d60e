// How forms of a pass are timed and compared, without a device: the tuner gives it one, tests give
// it a made-up one with a clock of its own.
//
// A GPU that idles runs at a fraction of its clock and takes up to a second of work to reach it. It
// idles while pipelines compile, so whatever is timed first seems slow. Three things keep that, and
// a card that becomes hot, out of the comparison: work until times are stable, forms in turn, and
// ratios within a turn.
#pragma once

#include <cstddef>
#include <functional>
#include <span>
#include <vector>

namespace darb {

/// What is timed.
struct TimedForms {
    std::function<double(std::size_t form)> sample_ms;  // one frame by this form; 0: the usual one
    std::function<double()> now_s;                      // a clock that does not go back
};

struct TimingEffort {
    double warm_least_s = 0, warm_most_s = 0;  // of work before the forms are timed; 0: none
    int rounds_least = 3, rounds_most = 3;     // in each all forms take a turn
    double rounds_s = 0;                       // once these are over, no more rounds than the least
};

struct FormTimes {
    std::vector<std::vector<double>> rounds_ms;  // [form][round]

    double median_ms(std::size_t form) const;
};

/// The usual form, or the one that takes least of those that are worth a change: the median of its
/// ratios to the usual one, round by round, is at most 0.97, and lies below 1 by more than twice
/// the standard error that their spread gives it. may_win: of each form; empty: all.
std::size_t best_form(const FormTimes& times, const std::vector<bool>& may_win = {});

/// Runs the usual form until two windows of a fifth of a second agree to 2 %, within the effort's
/// bounds. Returns whether they agreed.
bool warm_up(const TimedForms& forms, const TimingEffort& effort);

/// Times these forms in rounds, every other round in the opposite order; in the order of `which`.
FormTimes time_rounds(const TimedForms& forms, std::span<const std::size_t> which,
                      const TimingEffort& effort);

struct FormChoice {
    std::size_t form = 0;
    std::vector<double> ms;  // of each form, the median
};

/// Warms up, times all forms, and where another than the usual one is best, looks a second time at
/// these two: the usual one stays unless it loses again.
FormChoice choose_form(const TimedForms& forms, std::size_t count, const TimingEffort& effort,
                       const std::vector<bool>& may_win = {});

}  // namespace darb
