// What the probes of darb plan say.
#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include "engine/core/say.h"
#include "tools/darb/plan_probe.h"
#include "tools/paper/compare_stats.h"

namespace darb {

namespace {

std::string gain_text(double db) {
    return fmt::format("{:+.2f} dB", db);
}

nlohmann::json arm_json(const ProbedRun& run) {
    return {{"seconds", run.seconds}, {"splats", run.splats}};
}

}  // namespace

void print_probe(std::FILE* out, const AntialiasProbe& probe) {
    tell(out, "\nanti-aliasing, a probe of {} iterations: held-out PSNR without, with\n",
         probe.iterations);
    for (const ProbedSize& size : probe.sizes)
        tell(out, "{:>4}x  {:<11}  {:>8.2f} {:>8.2f} dB  {}\n", scale_text(size.scale),
             fmt::format("{} x {}", size.width, size.height), size.without_db, size.with_db,
             gain_text(size.with_db - size.without_db));
    tell(out, "price: {:.1f} s and {} splats without, {:.1f} s and {} splats with\n",
         probe.without.seconds, probe.without.splats, probe.with.seconds, probe.with.splats);
}

nlohmann::json probe_json(const AntialiasProbe& probe) {
    nlohmann::json sizes = nlohmann::json::array();
    for (const ProbedSize& size : probe.sizes)
        sizes.push_back({{"scale", size.scale},
                         {"width", size.width},
                         {"height", size.height},
                         {"without_psnr_db", size.without_db},
                         {"with_psnr_db", size.with_db}});
    return {{"iterations", probe.iterations},
            {"gain_db", probe.gain_db()},
            {"sizes", sizes},
            {"without", arm_json(probe.without)},
            {"with", arm_json(probe.with)}};
}

void print_trial(std::FILE* out, const Trial& trial) {
    tell(out, "\n{}, a probe of {} iterations beside {}: {}\n", trial.tried, trial.iterations,
         trial.usual, trial.advice());
}

nlohmann::json trial_json(const Trial& trial) {
    return {{"tried", trial.tried},
            {"beside", trial.usual},
            {"iterations", trial.iterations},
            {"psnr_db", trial.tried_db},
            {"beside_psnr_db", trial.usual_db},
            {"gain_db", trial.gain_db()},
            {"price", trial.price},
            {"pays", trial.pays()},
            {"tried_run", arm_json(trial.tried_run)},
            {"beside_run", arm_json(trial.usual_run)}};
}

}  // namespace darb
