// SPDX-License-Identifier: MIT
// ForwardOptions: what is fixed when the passes of a frame are compiled, each a specialization
// constant.
#pragma once

#include "engine/gpu/pipeline.h"
#include "engine/scene/camera.h"
#include "engine/scene/splat_model.h"
#include "shaders/shared/accuracy_list.h"
#include "shaders/shared/effect_list.h"
#include "shaders/shared/limits.h"

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
    bool shutter = false;    // Camera::shutter
    bool near_care = true;   // false: no splat beside a picture reaches into it

    bool operator==(const ProjectionEffects&) const = default;
};

inline constexpr int kNoEffect = -1;

/// A row for each switch: plans, options, files and the viewer follow this table.
struct ProjectionSwitch {
    bool ProjectionEffects::*on;
    ConstantName constant;   // in shaders/effects/constants.glsl
    int effect = kNoEffect;  // EFFECT_* that turns it on
};
inline constexpr ProjectionSwitch kProjectionSwitches[] = {
    {&ProjectionEffects::off_centre, "OFF_CENTRE", EFFECT_OFF_CENTRE},
    {&ProjectionEffects::antialias, "ANTIALIAS", EFFECT_ANTIALIAS},
    {&ProjectionEffects::smoothing, "SMOOTHING"},
    {&ProjectionEffects::lens, "LENS", EFFECT_LENS},
    {&ProjectionEffects::shutter, "SHUTTER", EFFECT_SHUTTER},
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

/// An evaluation that is the device's choice: the driver's own functions where is_exponential and
/// Tuning::exp_builtin, else polynomials.
constexpr int kEvaluationOfDevice = -1;

struct ForwardOptions {
    int kernel = KERNEL_GAUSSIAN;
    Footprint footprint = Footprint::psi;
    int evaluation = EVALUATION_POLYNOMIAL;  // EVALUATION_*, or kEvaluationOfDevice
    int polynomial_degree = 5;
    float alpha_cutoff = static_cast<float>(ALPHA_CUTOFF_DEFAULT);
    float transmittance_stop = static_cast<float>(TRANSMITTANCE_STOP);
    int storage = STORAGE_FLOAT32;         // how projected splats are stored
    int depth_order = DEPTH_ORDER_CENTRE;  // DEPTH_ORDER_PIXEL: forward only
    int projection = PROJECTION_JACOBIAN;  // PROJECTION_*
    int arithmetic = ARITHMETIC_FLOAT32;   // of the blends, ARITHMETIC_*
    ProjectionEffects effects;
    bool store_for_backward = false;
    bool backward_follows = true;  // false: what is stored is looked at, without a backward pass
    HugeSplatPath huge_splat_path = HugeSplatPath::by_counters;

    // What the splats' floats stand for; shaders/lib/splat_values.glsl. Not for training steps.
    bool linear_values = false;  // opacities and scales themselves, not logits and logarithms
    bool direct_colour = false;  // sh_dc is the colour, of any sign; at degree 0
    // What else the backward pass takes and leaves.
    bool alpha_gradient = false;  // dL/d(image) has a fourth plane, dL/d(1 - transmittance)
    // The image has a fourth plane, sum w z, w the weight of each splat in a pixel and z its depth
    // along the optical axis; dL/d(image) has a fifth for it, and the fourth as alpha_gradient has.
    // Not with DEPTH_ORDER_PIXEL.
    bool depth_sum = false;
    // With depth_sum two planes more: sum w (z - z0)^2, and z0, the depth of the first splat that a
    // pixel shows; the fourth is then sum w (z - z0). dL/d(image) has one more for the squares, and
    // then z0 once more. So the spread of depths is exact in float where a surface is far away.
    bool depth_spread = false;
    bool camera_gradient = false;  // Backward::record_gradients leaves dL/d(camera), too
};

/// Planes [H][W] of dL/d(image) that the backward pass takes.
constexpr std::uint64_t d_image_planes(const ForwardOptions& options) {
    return options.depth_spread ? 7 : options.depth_sum ? 5 : options.alpha_gradient ? 4 : 3;
}
/// Planes [H][W] of the image.
constexpr std::uint32_t image_planes(const ForwardOptions& options) {
    return options.depth_spread ? 6 : options.depth_sum ? 4 : 3;
}

/// Whether an exponential is the slow part of w: the Gaussian and generalized_exponential.
bool is_exponential(int kernel);
/// EVALUATION_* of these options on a device.
int evaluation_on(const Device& device, const ForwardOptions& options);
/// Whether a kernel has a form in half precision: those with w = exp(-q/2) and no other term.
bool has_half_blend(int kernel);
/// Whether the two blends of these options run in half precision. Kernels without that form keep
/// float32, as do pixels that are resorted.
bool blends_in_half(const ForwardOptions& options);
/// Lanes of the subgroups of blends in half precision. Throws Error where the device cannot run
/// them.
std::uint32_t half_blend_lanes(const Device& device);
/// The constants of these options that several passes share: kernel, storage and depth order.
SpecConstants kernel_constants(const Device& device, const ForwardOptions& options);
/// Those of the projection, forward and back: the kernel's, the effects', the degree in use and
/// that of the buffers.
SpecConstants projection_constants(const Device& device, const ForwardOptions& options,
                                   int sh_degree, int sh_stored);

/// What the transmittance of a pixel stays at or above: the stop less its slack for rounding.
constexpr float least_transmittance(float stop) {
    return static_cast<float>(stop * (1 - TRANSMITTANCE_SLACK));
}

}  // namespace darb
