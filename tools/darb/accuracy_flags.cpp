#include "tools/darb/accuracy_flags.h"

#include <fmt/format.h>

#include "engine/core/error.h"
#include "engine/kernels/kernel_family.h"
#include "tools/darb/outputs.h"

namespace darb {

void add_accuracy_flags(CLI::App& command, AccuracyFlags& flags, bool training) {
    const char* group = "Accuracy";
    command
        .add_option("--accuracy", flags.preset,
                    "fast, balanced (default) or exact; `darb cost` shows what each costs")
        ->group(group);
    for (int s = 0; s < kAccuracyCount; ++s) {
        if (training && s == kShDegree) continue;
        const AccuracySetting& setting = accuracy_settings()[static_cast<size_t>(s)];
        std::string names;
        for (const AccuracyChoice& choice : setting.choices)
            names += fmt::format("{}{}", names.empty() ? "" : ", ", choice.name);
        command
            .add_option(accuracy_flag(setting), flags.choice[static_cast<size_t>(s)],
                        fmt::format("{} [{}]", setting.what, names))
            ->group(group);
    }
}

Accuracy chosen_accuracy(const AccuracyFlags& flags, bool training) {
    int preset = kBalanced;
    if (!flags.preset.empty()) {
        const auto found = preset_from_name(flags.preset);
        if (!found)
            throw Error("--accuracy " + flags.preset, "no such preset",
                        "Use fast, balanced or exact.");
        preset = *found;
    }
    Accuracy accuracy = preset_accuracy(preset, training);
    for (int s = 0; s < kAccuracyCount; ++s) {
        const std::string& name = flags.choice[static_cast<size_t>(s)];
        if (!name.empty()) accuracy.choice[s] = find_choice(s, name, training);
    }
    return accuracy;
}

void note_unused_choices(const AccuracyFlags& flags, int kernel) {
    if (flags.choice[kEvaluation] == "builtin" && !has_builtin_evaluation(kernel))
        say_note(fmt::format("note: --evaluation builtin is not used: {} has polynomials only",
                             kernel_name(kernel)));
}

}  // namespace darb
