// EffectPlan: which effects of shaders/shared/effect_list.h a scene or a data set calls for, each
// with the number that was measured on it. What is off is not compiled, not stored, not computed.
#pragma once

#include <array>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "engine/core/image.h"
#include "engine/data/dataset.h"
#include "engine/render/effects.h"
#include "engine/scene/splat_model.h"
#include "shaders/shared/effect_list.h"

namespace darb {

/// The name of an effect on the command line and in files.
std::string_view effect_name(int effect);
std::optional<int> effect_from_name(std::string_view name);

struct EffectRow {
    bool on = false;
    bool overridden = false;  // the command line said so
    int degree = 0;           // of EFFECT_VIEW_COLOUR
    double measured = 0;      // what the rule looked at; its unit stands in the reason
    std::string reason;       // a clause
};

struct EffectPlan {
    std::array<EffectRow, EFFECT_COUNT> rows;

    bool on(int effect) const { return rows[static_cast<std::size_t>(effect)].on; }
    EffectRow& row(int effect) { return rows[static_cast<std::size_t>(effect)]; }
    const EffectRow& row(int effect) const { return rows[static_cast<std::size_t>(effect)]; }
    ProjectionEffects projection() const {
        return {on(EFFECT_OFF_CENTRE) || on(EFFECT_LENS), on(EFFECT_ANTIALIAS), false,
                on(EFFECT_LENS)};
    }
};

/// "auto", "all", "none", or changes to auto: "+exposure,-sh".
struct EffectChoice {
    enum class Base { automatic, all, none } base = Base::automatic;
    std::array<std::optional<bool>, EFFECT_COUNT> changed{};
};
/// Throws Error naming the word that is no effect.
EffectChoice parse_effects(std::string_view text);

/// What a rendering asks for beside the pictures themselves.
struct RenderOutputs {
    bool depth = false;
};

/// For pictures of a scene through these cameras (none: only what the file decides). An effect that
/// is an identity where the rule says off may be forced on; anti-aliasing is as the file says, as
/// another choice would show another scene: `all` leaves it alone, `none` and -antialias drop it.
EffectPlan plan_rendering(const SplatModel& model, const std::vector<View>& views,
                          const RenderOutputs& outputs, const EffectChoice& choice = {});

/// For training. photos: as load_photos gives them, for the exposure's rule; empty: that effect is
/// off. The degree of view-dependent colour is found while training: see TrainOptions::probe_sh.
EffectPlan plan_training(const Dataset& dataset, const std::vector<ImageU8>& photos, int sh_degree,
                         const EffectChoice& choice = {});

/// The model as the plan wants it: higher bands and the render mode dropped.
void apply_plan(const EffectPlan& plan, SplatModel& model);

/// One line: the effects that are on, with their reasons.
std::string plan_line(const EffectPlan& plan);

}  // namespace darb
