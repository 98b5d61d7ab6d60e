// Effects that are compiled into the projection passes, as specialization constants of
// shaders/effects/constants.glsl. An effect that is off costs no instruction and no buffer.
#pragma once

#include "engine/gpu/pipeline.h"
#include "engine/scene/camera.h"
#include "shaders/shared/effect_list.h"

namespace darb {

/// When a frame is ready for huge splats (cooperative emission) and for long lists (blend passes of
/// several dispatches). Lists that need it are cut into parts in any case, as a driver may end
/// them.
enum class HugeSplatPath {
    by_counters,  // where the last frame had any
    always,
    never,
};

struct ProjectionEffects {
    bool off_centre = true;  // false: every principal point is the centre of its image
    bool antialias = false;  // opacity compensation of the low-pass (SplatRenderMode mip)
    bool smoothing = false;  // the 3D filter of GpuSplats::smoothing()
    bool lens = false;       // Camera::lens
    bool near_care = true;   // false: no splat beside a picture reaches into it

    bool operator==(const ProjectionEffects&) const = default;
};

inline constexpr int kNoEffect = -1;

/// A row for each switch: plans, options, files and the viewer follow this table.
struct ProjectionSwitch {
    bool ProjectionEffects::*on;
    ConstantName constant;   // of shaders/effects/constants.glsl
    int effect = kNoEffect;  // EFFECT_* that turns it on
};
inline constexpr ProjectionSwitch kProjectionSwitches[] = {
    {&ProjectionEffects::off_centre, "OFF_CENTRE", EFFECT_OFF_CENTRE},
    {&ProjectionEffects::antialias, "ANTIALIAS", EFFECT_ANTIALIAS},
    {&ProjectionEffects::smoothing, "SMOOTHING"},
    {&ProjectionEffects::lens, "LENS", EFFECT_LENS},
    {&ProjectionEffects::near_care, "NEAR_CARE", EFFECT_NEAR},
};

/// Whether a principal point other than the centre of its image is drawn where it is.
inline bool draws_every_centre(const ProjectionEffects& effects) {
    return effects.off_centre || effects.lens;
}

inline void add_constants(const ProjectionEffects& effects, SpecConstants& constants) {
    for (const ProjectionSwitch& s : kProjectionSwitches)
        constants[s.constant] = effects.*s.on ? 1 : 0;
    if (effects.lens) constants["OFF_CENTRE"] = 1;
}

}  // namespace darb
