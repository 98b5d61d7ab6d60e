// SPDX-License-Identifier: MIT
#include "trainer/run/progress.h"

#include <fmt/format.h>

#include "engine/core/say.h"
#include "engine/core/system.h"

namespace darb {

namespace {
constexpr double kSmoothing = 0.05;
constexpr double kTerminalSeconds = 0.2, kPlainSeconds = 10.0;
}  // namespace

std::string format_duration(double seconds) {
    const auto whole = static_cast<long>(seconds + 0.5);
    if (whole < 60) return fmt::format("{} s", whole);
    if (whole < 3600) return fmt::format("{} min {:02} s", whole / 60, whole % 60);
    return fmt::format("{} h {:02} min", whole / 3600, whole / 60 % 60);
}

std::string format_bytes(double bytes) {
    if (bytes < 1024.0 * 1024.0) return fmt::format("{:.0f} KiB", bytes / 1024.0);
    if (bytes < 1024.0 * 1024.0 * 1024.0) return fmt::format("{:.0f} MiB", bytes / 1024.0 / 1024.0);
    return fmt::format("{:.1f} GiB", bytes / 1024.0 / 1024.0 / 1024.0);
}

Progress::Progress(int first_iteration, int last_iteration, bool quiet)
    : first_(first_iteration),
      last_(last_iteration),
      quiet_(quiet),
      terminal_(is_terminal(stderr)),
      start_(Clock::now()),
      last_print_(start_),
      begin_(start_) {}

void Progress::expect(const TrainOptions& options, const PaceForecast& pace) {
    left_.emplace(options, pace);
}

void Progress::update(const IterationResult& r, const Device& device) {
    loss_ = any_ ? loss_ + kSmoothing * (r.loss - loss_) : r.loss;
    psnr_db_ = any_ ? psnr_db_ + kSmoothing * (r.psnr_db - psnr_db_) : r.psnr_db;
    any_ = true;
    if (quiet_) return;
    const auto now = Clock::now();
    if (left_)
        left_->add(r.iteration, std::chrono::duration<double>(now - begin_).count(), r.splats);
    const double since = std::chrono::duration<double>(now - last_print_).count();
    if (since < (terminal_ ? kTerminalSeconds : kPlainSeconds) && r.iteration < last_) return;
    last_print_ = now;
    say_text(fmt::format(fmt::runtime(terminal_ ? "\r{}\033[K" : "{}\n"), text(r, device)));
}

std::string Progress::text(const IterationResult& r, const Device& device) const {
    const double seconds = std::chrono::duration<double>(Clock::now() - start_).count();
    const double done = r.iteration - first_ + 1;
    const double rate = done / std::max(seconds, 1e-6);
    double left = left_ ? left_->seconds() : 0;
    if (left <= 0) left = (last_ - r.iteration) / std::max(rate, 1e-9);
    std::string bar;
    if (terminal_) {
        const int filled = static_cast<int>(20.0 * r.iteration / std::max(last_, 1));
        bar = "[" + std::string(filled, '#') + std::string(20 - filled, '.') + "] ";
    }
    return fmt::format(
        "{}{}/{}  {:.1f} it/s  {:.1f} ms  loss {:.4f}  PSNR {:.2f} dB  {} splats  {}  {} left", bar,
        r.iteration, last_, rate, 1000.0 / rate, loss_, psnr_db_, r.splats,
        format_bytes(static_cast<double>(device.allocated_bytes())), format_duration(left));
}

void Progress::note(const std::string& line) {
    if (!quiet_) line_of_its_own(line);
}

void Progress::warn(const std::string& line) {
    line_of_its_own("warning: " + line);
}

void Progress::line_of_its_own(const std::string& line) const {
    say_text(fmt::format(fmt::runtime(terminal_ ? "\r{}\033[K\n" : "{}\n"), printable(line)));
}

void Progress::restart_rate(int iteration) {
    first_ = iteration;
    start_ = Clock::now();
}

void Progress::leave_out(double seconds) {
    const auto left_out =
        std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(seconds));
    start_ += left_out;
    begin_ += left_out;
}

void Progress::finish() {
    if (!quiet_ && terminal_ && any_) say_text("\n");
}

}  // namespace darb
