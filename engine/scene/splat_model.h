// SPDX-License-Identifier: MIT
// SplatModel: the parameters of N splats as they are trained and stored (float32, on the host). C =
// (sh_degree + 1)^2 coefficients per colour; SH order and signs as in 3DGS.
#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <glm/glm.hpp>
#include <string>
#include <vector>

#include "engine/kernels/kernel_family.h"
#include "engine/scene/earth_place.h"
#include "shaders/shared/attribute_list.h"
#include "shaders/shared/limits.h"

namespace darb {

inline float limit_infinite_logit(float logit) {
    return std::isinf(logit) ? std::copysign(static_cast<float>(OPACITY_LOGIT_LIMIT), logit)
                             : logit;
}

inline float limit_infinite_log_scale(float log_scale) {
    return std::isinf(log_scale) && log_scale < 0 ? -static_cast<float>(LOG_SCALE_LIMIT)
                                                  : log_scale;
}

enum Attribute {
    kPosition = ATTRIBUTE_POSITION,
    kLogScale = ATTRIBUTE_LOG_SCALE,
    kRotation = ATTRIBUTE_ROTATION,
    kOpacityLogit = ATTRIBUTE_OPACITY_LOGIT,
    kShDc = ATTRIBUTE_SH_DC,
    kShRest = ATTRIBUTE_SH_REST,
    kShape = ATTRIBUTE_SHAPE,
    kAttributeCount = ATTRIBUTES
};

/// Values or gradients of N splats, one array per attribute. T: float, or double in the reference.
template <class T>
struct SplatArrays {
    std::vector<T> position;       // [N][3] world
    std::vector<T> log_scale;      // [N][3] natural log of the standard deviation, world
    std::vector<T> rotation;       // [N][4] quaternion w x y z, any norm above 1e-6
    std::vector<T> opacity_logit;  // [N]
    std::vector<T> sh_dc;          // [N][3]; colour = 0.5 + SH_C0 * dc
    std::vector<T> sh_rest;        // [N][C-1][3]: coefficient-major, rgb innermost
    std::vector<T> shape;          // [N] for kernels with shapes, engine/kernels/shaped_kernel.h;
                                   // else empty
};

/// The array of an attribute.
template <class T>
std::vector<T>& attribute_values(SplatArrays<T>& arrays, int attribute) {
    using Arrays = SplatArrays<T>;
    constexpr std::vector<T> Arrays::*members[] = {
        &Arrays::position, &Arrays::log_scale, &Arrays::rotation, &Arrays::opacity_logit,
        &Arrays::sh_dc,    &Arrays::sh_rest,   &Arrays::shape};
    static_assert(std::size(members) == kAttributeCount);
    return arrays.*members[attribute];
}
template <class T>
const std::vector<T>& attribute_values(const SplatArrays<T>& arrays, int attribute) {
    return attribute_values(const_cast<SplatArrays<T>&>(arrays), attribute);
}

struct SplatAttribute {
    const char* name;           // name of its buffers and in messages; d_<name> is its gradient
    const char* file_name;      // name in dumps and PLY columns: see ply_column
    int file_place;             // position of its columns in a PLY
    std::uint32_t floats;       // number of floats per splat
    bool per_coefficient;       // `floats` for each harmonic above the first; files store them
                                // channel by channel
    bool optional;              // a model may lack it: then its array and buffers are empty
    bool copied_to_new;         // density control copies it to new splats; false: it starts at 0
    int step;                   // STEP_*
    float (*from_file)(float);  // which infinities are meaningful; null: none
};

constexpr std::array<SplatAttribute, kAttributeCount> kSplatAttributes{{
    {"position", "xyz", 0, 3, false, false, true, STEP_PLAIN, nullptr},
    {"log_scale", "scale", 4, 3, false, false, true, STEP_SCALE, limit_infinite_log_scale},
    {"rotation", "rot", 5, 4, false, false, true, STEP_PLAIN, nullptr},
    {"opacity_logit", "opacity", 3, 1, false, false, true, STEP_OPACITY, limit_infinite_logit},
    {"sh_dc", "f_dc", 1, 3, false, false, true, STEP_PLAIN, nullptr},
    {"sh_rest", "f_rest", 2, 3, true, false, true, STEP_REST, nullptr},
    {"shape", "shape", 6, 1, false, true, true, STEP_PLAIN, nullptr},
}};

constexpr const char* attribute_name(int attribute) {
    return kSplatAttributes[static_cast<std::size_t>(attribute)].name;
}

/// Number of floats per splat; for an optional attribute, of a model that has it.
constexpr std::uint32_t attribute_floats(int attribute, int sh_degree) {
    const SplatAttribute& row = kSplatAttributes[static_cast<std::size_t>(attribute)];
    const auto bands = static_cast<std::uint32_t>(sh_degree + 1);
    return row.per_coefficient ? row.floats * (bands * bands - 1) : row.floats;
}

/// Floats per splat, over all attributes that are not optional.
constexpr std::uint32_t splat_floats(int sh_degree) {
    std::uint32_t sum = 0;
    for (int a = 0; a < kAttributeCount; ++a)
        if (!kSplatAttributes[static_cast<std::size_t>(a)].optional)
            sum += attribute_floats(a, sh_degree);
    return sum;
}

/// The attributes in the order of their PLY columns.
constexpr std::array<int, kAttributeCount> attributes_in_file_order() {
    std::array<int, kAttributeCount> order{};
    for (int a = 0; a < kAttributeCount; ++a)
        order[static_cast<std::size_t>(kSplatAttributes[static_cast<std::size_t>(a)].file_place)] =
            a;
    return order;
}

/// The column of float c of a splat among the columns of its attribute in files, which store
/// harmonics channel by channel: all red, then green, then blue.
constexpr std::size_t file_column(int attribute, int sh_degree, std::size_t c) {
    const SplatAttribute& row = kSplatAttributes[static_cast<std::size_t>(attribute)];
    if (!row.per_coefficient) return c;
    const std::size_t coefficients = attribute_floats(attribute, sh_degree) / row.floats;
    return c % row.floats * coefficients + c / row.floats;
}

/// The PLY property of a column: x y z; the file name alone where there is one column; else name_0
/// ...
std::string ply_column(int attribute, std::size_t column);

struct SplatModel : SplatArrays<float> {
    int sh_degree = 0;             // 0..3
    int kernel = KERNEL_GAUSSIAN;  // shaders/shared/kernel_list.h
    Footprint footprint = Footprint::psi;
    bool antialias = false;      // SplatRenderMode: mip
    glm::dvec3 origin{0.0};      // added to every position on save; positions are relative to it
    double metres_per_unit = 0;  // how long a world unit is; 0: not known
    EarthPlace place;            // where the scene lies on earth, if that is known

    size_t size() const { return opacity_logit.size(); }
    int rest_count() const { return static_cast<int>(attribute_floats(kShRest, sh_degree)); }
    /// Number of floats per splat; 0 for an optional attribute that the model lacks.
    std::uint32_t floats(int attribute) const {
        const bool held = !kSplatAttributes[static_cast<size_t>(attribute)].optional ||
                          !attribute_values(*this, attribute).empty();
        return held ? attribute_floats(attribute, sh_degree) : 0;
    }
    /// Resizes all arrays, except those of optional attributes that the model lacks.
    void resize(size_t count) {
        for (int a = 0; a < kAttributeCount; ++a)
            attribute_values(*this, a).resize(count * floats(a));
    }
};

/// The opacity, 0 to 1, for a logit.
inline double sigmoid(double logit) {
    return 1 / (1 + std::exp(-logit));
}

// Which splats are too transparent to be drawn by anybody.

/// The opacity (of the sigmoid, 0 to 1) below which a splat is never drawn, where `cutoff` is the
/// least alpha that is blended. It is lower by more than an opacity in float32 may be off, which is
/// about 1e-6 of it.
constexpr double undrawn_below(double cutoff) {
    return cutoff * (1 - 1e-4);
}

// The contract of SplatModel's arrays.

/// Throws Error where the degree or the length of an array is wrong, or the kernel needs shapes and
/// the splats have none.
void check_splat_shapes(const SplatModel& model);

/// Whether splats of this kernel have an attribute: optional ones depend on the kernel.
bool kernel_takes(int kernel, int attribute);
/// Sets the kernel. Where it takes shapes, splats without one get 0, the start value; where it does
/// not, shapes are removed.
void set_kernel(SplatModel& model, int kernel);
/// The same for a scene that was read: adds a note where its kernel takes shapes but the file has
/// none.
void settle_shapes(SplatModel& model, std::vector<std::string>& notes);

}  // namespace darb
