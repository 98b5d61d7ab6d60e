// SplatModel: the parameters of N splats as they are trained and stored (float32, host side).
// C = (sh_degree + 1)^2 coefficients per colour; SH order and sign as in 3DGS.
#pragma once

#include <cmath>
#include <glm/glm.hpp>
#include <string>
#include <vector>

#include "engine/kernels/kernel_family.h"

namespace darb {

struct SplatModel {
    int sh_degree = 0;             // 0..3
    int kernel = KERNEL_GAUSSIAN;  // shaders/shared/kernel_list.h
    Footprint footprint = Footprint::psi;
    bool antialias = false;  // SplatRenderMode: mip
    glm::dvec3 origin{0.0};  // added to every position on save; positions are relative to it

    std::vector<float> position;   // [N][3] world
    std::vector<float> log_scale;  // [N][3] natural log of the standard deviation, world
    std::vector<float> rotation;   // [N][4] quaternion w x y z, any norm above 1e-6
    std::vector<float> opacity;    // [N] logit
    std::vector<float> sh_dc;      // [N][3]; colour = 0.5 + 0.28209479 * dc
    std::vector<float> sh_rest;    // [N][C-1][3]: coefficient-major, rgb innermost

    size_t size() const { return opacity.size(); }
    int rest_count() const { return ((sh_degree + 1) * (sh_degree + 1) - 1) * 3; }
    void resize(size_t count) {
        position.resize(count * 3);
        log_scale.resize(count * 3);
        rotation.resize(count * 4);
        opacity.resize(count);
        sh_dc.resize(count * 3);
        sh_rest.resize(count * rest_count());
    }
};

/// The opacity that a logit stands for, 0 to 1.
inline double sigmoid(double logit) {
    return 1 / (1 + std::exp(-logit));
}

}  // namespace darb
