// Effects that are compiled into the projection passes, as specialization constants of
// shaders/effects/constants.glsl. An effect that is off costs no instruction and no buffer.
#pragma once

#include "engine/gpu/pipeline.h"
#include "engine/scene/camera.h"

namespace darb {

/// When a frame is ready for huge splats (cooperative emission) and for long lists (blend passes of
/// several dispatches). Lists that need it are cut into parts in any case, as a driver may end
/// them.
enum class Crowds {
    by_counters,  // where the last frame had any
    always,
    never,
};

struct ProjectionEffects {
    bool off_centre = true;  // false: every principal point is the centre of its image
    bool antialias = false;  // opacity compensation of the low-pass (SplatRenderMode mip)
    bool smoothing = false;  // the 3D filter of GpuSplats::smoothing()
    bool lens = false;       // Camera::lens; needs off_centre
    bool near_care = true;   // false: no splat beside a picture reaches into it

    bool operator==(const ProjectionEffects&) const = default;
};

inline void add_constants(const ProjectionEffects& effects, SpecConstants& constants) {
    constants["OFF_CENTRE"] = effects.off_centre ? 1 : 0;
    constants["ANTIALIAS"] = effects.antialias ? 1 : 0;
    constants["SMOOTHING"] = effects.smoothing ? 1 : 0;
    constants["LENS"] = effects.lens ? 1 : 0;
    constants["NEAR_CARE"] = effects.near_care ? 1 : 0;
}

}  // namespace darb
