// SPDX-License-Identifier: MIT
// Helpers for the tests of splat files: scenes whose values every format can hold, the error that a
// reader throws, and hostile variants of a file.
#pragma once

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <glm/gtc/quaternion.hpp>
#include <span>
#include <string>
#include <vector>

#include "engine/core/error.h"
#include "engine/core/rng.h"
#include "engine/scene/splat_model.h"
#include "tests/support/test_scene.h"

namespace darb::test {

using FileBytes = std::vector<std::byte>;
using Reader = std::function<SplatModel(std::span<const std::byte>)>;

/// Appends a splat along the axes; sizes are standard deviations.
inline void append_splat(const glm::dvec3& at, const glm::dvec3& sizes, float opacity_logit,
                         SplatModel& m) {
    for (int c = 0; c < 3; ++c) {
        m.position.push_back(static_cast<float>(at[c]));
        m.log_scale.push_back(static_cast<float>(std::log(sizes[c])));
        m.sh_dc.push_back(0.5f);
    }
    for (const float w : {1.0f, 0.0f, 0.0f, 0.0f}) m.rotation.push_back(w);
    m.opacity_logit.push_back(opacity_logit);
}

inline SplatModel sample_model(int degree, size_t count, std::uint64_t seed = 1) {
    return random_scene({.count = count,
                         .sh_degree = degree,
                         .min_log_scale = -6,
                         .max_log_scale = 1,
                         .min_logit = -5,
                         .max_logit = 5,
                         .seed = seed})
        .model;
}

/// The message of the Error; "no error" where there is none.
inline std::string error_of(const std::function<void()>& action) {
    try {
        action();
    } catch (const Error& error) {
        return error.what();
    }
    return "no error";
}

inline bool same_splats(const SplatModel& a, const SplatModel& b) {
    return a.sh_degree == b.sh_degree && a.antialias == b.antialias && a.origin == b.origin &&
           a.position == b.position && a.log_scale == b.log_scale && a.rotation == b.rotation &&
           a.opacity_logit == b.opacity_logit && a.sh_dc == b.sh_dc && a.sh_rest == b.sh_rest;
}

inline void append_text(const std::string& text, FileBytes& to) {
    for (const char c : text) to.push_back(static_cast<std::byte>(c));
}

template <class T>
void append_value(T value, FileBytes& to) {
    const auto bytes = std::as_bytes(std::span(&value, 1));
    to.insert(to.end(), bytes.begin(), bytes.end());
}

template <class T>
void set_value(T value, size_t at, FileBytes& file) {
    const auto bytes = std::as_bytes(std::span(&value, 1));
    std::copy(bytes.begin(), bytes.end(), file.begin() + static_cast<std::ptrdiff_t>(at));
}

/// Checks that every proper prefix of the file gives an Error that names the file.
inline void expect_truncation_is_refused(const FileBytes& file, const Reader& read,
                                         size_t step = 1) {
    for (size_t length = 0; length < file.size(); length += step) {
        const FileBytes part(file.begin(), file.begin() + static_cast<std::ptrdiff_t>(length));
        const std::string error = error_of([&] { read(part); });
        ASSERT_NE(error, "no error") << "length " << length << " of " << file.size();
        ASSERT_EQ(error.find("test"), 0u) << error;
        ASSERT_NE(error.find("\n  "), std::string::npos) << "no remedy in: " << error;
    }
}

/// Checks that changed bytes give a model or an Error, whatever they are.
inline void expect_damage_is_survived(const FileBytes& file, const Reader& read, int rounds) {
    Pcg32 rng(3);
    for (int round = 0; round < rounds; ++round) {
        FileBytes damaged = file;
        for (std::uint32_t changes = 1 + rng.below(4); changes > 0; --changes)
            damaged[rng.below(static_cast<std::uint32_t>(file.size()))] =
                static_cast<std::byte>(rng.below(256));
        const std::string error = error_of([&] {
            const SplatModel model = read(damaged);
            EXPECT_EQ(model.position.size(), 3 * model.size());
        });
        EXPECT_FALSE(error.empty());
    }
}

inline double opacity_of(float logit) {
    return 1 / (1 + std::exp(-double{logit}));
}

/// |p . q| of the unit quaternions of splats i and j: 1 where they are the same rotation.
inline double same_rotation(const SplatModel& a, size_t i, const SplatModel& b, size_t j) {
    const float *p = &a.rotation[4 * i], *q = &b.rotation[4 * j];
    return std::abs(glm::dot(glm::normalize(glm::dquat(p[0], p[1], p[2], p[3])),
                             glm::normalize(glm::dquat(q[0], q[1], q[2], q[3]))));
}

/// R S S^T R^T of splat i.
inline glm::dmat3 covariance_of(const SplatModel& model, size_t i) {
    const float* q = &model.rotation[4 * i];
    glm::dmat3 axes = glm::mat3_cast(glm::normalize(glm::dquat(q[0], q[1], q[2], q[3])));
    for (int k = 0; k < 3; ++k)
        axes[k] *= std::exp(double{model.log_scale[3 * i + static_cast<size_t>(k)]});
    return axes * glm::transpose(axes);
}

}  // namespace darb::test
