#include "tools/darb/train_plan.h"

#include <fmt/format.h>

namespace darb {

void print_plan(Device& device, const Dataset& dataset, const TrainFlags& flags) {
    if (flags.run.quiet) return;
    size_t held_out = 0;
    for (const View& v : dataset.views) held_out += v.is_test ? 1 : 0;
    fmt::print(stderr, "{}: {}, {} photos to train on, {} held out, {} points\n",
               dataset.root.string(), dataset.source, dataset.views.size() - held_out, held_out,
               dataset.points.size());
    for (const std::string& note : dataset.notes) fmt::print(stderr, "note: {}\n", note);
    fmt::print(stderr, "device: {} ({})\n", device.info().name, device.info().driver);
}

}  // namespace darb
