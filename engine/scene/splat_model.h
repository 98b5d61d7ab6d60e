// SplatModel: the parameters of N splats as they are trained and stored (float32, host side).
// C = (sh_degree + 1)^2 coefficients per colour; SH order and sign as in 3DGS.
#pragma once

#include <cmath>
#include <glm/glm.hpp>
#include <string>
#include <vector>

#include "engine/kernels/kernel_family.h"
#include "engine/scene/splat_attributes.h"

namespace darb {

struct SplatModel : SplatArrays<float> {
    int sh_degree = 0;             // 0..3
    int kernel = KERNEL_GAUSSIAN;  // shaders/shared/kernel_list.h
    Footprint footprint = Footprint::psi;
    bool antialias = false;  // SplatRenderMode: mip
    glm::dvec3 origin{0.0};  // added to every position on save; positions are relative to it

    size_t size() const { return opacity_logit.size(); }
    int rest_count() const { return static_cast<int>(attribute_floats(kShRest, sh_degree)); }
    /// Floats of a splat; 0 of an optional attribute that is not there.
    std::uint32_t floats(int attribute) const {
        const bool held = !kSplatAttributes[static_cast<size_t>(attribute)].optional ||
                          !attribute_values(*this, attribute).empty();
        return held ? attribute_floats(attribute, sh_degree) : 0;
    }
    /// All arrays but those of optional attributes that are not there.
    void resize(size_t count) {
        for (int a = 0; a < kAttributeCount; ++a)
            attribute_values(*this, a).resize(count * floats(a));
    }
};

/// The opacity that a logit stands for, 0 to 1.
inline double sigmoid(double logit) {
    return 1 / (1 + std::exp(-logit));
}

}  // namespace darb
