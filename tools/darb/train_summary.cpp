// SPDX-License-Identifier: MIT
#include "tools/darb/train_summary.h"

#include <fmt/format.h>

#include <algorithm>

#include "engine/core/count_text.h"
#include "engine/core/system.h"
#include "engine/core/text.h"
#include "engine/ranks/ranks.h"

namespace darb {

namespace {

// The most expensive passes first, without those that take less than a hundredth of an iteration.
std::string passes_text(std::vector<ReportPass> passes) {
    std::string text;
    std::sort(passes.begin(), passes.end(),
              [](const ReportPass& a, const ReportPass& b) { return a.ms > b.ms; });
    double all_ms = 0;
    for (const ReportPass& pass : passes) all_ms += pass.ms;
    if (all_ms > 0) text = fmt::format("{:.2f} ms an iteration on the device:\n", all_ms);
    for (const ReportPass& pass : passes)
        if (pass.ms > 0.01 * all_ms)
            text += fmt::format(
                "  {:<18} {:8.3f} ms{}\n", pass.name, pass.ms,
                pass.roofline ? fmt::format("  {:4.1f} % of the roofline", 100 * *pass.roofline)
                              : "");
    return text;
}

// What several ranks cost; for a resumed run only in this part of it.
std::string ranks_text(const RankGroup& ranks, const TrainResult& summary) {
    if (!ranks.several() || summary.trained_steps == 0) return "";
    const double steps = summary.trained_steps;
    return fmt::format(
        "{} ranks: {:.3f} MB a step from each, {:.1f} ms a step of sending and waiting\n",
        ranks.all->count(), static_cast<double>(summary.sent_bytes) / steps / 1e6,
        summary.exchange_seconds / steps * 1e3);
}

}  // namespace

std::string summary_text(const TrainResult& summary, const RunShown& shown,
                         const std::filesystem::path& output, const RankGroup& ranks) {
    const bool quiet = shown.quiet;
    std::string text;
    if (!quiet)
        text = fmt::format("{} iterations in {:.1f} s\n", summary.iteration, summary.seconds);
    if (!quiet && !summary.ended_early.empty())
        text += fmt::format("the run ended itself: {}\n", summary.ended_early);
    if (!quiet && !summary.evaluations.empty()) {
        const Evaluation& e = summary.evaluations.back();
        text += fmt::format("held-out PSNR {:.2f} dB, SSIM {:.4f}, {} splats\n", e.psnr_db, e.ssim,
                            count_text(e.splats));
    }
    if (!quiet) text += ranks_text(ranks, summary);
    if (!quiet && shown.verbose) text += passes_text(summary.passes);
    const auto written = [&](const char* what, const std::filesystem::path& path) {
        if (path.empty()) return;
        text += (quiet ? "" : fmt::format("{:<9}", what)) + path.string() + "\n";
    };
    written("scene", summary.model);
    if (!quiet && summary.undrawn + summary.dropped > 0)
        text += fmt::format(
            "         of {} splats; of those too transparent to be drawn {} were left out, and {} "
            "had left the run before\n",
            count_text(summary.saved), count_text(summary.undrawn), count_text(summary.dropped));
    if (!summary.pictures.empty()) written("picture", summary.pictures.front().file);
    written("report", summary.report);
    if (summary.interrupted)
        text += fmt::format("interrupted{}{}; go on with: darb train --resume -o '{}'\n",
                            stop_exit_code() == 0 ? "" : " by ", stop_name(), output.string());
    return printable(text, true);
}

}  // namespace darb
