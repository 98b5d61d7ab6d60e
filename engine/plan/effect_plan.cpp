#include "engine/plan/effect_plan.h"

#include <fmt/format.h>

#include <algorithm>
#include <iterator>

#include "engine/core/error.h"
#include "engine/scene/edit_splats.h"
#include "shaders/shared/render_args.h"

namespace darb {

namespace {

constexpr std::string_view kNames[] = {EFFECT_NAMES};
static_assert(std::size(kNames) == EFFECT_COUNT);

std::string all_names() {
    std::string text;
    for (const std::string_view name : kNames) text += fmt::format(" {}", name);
    return text;
}

}  // namespace

std::string_view effect_name(int effect) {
    return kNames[effect];
}

std::optional<int> effect_from_name(std::string_view name) {
    for (int e = 0; e < EFFECT_COUNT; ++e)
        if (kNames[e] == name) return e;
    return std::nullopt;
}

EffectChoice parse_effects(std::string_view text) {
    EffectChoice choice;
    const std::string where = fmt::format("--effects {}", text);
    const std::string hint =
        "Use auto, all, none, or changes like +exposure,-sh or all,-lens; the effects are" +
        all_names() + ".";
    if (text.empty()) throw Error(where, "names no effect", hint);
    for (std::size_t at = 0; at <= text.size();) {
        const std::size_t end = std::min(text.find(',', at), text.size());
        const std::string_view word = text.substr(at, end - at);
        const bool first = at == 0;
        at = end + 1;
        if (first && (word == "auto" || word == "all" || word == "none")) {
            if (word == "all") choice.base = EffectChoice::Base::all;
            if (word == "none") choice.base = EffectChoice::Base::none;
            continue;
        }
        const bool sign = !word.empty() && (word[0] == '+' || word[0] == '-');
        const auto effect = sign ? effect_from_name(word.substr(1)) : std::nullopt;
        if (!effect)
            throw Error(where,
                        effect_from_name(word)
                            ? fmt::format("'{0}' needs a sign: +{0} or -{0}", word)
                            : fmt::format("'{}' is no effect", word),
                        hint);
        choice.changed[static_cast<std::size_t>(*effect)] = word[0] == '+';
    }
    return choice;
}

std::optional<bool> effect_in_words(std::string_view text, std::string_view effect) {
    const auto id = effect_from_name(effect);
    return id ? parse_effects(text).changed[static_cast<std::size_t>(*id)] : std::nullopt;
}

bool words_refuse_effect(std::string_view text, std::string_view effect) {
    const EffectChoice choice = parse_effects(text);
    return !effect_in_words(text, effect).value_or(choice.base != EffectChoice::Base::none);
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

ProjectionEffects EffectPlan::projection() const {
    ProjectionEffects effects;
    for (const ProjectionSwitch& s : kProjectionSwitches)
        effects.*s.on = s.effect != kNoEffect && on(s.effect);
    effects.off_centre |= effects.lens || on(EFFECT_CAMERAS);  // principal points move
    return effects;
}

void EffectPlan::note_frame(std::uint32_t huge_splats, std::uint32_t longest_list) {
    EffectRow& huge = row(EFFECT_HUGE);
    most_huge_ = std::max(most_huge_, huge_splats);
    longest_list_ = std::max(longest_list_, longest_list);
    const bool needed = most_huge_ > 0 || longest_list_ > LIST_SEGMENT;
    huge.measured = most_huge_;
    const std::string counters = fmt::format(
        "{} splats of a frame over more than {} tiles, longest list {} of {} intersections",
        most_huge_, HUGE_INTERSECTIONS, longest_list_, LIST_SEGMENT);
    huge.reason = huge.overridden ? "--effects; the counters: " + counters : counters;
    if (!huge.overridden) huge.on = needed;
}

void apply_plan(const EffectPlan& plan, SplatModel& model) {
    model.antialias = plan.on(EFFECT_ANTIALIAS);
    limit_sh_degree(plan.row(EFFECT_VIEW_COLOUR).degree, model);
}

void apply_plan(const EffectPlan& plan, std::vector<View>& views) {
    if (plan.on(EFFECT_LENS)) return;
    for (View& view : views) view.camera.lens = {};
}

std::string plan_line(const EffectPlan& plan) {
    std::string text;
    for (int e = 0; e < EFFECT_COUNT; ++e) {
        const EffectRow& row = plan.row(e);
        if (!row.on) continue;
        text += fmt::format("{}{} ({})", text.empty() ? "" : ", ", effect_name(e), row.reason);
    }
    return text.empty() ? "none is called for" : text;
}

}  // namespace darb
