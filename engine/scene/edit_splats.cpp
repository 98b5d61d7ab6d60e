// SPDX-License-Identifier: MIT
#include "engine/scene/edit_splats.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <glm/gtc/quaternion.hpp>
#include <numbers>

#include "engine/core/error.h"
#include "engine/scene/splat_model.h"
#include "shaders/shared/limits.h"

namespace darb {

namespace {

constexpr double kFarOff = 256;       // widths from 0, where float32 resolves 1/65,000 of a width
constexpr double kNoWidth = 1e4;      // for splats in one place: beyond, float32 does not resolve
                                      // millimetres
constexpr double kMostOrigin = 1e30;  // float32 numbers minus this do not overflow float32

// A reflection is that of x followed by a proper rotation. It turns the rotation of a splat into
// its conjugate, which turns the other way about the y and z axes.
void turn_rotations(const glm::dmat3& turn, std::vector<float>& rotation) {
    glm::dmat3 proper = turn;
    const double mirrored = glm::determinant(turn) < 0 ? -1 : 1;
    proper[0] *= mirrored;
    const glm::dquat by = glm::normalize(glm::quat_cast(proper));
    for (std::size_t i = 0; i < rotation.size(); i += 4) {
        const glm::dquat q(rotation[i], rotation[i + 1], mirrored * rotation[i + 2],
                           mirrored * rotation[i + 3]);
        const glm::dquat turned = by * q;
        rotation[i] = static_cast<float>(turned.w);
        rotation[i + 1] = static_cast<float>(turned.x);
        rotation[i + 2] = static_cast<float>(turned.y);
        rotation[i + 3] = static_cast<float>(turned.z);
    }
}

// Sets row i of `to` to row splats[i] of `from`. Both may be the same array where splats ascend.
void gather_rows(const std::vector<float>& from, const std::vector<std::uint32_t>& splats,
                 std::size_t width, std::vector<float>& to) {
    for (std::size_t i = 0; i < splats.size(); ++i)
        if (&from != &to || splats[i] != i)
            std::copy_n(from.begin() + static_cast<std::ptrdiff_t>(splats[i] * width), width,
                        to.begin() + static_cast<std::ptrdiff_t>(i * width));
}

void gather(const SplatModel& from, const std::vector<std::uint32_t>& splats, SplatModel& to) {
    for (int a = 0; a < kAttributeCount; ++a) {
        const std::size_t floats = from.floats(a);
        if (&from != &to) attribute_values(to, a).resize(splats.size() * floats);
        gather_rows(attribute_values(from, a), splats, floats, attribute_values(to, a));
    }
}

bool row_is_finite(const std::vector<float>& values, std::size_t row, std::size_t width) {
    const auto begin = values.begin() + static_cast<std::ptrdiff_t>(row * width);
    return std::all_of(begin, begin + static_cast<std::ptrdiff_t>(width),
                       [](float value) { return std::isfinite(value); });
}

}  // namespace

void transform_splats(const Similarity& similarity, SplatModel& model) {
    if (!(similarity.scale > 0))
        throw Error("transform", fmt::format("the scale is {}", similarity.scale),
                    "Use a scale above 0.");
    std::vector<double> positions(model.position.size());
    for (std::size_t i = 0; i < model.size(); ++i) {
        const glm::dvec3 moved =
            similarity.scale * (similarity.turn * position_of(model, i)) + similarity.translation;
        for (int axis = 0; axis < 3; ++axis)
            positions[3 * i + static_cast<std::size_t>(axis)] = moved[axis];
    }
    set_positions(positions, model);
    const double grown = std::log(similarity.scale);
    for (float& value : model.log_scale) value = static_cast<float>(value + grown);
    model.metres_per_unit /= similarity.scale;
    if (model.place.known())
        model.place = moved_place(model.place, similarity.turn, similarity.translation,
                                  model.metres_per_unit);
    if (similarity.turn == glm::dmat3(1.0)) return;
    turn_rotations(similarity.turn, model.rotation);
    rotate_sh(sh_rotation(similarity.turn), model.sh_degree, model.sh_rest);
}

glm::dvec3 choose_origin(const std::vector<double>& positions, double most) {
    const std::size_t count = positions.size() / 3;
    if (count == 0) return glm::dvec3(0.0);
    glm::dvec3 median(0.0);
    double width = 0;
    std::vector<double> values(count);
    for (std::size_t axis = 0; axis < 3; ++axis) {
        for (std::size_t i = 0; i < count; ++i) values[i] = positions[3 * i + axis];
        const auto rank = [&](std::size_t at) {
            const auto it = values.begin() + static_cast<std::ptrdiff_t>(at);
            std::nth_element(values.begin(), it, values.end());
            return *it;
        };
        median[static_cast<int>(axis)] = rank(count / 2);
        width = std::max(width, (rank(count - 1 - count / 4) - rank(count / 4)) / 2);
    }
    glm::dvec3 origin(0.0);
    if (width == 0) width = kNoWidth / most;
    const double step = std::exp2(std::floor(std::log2(width)));
    for (int axis = 0; axis < 3; ++axis)
        if (std::abs(median[axis]) > most * width && std::abs(median[axis]) < kMostOrigin)
            origin[axis] = std::round(median[axis] / step) * step;
    return origin;
}

glm::dvec3 origin_for_float32(const std::vector<double>& positions) {
    const bool exact = std::all_of(positions.begin(), positions.end(), [](double p) {
        return static_cast<double>(static_cast<float>(p)) == p;
    });
    return exact ? glm::dvec3(0.0) : choose_origin(positions, kFarOff);
}

void set_positions(const std::vector<double>& positions, SplatModel& model) {
    model.origin = origin_for_float32(positions);
    for (std::size_t i = 0; i < positions.size(); ++i)
        model.position[i] =
            static_cast<float>(positions[i] - model.origin[static_cast<int>(i % 3)]);
}

glm::dvec3 position_of(const SplatModel& model, std::size_t splat) {
    const float* p = &model.position[3 * splat];
    return model.origin + glm::dvec3(p[0], p[1], p[2]);
}

SplatModel pick_splats(const SplatModel& model, const std::vector<std::uint32_t>& splats) {
    SplatModel out;
    out.sh_degree = model.sh_degree;
    out.kernel = model.kernel;
    out.footprint = model.footprint;
    out.antialias = model.antialias;
    out.origin = model.origin;
    out.metres_per_unit = model.metres_per_unit;
    out.place = model.place;
    gather(model, splats, out);
    return out;
}

std::size_t keep_splats(const std::function<bool(std::size_t)>& keep, SplatModel& model) {
    std::vector<std::uint32_t> kept;
    for (std::size_t i = 0; i < model.size(); ++i)
        if (keep(i)) kept.push_back(static_cast<std::uint32_t>(i));
    const std::size_t gone = model.size() - kept.size();
    if (gone == 0) return 0;
    gather(model, kept, model);
    model.resize(kept.size());
    return gone;
}

bool has_only_finite(const SplatModel& model) {
    for (int a = 0; a < kAttributeCount; ++a)
        if (const std::vector<float>& values = attribute_values(model, a);
            !row_is_finite(values, 0, values.size()))
            return false;
    return true;
}

std::size_t drop_non_finite(SplatModel& model) {
    for (int a = 0; a < kAttributeCount; ++a)
        if (const auto limit = kSplatAttributes[static_cast<std::size_t>(a)].from_file)
            for (float& value : attribute_values(model, a)) value = limit(value);
    return keep_splats([&](std::size_t i) { return is_finite(model, i); }, model);
}

bool is_finite(const SplatModel& model, std::size_t splat) {
    for (int a = 0; a < kAttributeCount; ++a)
        if (!row_is_finite(attribute_values(model, a), splat, model.floats(a))) return false;
    return true;
}

bool has_rotation(const SplatModel& model, std::size_t splat) {
    double square = 0;
    for (std::size_t k = 4 * splat; k < 4 * splat + 4; ++k)
        square += double{model.rotation[k]} * model.rotation[k];
    return square > ROTATION_MIN_SQUARE;
}

std::size_t crop_splats(const glm::dvec3& low, const glm::dvec3& high, SplatModel& model) {
    return keep_splats(
        [&](std::size_t i) {
            const glm::dvec3 p = position_of(model, i);
            return glm::all(glm::lessThanEqual(low, p)) && glm::all(glm::lessThanEqual(p, high));
        },
        model);
}

std::size_t drop_undrawn(double cutoff, std::size_t first, SplatModel& model) {
    const double least = undrawn_below(cutoff);
    return keep_splats(
        [&](std::size_t i) { return i < first || !(sigmoid(model.opacity_logit[i]) < least); },
        model);
}

std::size_t prune_opacity(double least, SplatModel& model) {
    return keep_splats([&](std::size_t i) { return sigmoid(model.opacity_logit[i]) >= least; },
                       model);
}

void limit_sh_degree(int degree, SplatModel& model) {
    if (degree >= model.sh_degree) return;
    const auto before = static_cast<std::size_t>(model.rest_count());
    model.sh_degree = degree;
    const auto after = static_cast<std::size_t>(model.rest_count());
    for (std::size_t i = 0; i < model.size(); ++i)
        std::copy_n(model.sh_rest.begin() + static_cast<std::ptrdiff_t>(i * before), after,
                    model.sh_rest.begin() + static_cast<std::ptrdiff_t>(i * after));
    model.sh_rest.resize(model.size() * after);
}

glm::dmat3 turn_of_up_axis(const std::string& axis) {
    // Columns: where x, y and z are mapped.
    const glm::dvec3 x(1, 0, 0), y(0, 1, 0), z(0, 0, 1);
    if (axis == "-y") return glm::dmat3(1.0);
    if (axis == "y") return {-x, -y, z};
    if (axis == "x") return {-y, x, z};
    if (axis == "-x") return {y, -x, z};
    if (axis == "z") return {x, z, -y};
    if (axis == "-z") return {x, -z, y};
    throw Error("--up", "'" + axis + "' is no axis", "Use x, y, z, -x, -y or -z.");
}

glm::dmat3 turn_of_degrees(const glm::dvec3& degrees) {
    const glm::dvec3 half = glm::radians(degrees) / 2.0;
    const glm::dquat x(std::cos(half.x), std::sin(half.x), 0, 0);
    const glm::dquat y(std::cos(half.y), 0, std::sin(half.y), 0);
    const glm::dquat z(std::cos(half.z), 0, 0, std::sin(half.z));
    return glm::mat3_cast(z * y * x);
}

// The basis is orthonormal, so the matrix is the integral over the sphere of
//   Y_j(d) Y_k(turn^T d),
// a polynomial of degree 6 at most: four Gauss-Legendre nodes in z (exact to degree 7) times eight
// equal steps in longitude integrate it exactly.

namespace {

constexpr double kNode[2] = {0.33998104358485626, 0.86113631159405258};
constexpr double kWeight[2] = {0.65214515486254614, 0.34785484513745386};
constexpr int kLongitudes = 8;
constexpr double kNoise = 1e-14;

using Basis = std::array<double, kMaxShCoefficients>;

void add_direction(const glm::dmat3& turn, const glm::dvec3& d, double weight, ShRotation& sum) {
    const glm::dvec3 before = glm::transpose(turn) * d;
    const Basis to = sh_basis(kMaxShDegree, d.x, d.y, d.z);
    const Basis from = sh_basis(kMaxShDegree, before.x, before.y, before.z);
    for (std::size_t l = 1; l <= kMaxShDegree; ++l)
        for (std::size_t j = 0; j < 2 * l + 1; ++j)
            for (std::size_t k = 0; k < 2 * l + 1; ++k)
                sum[l][j][k] += weight * to[l * l + j] * from[l * l + k];
}

}  // namespace

ShRotation sh_rotation(const glm::dmat3& turn) {
    ShRotation sum{};
    for (int ring = 0; ring < 4; ++ring) {
        const double z = (ring < 2 ? 1 : -1) * kNode[ring % 2], r = std::sqrt(1 - z * z);
        for (int step = 0; step < kLongitudes; ++step) {
            const double angle = 2 * std::numbers::pi * step / kLongitudes;
            add_direction(turn, {r * std::cos(angle), r * std::sin(angle), z},
                          kWeight[ring % 2] * 2 * std::numbers::pi / kLongitudes, sum);
        }
    }
    for (auto& band : sum)
        for (auto& row : band)
            for (double& entry : row)
                if (std::abs(entry) < kNoise)
                    entry = 0;  // so that flips of axes keep zeros as they are
    return sum;
}

void rotate_sh(const ShRotation& rotation, int degree, std::vector<float>& sh_rest) {
    const std::size_t row = static_cast<std::size_t>((degree + 1) * (degree + 1) - 1) * 3;
    for (std::size_t at = 0; row > 0 && at < sh_rest.size(); at += row)
        for (std::size_t l = 1; l <= static_cast<std::size_t>(degree); ++l)
            for (std::size_t channel = 0; channel < 3; ++channel) {
                float* band = &sh_rest[at + (l * l - 1) * 3 + channel];
                double turned[7] = {};
                for (std::size_t j = 0; j < 2 * l + 1; ++j)
                    for (std::size_t k = 0; k < 2 * l + 1; ++k)
                        turned[j] += rotation[l][j][k] * band[k * 3];
                for (std::size_t j = 0; j < 2 * l + 1; ++j)
                    band[j * 3] = static_cast<float>(turned[j]);
            }
}

}  // namespace darb
