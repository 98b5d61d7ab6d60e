#include "tools/darb/train_presets.h"

#include <fmt/format.h>

#include "engine/core/say.h"
#include "engine/data/run_colmap.h"
#include "trainer/options/presets.h"
#include "trainer/run/progress.h"
#include "trainer/step/photos.h"

namespace darb {

namespace {

constexpr double kSlowSeconds = 1'800;  // of a bare run: from here on a quicker one is suggested

// The data set with photos of at most that width.
Dataset at_width(Dataset dataset, int width) {
    for (View& view : dataset.views)
        if (view.camera.width > width)
            view.camera = divided(view.camera, double(view.camera.width) / width);
    return dataset;
}

std::string time_of(double seconds) {
    return seconds > 0 ? "about " + format_duration(seconds) : "not measured";
}

// A word that the shell takes apart stands in quotes.
std::string typed(const std::string& word) {
    const bool plain = word.find_first_of(" '\"\\$`&|;<>()*?[]#~!{}") == std::string::npos;
    return plain ? word : shell_quoted(word);
}

}  // namespace

void print_presets(Device& scratch, const TrainJob& job, const TrainFlags& flags,
                   const Forecast& chosen) {
    if (flags.length_given || chosen.seconds <= 0) return;
    const std::string_view own =
        flags.request.preset.empty() ? kRunPresets.back().name : flags.request.preset;
    std::string line, instead;
    for (const RunPreset& preset : kRunPresets) {
        double seconds = chosen.seconds;
        if (preset.name != own) {
            TrainOptions options = job.options;
            options.iterations = preset.iterations;
            seconds =
                forecast_training(
                    scratch, flags.width_given ? job.dataset : at_width(job.dataset, preset.width),
                    options)
                    .seconds;
        }
        line += fmt::format("{}{} ({}; {} iterations{}) {}", line.empty() ? "" : ", ", preset.name,
                            preset.summary, preset.iterations,
                            flags.width_given ? "" : fmt::format(" at {} px", preset.width),
                            time_of(seconds));
        if (preset.name == own) break;  // those above take longer still, and longer to measure
        instead +=
            fmt::format("\n  darb train {} -o {} --preset {}    {}", typed(job.request.dataset),
                        typed(job.request.output.string()), preset.name, time_of(seconds));
    }
    say("presets: {}\n", line);
    if (flags.request.preset.empty() && chosen.seconds > kSlowSeconds && !instead.empty())
        say("This takes {} here. Quicker, after Ctrl-C:{}\n", time_of(chosen.seconds), instead);
}

}  // namespace darb
