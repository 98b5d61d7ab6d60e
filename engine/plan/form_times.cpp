#include "engine/plan/form_times.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>

namespace darb {

namespace {

constexpr double kGain = 0.97;             // less is not worth another form
constexpr double kErrors = 2;              // standard errors that a gain must exceed
constexpr double kWindow_s = 0.2;          // of the warm-up
constexpr int kWindowFrames = 3;           // at least
constexpr double kStable = 0.02;           // two windows are equal
constexpr double kErrorOfMedian = 1.2533;  // of normal values, over that of their mean
constexpr double kSigmaOfMad = 1.4826;     // of normal values

double median_of(std::vector<double> values) {
    if (values.empty()) return 0;
    const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
    std::nth_element(values.begin(), middle, values.end());
    if (values.size() % 2 == 1) return *middle;
    return 0.5 * (*middle + *std::max_element(values.begin(), middle));
}

struct Ratio {
    double median = 1, error = 0;
};

// Within a round the clock is nearly the same, over all rounds it need not be.
Ratio ratio_of(const std::vector<double>& ms, const std::vector<double>& usual_ms) {
    std::vector<double> ratios;
    for (std::size_t i = 0; i < std::min(ms.size(), usual_ms.size()); ++i)
        if (usual_ms[i] > 0) ratios.push_back(ms[i] / usual_ms[i]);
    if (ratios.empty()) return {};
    Ratio result{median_of(ratios), 0};
    for (double& ratio : ratios) ratio = std::abs(ratio - result.median);
    result.error = kErrorOfMedian * kSigmaOfMad * median_of(ratios) /
                   std::sqrt(static_cast<double>(ratios.size()));
    return result;
}

}  // namespace

double FormTimes::median_ms(std::size_t form) const {
    return median_of(rounds_ms.at(form));
}

std::size_t best_form(const FormTimes& times, const std::vector<bool>& may_win) {
    std::size_t best = 0;
    double least = kGain;
    for (std::size_t form = 1; form < times.rounds_ms.size(); ++form) {
        if (form < may_win.size() && !may_win[form]) continue;
        const Ratio ratio = ratio_of(times.rounds_ms[form], times.rounds_ms[0]);
        if (ratio.median > least || ratio.median + kErrors * ratio.error >= 1) continue;
        least = ratio.median;
        best = form;
    }
    return best;
}

bool warm_up(const TimedForms& forms, const TimingEffort& effort) {
    const double start = forms.now_s();
    double before = 0;
    while (forms.now_s() - start < effort.warm_most_s) {
        std::vector<double> window;
        const double begun = forms.now_s();
        while (window.size() < kWindowFrames || forms.now_s() - begun < kWindow_s)
            window.push_back(forms.sample_ms(0));
        const double now = median_of(window);
        const bool same = std::abs(now - before) <= kStable * now;
        if (same && forms.now_s() - start >= effort.warm_least_s) return true;
        before = now;
    }
    return effort.warm_most_s == 0;
}

FormTimes time_rounds(const TimedForms& forms, std::span<const std::size_t> which,
                      const TimingEffort& effort) {
    FormTimes times;
    times.rounds_ms.resize(which.size());
    std::vector<std::size_t> order(which.size());
    std::iota(order.begin(), order.end(), std::size_t{0});
    const double start = forms.now_s();
    for (int round = 0; round < effort.rounds_most; ++round) {
        if (round >= effort.rounds_least && forms.now_s() - start > effort.rounds_s) break;
        for (const std::size_t i : order) times.rounds_ms[i].push_back(forms.sample_ms(which[i]));
        std::reverse(order.begin(), order.end());
    }
    return times;
}

FormChoice choose_form(const TimedForms& forms, std::size_t count, const TimingEffort& effort,
                       const std::vector<bool>& may_win) {
    std::vector<std::size_t> all(count);
    std::iota(all.begin(), all.end(), std::size_t{0});
    warm_up(forms, effort);
    const FormTimes times = time_rounds(forms, all, effort);
    FormChoice choice{best_form(times, may_win), {}};
    for (std::size_t form = 0; form < count; ++form) choice.ms.push_back(times.median_ms(form));
    if (choice.form != 0) {
        const std::array<std::size_t, 2> both{0, choice.form};
        if (best_form(time_rounds(forms, both, effort)) == 0) choice.form = 0;
    }
    return choice;
}

}  // namespace darb
