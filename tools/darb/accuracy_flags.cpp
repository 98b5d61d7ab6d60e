#include "tools/darb/accuracy_flags.h"

#include <fmt/format.h>

#include "engine/core/say.h"
#include "engine/kernels/kernel_family.h"
#include "trainer/job/request_options.h"

namespace darb {

void add_accuracy_flags(CLI::App& command, AccuracyFlags& flags) {
    command.add_option("--accuracy", flags.preset, request_option("--accuracy").row.help)
        ->group(option_group::kAccuracy);
    for (int s = 0; s < kAccuracyCount; ++s) {
        const AccuracySetting& setting = accuracy_settings()[static_cast<size_t>(s)];
        command
            .add_option(accuracy_flag(setting), flags.choice[static_cast<size_t>(s)],
                        accuracy_help(setting))
            ->group(option_group::kAccuracy);
    }
}

Accuracy chosen_accuracy(const AccuracyFlags& flags) {
    Accuracy accuracy =
        preset_accuracy(flags.preset.empty() ? int{kBalanced} : preset_of_option(flags.preset));
    for (int s = 0; s < kAccuracyCount; ++s) {
        const std::string& name = flags.choice[static_cast<size_t>(s)];
        if (!name.empty()) accuracy.choice[s] = find_choice(s, name);
    }
    return accuracy;
}

void note_unused_choices(const AccuracyFlags& flags, int kernel) {
    if (flags.choice[kEvaluation] == "builtin" && !has_builtin_evaluation(kernel))
        say_note(fmt::format("note: --evaluation builtin is not used: {} has polynomials only",
                             kernel_name(kernel)));
}

}  // namespace darb
