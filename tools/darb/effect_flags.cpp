#include "tools/darb/effect_flags.h"

#include <fmt/format.h>

#include "engine/core/error.h"

namespace darb {

void add_effects_flag(CLI::App& command, std::string& text) {
    command
        .add_option("--effects", text,
                    "auto: what the scene calls for, see `darb plan`; all; none; or changes to one "
                    "of them, auto where none is named: +exposure,-sh or all,-lens")
        ->capture_default_str();
}

void add_lens_flag(CLI::App& command, DatasetOptions& data) {
    data.original_where_wide = true;
    command
        .add_option_function<std::string>(
            "--lens",
            [&data](const std::string& text) {
                data.original_lens = text == "original";
                data.original_where_wide = text == "auto";
            },
            "undistort: straight pictures; original: distorted as the photos are; auto: original "
            "for a fisheye that sees more than 60 degrees to a side, straight for all others")
        ->check(CLI::IsMember({"auto", "undistort", "original"}))
        ->default_str("auto");
}

EffectChoice choose_effects(const std::string& text, EffectUse use, DatasetOptions& data) {
    const EffectChoice choice = parse_effects(text);
    for (const int effect : impossible_effects(use))
        if (choice.changed[static_cast<std::size_t>(effect)].value_or(false))
            throw Error(
                "--effects " + text,
                fmt::format("'{}' is nothing that this command can do", effect_name(effect)),
                fmt::format("Leave +{} out.", effect_name(effect)));
    if (choice.changed[EFFECT_LENS].value_or(choice.base != EffectChoice::Base::none))
        return choice;
    if (data.original_lens)
        throw Error("--effects " + text, "drops the lens that --lens original keeps",
                    "Leave --lens out, or keep the effect with +lens.");
    data.original_where_wide = false;
    return choice;
}

}  // namespace darb
