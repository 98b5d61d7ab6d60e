// Effects that are compiled into the projection passes, as specialization constants of
// shaders/effects/constants.glsl. An effect that is off costs no instruction and no buffer.
#pragma once

#include "engine/gpu/pipeline.h"
#include "engine/scene/camera.h"

namespace darb {

struct ProjectionEffects {
    bool off_centre = true;  // false: every principal point is the centre of its image
    bool antialias = false;  // opacity compensation of the low-pass (SplatRenderMode mip)
    bool smoothing = false;  // the 3D filter of GpuSplats::smoothing()
    bool lens = false;       // Camera::lens; needs off_centre
};

inline void add_constants(const ProjectionEffects& effects, SpecConstants& constants) {
    constants["OFF_CENTRE"] = effects.off_centre ? 1 : 0;
    constants["ANTIALIAS"] = effects.antialias ? 1 : 0;
    constants["SMOOTHING"] = effects.smoothing ? 1 : 0;
    constants["LENS"] = effects.lens ? 1 : 0;
}

}  // namespace darb
