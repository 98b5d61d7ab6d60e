// SPDX-License-Identifier: MIT
#include "engine/scene/stored_units.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <glm/gtc/quaternion.hpp>
#include <limits>
#include <utility>

#include "engine/core/error.h"
#include "engine/core/quantile.h"
#include "engine/scene/edit_splats.h"
#include "engine/scene/quantise.h"
#include "engine/scene/splat_model.h"
#include "shaders/shared/limits.h"

namespace darb {

namespace {

constexpr std::size_t kLeastSplats = 8;  // fewer may look like anything
// Formats with few bits round the values.
constexpr double kRounded = 0.02;

constexpr std::size_t kMostSampled = 20'000;        // splats that medians are taken over
constexpr std::size_t kMostNeighbours = 1'000'000;  // splats among which neighbours are looked for
constexpr std::size_t kProbes = 128;                // splats whose neighbours are looked for
// Thresholds for rotations.
constexpr double kMostOfOneComponent = 0.5;  // share of the squares
constexpr std::size_t kFlatProbes = 2000, kLeastFlat = 100, kMostBeside = 30'000;
constexpr double kFlat = 0.7;      // the shortest axis is half as long as the next
constexpr double kDeviations = 3;  // the mean must be this many standard errors from 0
// Correlation of harmonics: those of photos have 0.6 to 0.9, and 0 when read in the wrong order.
constexpr double kCorrelated = 0.4;
constexpr std::size_t kLeastCorrelated = 100;  // splats
constexpr double kLargestLogit = 20;
constexpr double kLeastOfColours = 0.4;  // all of a scene within less is plain
constexpr double kLargestDc = 20;        // a colour six times as bright as white
// Steps of positions, as a share of a splat's size. Formats with few bits round on purpose, and
// less than half of a splat does not show.
constexpr double kCoarseFloat = 0.1, kCoarseFormat = 0.5;

struct Range {
    double least = std::numeric_limits<double>::infinity();
    double most = -std::numeric_limits<double>::infinity();
    bool whole = true;  // every value is a whole number
    void take(float v) {
        least = std::min(least, double{v});
        most = std::max(most, double{v});
        whole = whole && v == std::floor(v);
    }
    bool within(double low, double high) const { return least >= low && most <= high; }
};

/// The stride at which at most `most` splats are looked at.
std::size_t stride(const SplatModel& model, std::size_t most) {
    return std::max<std::size_t>(1, model.size() / most);
}

bool has_extent(float log_scale) {
    return log_scale > -static_cast<float>(LOG_SCALE_LIMIT) / 2;
}

glm::dvec3 local_position(const SplatModel& model, std::size_t i) {
    return {model.position[3 * i], model.position[3 * i + 1], model.position[3 * i + 2]};
}

/// Squared distances and indices of splats, ascending.
using Neighbours = std::vector<std::pair<double, std::size_t>>;

/// The nearest `count` among `among` splats that are spread over the file, or fewer.
Neighbours nearest_splats(const SplatModel& model, std::size_t probe, std::size_t count,
                          std::size_t among) {
    const glm::dvec3 at = local_position(model, probe);
    Neighbours found;
    for (std::size_t i = 0, step = stride(model, among); i < model.size(); i += step) {
        const glm::dvec3 d = local_position(model, i) - at;
        const std::pair<double, std::size_t> one{glm::dot(d, d), i};
        if (i == probe || (found.size() == count && one.first >= found.back().first)) continue;
        if (found.size() == count) found.pop_back();
        found.insert(std::lower_bound(found.begin(), found.end(), one), one);
    }
    return found;
}

/// Indices of splats, spread over the file.
std::vector<std::size_t> probes_of(const SplatModel& model, std::size_t count) {
    std::vector<std::size_t> probes;
    const std::size_t step = stride(model, count);
    for (std::size_t i = step / 2; i < model.size() && probes.size() < count; i += step)
        probes.push_back(i);
    return probes;
}

double largest_scale(const SplatModel& model, std::size_t splat) {
    const float* s = &model.log_scale[3 * splat];
    return std::max({s[0], s[1], s[2]});
}

/// The median of trained splats is 0.8 to 3.2 times as large as the distance to their neighbours.
/// Read as a logarithm, x stands for e^x, at least e times x, so one of the two readings is far
/// off.
constexpr double kUsualOverlap = 1.3;

bool are_lengths(const SplatModel& model) {
    Range range;
    for (const float s : model.log_scale)
        if (has_extent(s)) range.take(s);
    if (!range.within(-kRounded, std::numeric_limits<double>::max())) return false;
    std::vector<double> logarithms, lengths;
    for (const std::size_t probe : probes_of(model, kProbes)) {
        double square = 0;
        const Neighbours near = nearest_splats(model, probe, 3, kMostNeighbours);
        for (const auto& [distance2, splat] : near) square += distance2;
        const double distance = std::sqrt(square / static_cast<double>(near.size()));
        if (!(distance > 0)) continue;
        const double largest = largest_scale(model, probe);
        logarithms.push_back(largest - std::log(distance));
        lengths.push_back(std::log(std::max(largest, 1e-9)) - std::log(distance));
    }
    if (lengths.empty()) return false;
    const auto off = [](std::vector<double> overlaps) {
        return std::abs(median(std::move(overlaps)) - std::log(kUsualOverlap));
    };
    return off(std::move(lengths)) < off(std::move(logarithms));
}

// ---- rotations

glm::dvec3 short_axis(const float* q, const float* log_scale, bool xyzw) {
    const auto axis = static_cast<int>(std::min_element(log_scale, log_scale + 3) - log_scale);
    const glm::dquat turn =
        xyzw ? glm::dquat(q[3], q[0], q[1], q[2]) : glm::dquat(q[0], q[1], q[2], q[3]);
    return glm::mat3_cast(glm::normalize(turn))[axis];
}

/// Trained splats lie in the surfaces that they represent: their neighbours are beside them rather
/// than along their shortest axis. Turning the scene by 180 degrees gives the component of one axis
/// the usual size of that of the angle, so component sizes alone say nothing.
bool are_xyzw(const SplatModel& model) {
    std::array<double, 4> square{};
    for (const std::size_t i : probes_of(model, kMostSampled)) {
        const float* q = &model.rotation[4 * i];
        const double length2 =
            double{q[0]} * q[0] + double{q[1]} * q[1] + double{q[2]} * q[2] + double{q[3]} * q[3];
        for (std::size_t k = 0; k < 4 && length2 > 0; ++k) square[k] += q[k] * q[k] / length2;
    }
    const double sum = square[0] + square[1] + square[2] + square[3];
    if (!(square[3] > kMostOfOneComponent * sum) || square[0] > square[3] / 2) return false;
    std::vector<double> gains;
    for (const std::size_t probe : probes_of(model, kFlatProbes)) {
        const float *q = &model.rotation[4 * probe], *s = &model.log_scale[3 * probe];
        std::array<float, 3> sorted{s[0], s[1], s[2]};
        std::sort(sorted.begin(), sorted.end());
        if (sorted[1] - sorted[0] < kFlat || !has_rotation(model, probe)) continue;
        const glm::dvec3 usual = short_axis(q, s, false), other = short_axis(q, s, true);
        double gain = 0;
        for (const auto& [distance2, splat] : nearest_splats(model, probe, 12, kMostBeside)) {
            if (!(distance2 > 0)) continue;
            const glm::dvec3 to = (local_position(model, splat) - local_position(model, probe)) /
                                  std::sqrt(distance2);
            gain += std::pow(glm::dot(to, usual), 2) - std::pow(glm::dot(to, other), 2);
        }
        gains.push_back(gain);
    }
    if (gains.size() < kLeastFlat) return false;
    double mean = 0, variance = 0;
    for (const double gain : gains) mean += gain / static_cast<double>(gains.size());
    for (const double gain : gains) variance += std::pow(gain - mean, 2);
    const auto count = static_cast<double>(gains.size());
    return mean > kDeviations * std::sqrt(variance) / count;
}

// ---- harmonics

/// Where the model has the value that a file in the other order stores for a coefficient and
/// channel, with `coefficients` above the first.
std::size_t swapped_place(std::size_t coefficient, std::size_t channel, std::size_t coefficients,
                          bool by_channel) {
    if (by_channel) {  // the file is coefficient by coefficient, but was read channel by channel
        const std::size_t column = 3 * coefficient + channel;
        return column % coefficients * 3 + column / coefficients;
    }
    return channel * coefficients + coefficient;
}

/// The mean correlation of green and blue with red. Light has little colour, so they follow each
/// other where they belong to one coefficient.
template <class Place>
double correlation(const SplatModel& model, std::size_t coefficients, const Place& place) {
    double sum = 0, count = 0;
    const std::vector<std::size_t> probes = probes_of(model, kMostSampled / 4);
    for (std::size_t k = 0; k < coefficients; ++k)
        for (std::size_t channel = 1; channel < 3; ++channel) {
            double x = 0, y = 0, xx = 0, yy = 0, xy = 0;
            for (const std::size_t i : probes) {
                const float* rest = &model.sh_rest[3 * coefficients * i];
                const double a = rest[place(k, 0)], b = rest[place(k, channel)];
                x += a, y += b, xx += a * a, yy += b * b, xy += a * b;
            }
            const auto n = static_cast<double>(probes.size());
            const double spread = (xx / n - x * x / n / n) * (yy / n - y * y / n / n);
            if (!(spread > 0)) continue;
            sum += (xy / n - x * y / n / n) / std::sqrt(spread);
            ++count;
        }
    return count > 0 ? sum / count : 0;
}

bool are_swapped(const SplatModel& model, bool by_channel) {
    const auto coefficients = static_cast<std::size_t>(model.rest_count() / 3);
    if (coefficients < 2 || model.size() < kLeastCorrelated) return false;
    const double usual =
        correlation(model, coefficients, [](std::size_t k, std::size_t c) { return 3 * k + c; });
    if (usual > kCorrelated) return false;
    const double other = correlation(model, coefficients, [&](std::size_t k, std::size_t c) {
        return swapped_place(k, c, coefficients, by_channel);
    });
    return other > kCorrelated && other > usual + kCorrelated / 2;
}

// ---- opacities and colours

StoredOpacities opacities_of(const SplatModel& model) {
    Range range;
    for (const float v : model.opacity_logit) range.take(v);
    const bool one_value = range.least == range.most;
    if (range.within(-kRounded, 1 + kRounded) && (!one_value || range.least == 1))
        return StoredOpacities::linear;
    // A logit of 20 differs from an opacity of 1 by a billionth, and training never gives whole
    // numbers.
    if (range.within(0, 255) && range.whole && range.most > kLargestLogit && !one_value)
        return StoredOpacities::bytes;
    return StoredOpacities::logits;
}

StoredColours colours_of(const SplatModel& model) {
    Range range;
    for (const float v : model.sh_dc) range.take(v);
    if (range.within(-kRounded, 1 + kRounded) && range.most - range.least > kLeastOfColours)
        return StoredColours::rgb;
    if (range.within(0, 255 + kRounded) && range.most > kLargestDc) return StoredColours::bytes;
    return StoredColours::harmonics;
}

[[noreturn]] void refuse(const std::string& where, const char* option, const char* what) {
    throw Error(where, fmt::format("{}, which {} cannot read", what, option),
                fmt::format("Leave {} out.", option));
}

void make_logarithms(const std::string& where, SplatModel& model) {
    if (std::ranges::any_of(model.log_scale,
                            [](float s) { return has_extent(s) && s < -kRounded; }))
        refuse(where, "--scales linear", "has scales below 0");
    for (float& s : model.log_scale) s = limit_infinite_log_scale(std::log(std::max(s, 0.0f)));
}

void make_logits(double most, const char* option, const std::string& where, SplatModel& model) {
    const auto outside = [&](float v) { return v < -kRounded * most || v > most * (1 + kRounded); };
    if (std::ranges::any_of(model.opacity_logit, outside))
        refuse(where, option, "has opacities outside of the range");
    for (float& v : model.opacity_logit) {
        const double opacity = std::clamp(v / most, 0.0, 1.0);
        v = limit_infinite_logit(static_cast<float>(std::log(opacity) - std::log1p(-opacity)));
    }
}

}  // namespace

void apply_stored_units(const StoredUnits& units, bool by_channel, const std::string& where,
                        SplatModel& model) {
    if (units.scales == StoredScales::linear) make_logarithms(where, model);
    if (units.opacities == StoredOpacities::linear)
        make_logits(1, "--opacities linear", where, model);
    if (units.opacities == StoredOpacities::bytes)
        make_logits(255, "--opacities bytes", where, model);
    if (units.colours != StoredColours::harmonics) {
        const double most = units.colours == StoredColours::bytes ? 255 : 1;
        for (float& v : model.sh_dc) v = static_cast<float>(dc_of_colour(v / most));
    }
    if (units.rotations == StoredRotations::xyzw)
        for (std::size_t i = 0; i < model.size(); ++i) {
            float* q = &model.rotation[4 * i];
            std::rotate(q, q + 3, q + 4);
        }
    const auto coefficients = static_cast<std::size_t>(model.rest_count() / 3);
    if (units.harmonics == StoredOrder::usual || coefficients == 0) return;
    std::vector<float> read(3 * coefficients);
    for (std::size_t i = 0; i < model.size(); ++i) {
        float* rest = &model.sh_rest[3 * coefficients * i];
        std::copy(rest, rest + 3 * coefficients, read.begin());
        for (std::size_t k = 0; k < coefficients; ++k)
            for (std::size_t c = 0; c < 3; ++c)
                rest[3 * k + c] = read[swapped_place(k, c, coefficients, by_channel)];
    }
}

std::vector<std::string> unit_doubts(const SplatModel& model, bool by_channel) {
    std::vector<std::string> doubts;
    if (model.size() < kLeastSplats) return doubts;
    if (are_lengths(model))
        doubts.emplace_back(
            "its scales are all positive and, as logarithms, of splats far larger than their "
            "distances; they look like lengths, and --scales linear reads them as such");
    const StoredOpacities opacities = opacities_of(model);
    if (opacities == StoredOpacities::linear)
        doubts.emplace_back(
            "its opacities all lie within 0 and 1, which logits do not; they look like opacities, "
            "and --opacities linear reads them as such");
    if (opacities == StoredOpacities::bytes)
        doubts.emplace_back(
            "its opacities are all whole numbers of 0 to 255, which logits are not; "
            "--opacities bytes reads them as opacities");
    const StoredColours colours = colours_of(model);
    if (colours == StoredColours::rgb)
        doubts.emplace_back(
            "its f_dc all lie within 0 and 1, which would be pale colours alone; they look like "
            "red, green and blue, and --colours rgb reads them as such");
    if (colours == StoredColours::bytes)
        doubts.emplace_back(
            "its f_dc all lie within 0 and 255, which would be colours far brighter than white; "
            "--colours bytes reads them as red, green and blue");
    if (are_xyzw(model))
        doubts.emplace_back(
            "its rotations fit the surfaces better with the last of their four numbers read as the "
            "first; --rotations xyzw reads them so");
    if (are_swapped(model, by_channel))
        doubts.emplace_back(
            "its harmonics of red, green and blue follow each other only where they are read in "
            "another order of channels; --harmonics swapped reads them so");
    return doubts;
}

bool were_float32(std::vector<double> values) {
    std::sort(values.begin(), values.end());
    for (std::size_t i = 1; i < values.size(); ++i)
        if (values[i] != values[i - 1] &&
            static_cast<float>(values[i]) == static_cast<float>(values[i - 1]))
            return false;
    return true;
}

double float32_step(double value) {
    const auto at = static_cast<float>(std::abs(value));
    if (!std::isfinite(at)) return 0;
    return double{std::nextafter(at, std::numeric_limits<float>::infinity())} - double{at};
}

std::string position_doubt(const SplatModel& model, double step) {
    if (model.size() < kLeastSplats) return {};
    const std::vector<std::size_t> probes = probes_of(model, kMostSampled);
    std::vector<double> sizes, places;
    for (const std::size_t i : probes) {
        std::array<float, 3> s{model.log_scale[3 * i], model.log_scale[3 * i + 1],
                               model.log_scale[3 * i + 2]};
        std::sort(s.begin(), s.end());
        sizes.push_back(std::exp(double{s[1]}));
    }
    const double size = nearest_rank(sizes, 0.5);
    double farthest = 0;
    for (std::size_t axis = 0; axis < 3; ++axis) {
        const double origin = model.origin[static_cast<int>(axis)];
        const auto middle = [&](double from) {
            places.clear();
            for (const std::size_t i : probes)
                places.push_back(std::abs(from + double{model.position[3 * i + axis]}));
            return nearest_rank(places, 0.5);
        };
        double far = middle(origin);  // places are now world coordinates
        if (origin != 0 && !(float32_step(far) > kCoarseFloat * size && were_float32(places)))
            far = middle(0);
        farthest = std::max(farthest, far);
    }
    const double of_float = float32_step(farthest);
    if (!(of_float > kCoarseFloat * size || step > kCoarseFormat * size)) return {};
    return fmt::format(
        "its positions lie in steps of {:.3g}{}, and half of its splats are smaller than {:.3g}: "
        "they were rounded when the file was written, which nothing undoes. Export the scene with "
        "x, y and z as double, as darb writes PLY, or moved to 0 first (darb convert --translate)",
        std::max(step, of_float),
        of_float >= step ? fmt::format(", as float32 does {:.0f} from 0", farthest) : "", size);
}

}  // namespace darb
