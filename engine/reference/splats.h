// SPDX-License-Identifier: MIT
// The inputs of the reference: splat parameters in the scalar under test, and the settings of the
// rasteriser. Layouts and units as in SplatModel; central differences need them in double.
#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <vector>

#include "engine/scene/camera.h"
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
struct Splats : SplatArrays<T> {
    int sh_degree = 0;
    int kernel = KERNEL_GAUSSIAN;
    Footprint footprint = Footprint::psi;
    bool antialias = false;    // multiply opacity by sqrt(det S / det(S + low_pass I))
    std::vector<T> smoothing;  // [N] standard deviation of the 3D filter, world units; empty: none

    size_t size() const { return this->opacity_logit.size(); }
    int rest_count() const { return static_cast<int>(attribute_floats(kShRest, sh_degree)); }
};

template <class T>
Splats<T> make_splats(const SplatModel& model) {
    Splats<T> splats;
    splats.sh_degree = model.sh_degree;
    splats.kernel = model.kernel;
    splats.footprint = model.footprint;
    splats.antialias = model.antialias;
    for (int a = 0; a < kAttributeCount; ++a) {
        const std::vector<float>& from = attribute_values(model, a);
        attribute_values(splats, a).assign(from.begin(), from.end());
    }
    return splats;
}

struct RenderSettings {
    double near_z = NEAR_DEFAULT;        // world units along camera z; splats need z > near_z
    double low_pass = LOW_PASS_DEFAULT;  // px^2
    double alpha_cutoff = ALPHA_CUTOFF_DEFAULT;
    double transmittance_stop = TRANSMITTANCE_STOP;
    double background[3] = {0, 0, 0};
    // The accuracy settings of the device; the defaults give the truth.
    int polynomial_degree = 0;  // degree in place of the profile, see KernelTable; 0: the profile
                                // itself
    int storage = STORAGE_FLOAT32;  // STORAGE_FLOAT16 rounds what the device stores as halves, and
                                    // takes the rounding as the identity on the way back
    int depth_order = DEPTH_ORDER_CENTRE;
    int projection = PROJECTION_JACOBIAN;
    size_t depth_window = 0;  // for DEPTH_ORDER_PIXEL; 0: a full sort at every pixel
    int sh_degree = 3;        // active degree; that of the model where it is lower
    int threads = 0;          // 0: one per core. The result does not depend on it.
};

// Random splats in front of a random camera; a seed gives the same ones on every platform.

struct SceneOptions {
    size_t count = 10;  // splats
    int width = 32;     // px
    int height = 24;    // px
    int kernel = KERNEL_GAUSSIAN;
    Footprint footprint = Footprint::psi;
    int sh_degree = 3;
    bool antialias = false;
    double min_log_scale = -2.5, max_log_scale = -0.8;  // natural log of world units
    double min_logit = -1, max_logit = 2;
    std::uint64_t seed = 1;
};

struct TestScene {
    SplatModel model;
    Camera camera;
};

/// Splats in the cube [-1, 1]^3, and a rotated camera, about 3 from the cube's centre, that sees
/// most of it, with an off-centre principal point and unequal focal lengths.
TestScene random_scene(const SceneOptions& options = {});

/// The rotation given by a quaternion w x y z of any norm, for cameras.
glm::dmat3 rotation_of(double w, double x, double y, double z);

}  // namespace darb::reference
