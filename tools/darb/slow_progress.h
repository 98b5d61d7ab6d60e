// Notes on stderr about work that may take long: nothing of what is quick.
#pragma once

#include <fmt/format.h>

#include <chrono>
#include <string>
#include <utility>

#include "tools/darb/outputs.h"

namespace darb {

class SlowProgress {
  public:
    /// what: as "measuring".
    explicit SlowProgress(std::string what) : what_(std::move(what)) {}

    /// "measuring: 12 pictures", "palette: 40 %"; none in the first 5 s, then one every 5 s.
    void at(std::size_t count, const char* unit) { note(fmt::format("{} {}", count, unit)); }
    void at(double share) { note(fmt::format("{:.0f} %", 100 * share)); }

  private:
    using Clock = std::chrono::steady_clock;
    static constexpr std::chrono::seconds kBetween{5};

    void note(const std::string& text) {
        if (Clock::now() - last_ < kBetween) return;
        last_ = Clock::now();
        say_note(what_ + ": " + text);
    }

    std::string what_;
    Clock::time_point last_ = Clock::now();
};

}  // namespace darb
