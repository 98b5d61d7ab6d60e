#include <fmt/format.h>

#include <algorithm>

#include "engine/plan/tuner.h"
#include "tools/bench/cases.h"

namespace darb {

namespace {

// Every choice of one group on the tuner's scene, a row each; the case's own figures are those of
// the one that runs on this device.
BenchResult measure_choices(Device& device, const std::string& name, const Sampling& sampling) {
    const std::vector<TuningGroup> groups = tuning_groups(device.info());
    const auto group = std::find_if(groups.begin(), groups.end(),
                                    [&](const TuningGroup& g) { return g.name == name; });
    const Tuning before = device.tuning();
    const TuningNames usual = tuning_names(before);
    BenchResult result;
    std::vector<PassFigure> rows;
    for (const std::string& choice : group->choices) {
        device.set_tuning(with_names(before, {{name, choice}}));
        TuningFrame frame(device);
        BenchResult one;
        take_samples(
            sampling, 1,
            [&] {
                return std::vector<PassTime>{{name + "=" + choice, frame.run({*group})[0]}};
            },
            one);
        rows.push_back(one.passes.at(0));
        if (choice == usual.at(name)) result = one;
    }
    device.set_tuning(before);
    result.passes = std::move(rows);
    result.note = fmt::format("{}={} runs on this device; rows are {}", name, usual.at(name),
                              fmt::join(group->passes, " + "));
    return result;
}

}  // namespace

std::vector<BenchCase> tuning_cases() {
    std::vector<BenchCase> cases;
    for (const char* group : {"scan", "scatter", "blend", "backward"})
        cases.push_back({fmt::format("tuning/{}", group), "",
                         [group](Device& device, const DeviceRates&, const BenchOptions& o) {
                             return measure_choices(device, group, o.sampling);
                         }});
    return cases;
}

}  // namespace darb
