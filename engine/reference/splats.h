// The inputs of the reference: splat parameters in the scalar under test, and the settings of the
// raster. Same layouts and units as SplatModel; central differences need them in double.
#pragma once

#include <glm/glm.hpp>
#include <vector>

#include "engine/scene/splat_model.h"
#include "shaders/shared/accuracy_list.h"
#include "shaders/shared/limits.h"

namespace darb::reference {

template <class T>
using Vec2 = glm::vec<2, T>;
template <class T>
using Vec3 = glm::vec<3, T>;
template <class T>
using Vec4 = glm::vec<4, T>;
template <class T>
using Mat2 = glm::mat<2, 2, T>;
template <class T>
using Mat3 = glm::mat<3, 3, T>;

/// SplatModel in the scalar T (double or float): see engine/scene/splat_model.h for units.
template <class T>
struct Splats {
    int sh_degree = 0;
    int kernel = KERNEL_GAUSSIAN;
    Footprint footprint = Footprint::psi;
    bool antialias = false;    // opacity times sqrt(det S / det(S + low_pass I))
    std::vector<T> position;   // [N][3] world
    std::vector<T> log_scale;  // [N][3]
    std::vector<T> rotation;   // [N][4] w x y z
    std::vector<T> opacity;    // [N] logit
    std::vector<T> sh_dc;      // [N][3]
    std::vector<T> sh_rest;    // [N][C-1][3]
    std::vector<T> smoothing;  // [N] deviation of the 3D filter, world units; empty: none

    size_t size() const { return opacity.size(); }
    int rest_count() const { return ((sh_degree + 1) * (sh_degree + 1) - 1) * 3; }
};

template <class T>
Splats<T> make_splats(const SplatModel& model) {
    const auto copy = [](const std::vector<float>& from) {
        return std::vector<T>(from.begin(), from.end());
    };
    return {model.sh_degree,
            model.kernel,
            model.footprint,
            model.antialias,
            copy(model.position),
            copy(model.log_scale),
            copy(model.rotation),
            copy(model.opacity),
            copy(model.sh_dc),
            copy(model.sh_rest),
            {}};
}

/// The Jacobian is taken at x/z clamped to the image plus this share of W / (2 fx) on each side.
constexpr double kJacobianMargin = 0.3;

struct RenderSettings {
    double near_z = NEAR_DEFAULT;        // world units along camera z; splats need z > near_z
    double low_pass = LOW_PASS_DEFAULT;  // px^2
    double alpha_cutoff = ALPHA_CUTOFF_DEFAULT;
    double transmittance_stop = TRANSMITTANCE_STOP;
    double background[3] = {0, 0, 0};
    // The accuracy settings, as the device has them; the defaults are the truth.
    int polynomial_degree = 0;      // of the kernel, see KernelTable; 0: the profile itself
    int storage = STORAGE_FLOAT32;  // STORAGE_FLOAT16 rounds what the device stores as halves, and
                                    // takes the rounding as the identity on the way back
    int depth_order = DEPTH_ORDER_CENTRE;
    size_t depth_window = 0;  // of DEPTH_ORDER_PIXEL; 0: a full sort at every pixel
    int sh_degree = 3;        // active degree; the model's own where that is lower
    int threads = 0;          // 0: one per core. The result does not depend on it.
};

}  // namespace darb::reference
