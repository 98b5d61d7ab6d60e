// SPDX-License-Identifier: MIT
#include "engine/scene/dot_splat.h"

#include <fmt/format.h>
#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "engine/core/error.h"
#include "engine/core/text.h"
#include "engine/kernels/kernel_profile.h"
#include "engine/kernels/shaped_kernel.h"
#include "engine/scene/edit_splats.h"
#include "engine/scene/quantise.h"
#include "engine/scene/splat_format.h"
#include "engine/scene/splat_model.h"
#include "engine/scene/stored_units.h"
#include "shaders/shared/kernel_forms.h"
#include "shaders/shared/limits.h"

namespace darb {

namespace {

constexpr std::size_t kRecord = 32;    // bytes
constexpr std::size_t kProbed = 1000;  // records
constexpr double kNormSlack = 0.05;    // tolerance of a rotation's length; rounding takes up to
                                       // 0.016
constexpr float kLargestScale = 1e6f;  // limit in a file that looks like a .splat, world units

std::array<float, 4> rotation_of_record(std::span<const std::byte> record) {
    std::array<float, 4> q{};
    for (std::size_t i = 0; i < 4; ++i) q[i] = (static_cast<float>(record[28 + i]) - 128) / 128;
    return q;
}

void store_record(std::span<const std::byte> record, std::size_t at, bool logarithms,
                  SplatModel& model) {
    for (std::size_t i = 0; i < 3; ++i) {
        model.position[3 * at + i] = load_le<float>(record, 4 * i);
        const auto scale = load_le<float>(record, 12 + 4 * i);  // the logarithm of < 0 is NaN
        model.log_scale[3 * at + i] = logarithms   ? scale
                                      : scale == 0 ? -static_cast<float>(LOG_SCALE_LIMIT)
                                                   : std::log(scale);
        model.sh_dc[3 * at + i] =
            static_cast<float>(dc_of_colour(static_cast<double>(record[24 + i]) / 255));
    }
    model.opacity_logit[at] = logit_of_byte(static_cast<std::uint8_t>(record[27]));
    const std::array<float, 4> q = rotation_of_record(record);
    std::copy(q.begin(), q.end(), &model.rotation[4 * at]);
}

bool has_negative_scales(std::span<const std::byte> file) {
    for (std::size_t at = 0; at + kRecord <= file.size(); at += kRecord)
        for (std::size_t k = 0; k < 3; ++k)
            if (load_le<float>(file, at + 12 + 4 * k) < 0) return true;
    return false;
}

}  // namespace

bool looks_like_dot_splat(std::span<const std::byte> file) {
    if (file.empty() || file.size() % kRecord != 0) return false;
    for (std::size_t i = 0; i < std::min(file.size() / kRecord, kProbed); ++i) {
        const auto record = file.subspan(i * kRecord, kRecord);
        float square = 0;
        for (const float part : rotation_of_record(record)) square += part * part;
        if (std::abs(std::sqrt(square) - 1) > kNormSlack) return false;
        for (std::size_t k = 0; k < 3; ++k) {
            const auto scale = load_le<float>(record, 12 + 4 * k);
            if (!std::isfinite(load_le<float>(record, 4 * k)) || !(scale >= 0) ||
                scale > kLargestScale)
                return false;
        }
    }
    return true;
}

namespace {

constexpr std::size_t kLeastInPhase = 32;  // records: fewer are not judged

/// The share of records whose rotation has length 1, where records begin at this byte.
double share_in_phase(std::span<const std::byte> file, std::size_t first) {
    const std::size_t records = (file.size() - first) / kRecord,
                      step = std::max<std::size_t>(1, records / kProbed);
    std::size_t looked = 0, unit = 0;
    for (std::size_t i = 0; i < records; i += step, ++looked) {
        float square = 0;
        for (const float part : rotation_of_record(file.subspan(first + i * kRecord, kRecord)))
            square += part * part;
        unit += std::abs(std::sqrt(square) - 1) <= kNormSlack ? 1 : 0;
    }
    return static_cast<double>(unit) / static_cast<double>(std::max<std::size_t>(looked, 1));
}

/// Refuses a file whose beginning is missing: its rotations have length 1 in another place of each
/// record. Of bytes at random every eighth has.
void check_phase(std::span<const std::byte> file, const std::string& where) {
    constexpr double kFew = 0.5, kNearlyAll = 0.95;
    if (file.size() / kRecord < kLeastInPhase || share_in_phase(file, 0) > kFew) return;
    for (std::size_t first = 1; first < kRecord; ++first)
        if (share_in_phase(file, first) > kNearlyAll)
            throw Error(where,
                        fmt::format("has records of 32 bytes that begin at byte {}, not at 0: "
                                    "what stood before them is missing",
                                    first),
                        "Copy or export the file again, from its beginning.");
}

}  // namespace

SplatModel parse_dot_splat(std::span<const std::byte> file, const std::string& where,
                           std::size_t* dropped, bool logarithms) {
    check_phase(file, where);
    if (file.size() % kRecord != 0)
        throw Error(
            where,
            fmt::format("has {} bytes; a .splat file has 32 for each splat, and {} are left "
                        "after record {}",
                        file.size(), file.size() % kRecord, file.size() / kRecord),
            "The file is cut off or no .splat file: export or copy it again.");
    SplatModel model;
    model.resize(file.size() / kRecord);
    for (std::size_t i = 0; i < model.size(); ++i)
        store_record(file.subspan(i * kRecord, kRecord), i, logarithms, model);
    const std::size_t gone = drop_non_finite(model);
    if (dropped) *dropped = gone;
    return model;
}

std::vector<std::byte> encode_dot_splat(const SplatModel& model) {
    check_splat_shapes(model);
    std::vector<std::byte> file(model.size() * kRecord);
    for (std::size_t i = 0; i < model.size(); ++i) {
        std::byte* record = &file[i * kRecord];
        const glm::dvec3 p = position_of(model, i);
        const float* q = &model.rotation[4 * i];
        const double length = std::sqrt(double{q[0]} * q[0] + double{q[1]} * q[1] +
                                        double{q[2]} * q[2] + double{q[3]} * q[3]);
        for (std::size_t k = 0; k < 3; ++k) {
            const float values[2] = {static_cast<float>(p[static_cast<int>(k)]),
                                     std::exp(drawn_log_scale(model.log_scale[3 * i + k]))};
            std::memcpy(record + 4 * k, &values[0], 4);
            std::memcpy(record + 12 + 4 * k, &values[1], 4);
            record[24 + k] = std::byte{nearest_byte(255 * colour_of_dc(model.sh_dc[3 * i + k]))};
        }
        record[27] = std::byte{byte_of_logit(model.opacity_logit[i])};
        for (std::size_t k = 0; k < 4; ++k)
            record[28 + k] = std::byte{nearest_byte(128 + (length > 0 ? 128 * q[k] / length : 0))};
    }
    return file;
}

const SplatFormatRow& dot_splat_format() {
    static const SplatFormatRow row{
        .name = ".splat",
        .endings = {".splat"},
        .recognise =
            [](const SplatSource& source) {
                return lower(source.where).ends_with(".splat") ||
                       looks_like_dot_splat(source.bytes);
            },
        .parse =
            [](const SplatSource& source, SplatFile& file) {
                const bool logarithms = source.units.scales == StoredScales::logarithms;
                SplatModel model =
                    parse_dot_splat(source.bytes, source.where, &file.dropped, logarithms);
                if (file.dropped > 0 && has_negative_scales(source.bytes))
                    file.notes.emplace_back(kScalesBelow0);
                return model;
            },
        .encode = [](const SplatModel& model, const std::string&,
                     const EncodeOptions&) { return EncodedSplats{encode_dot_splat(model)}; },
        .cuts =
            [](const SplatModel& model, const std::string&) {
                const std::size_t count = count_outside(model.sh_dc, dc_of_colour(-1 / 510.0),
                                                        dc_of_colour(1 + 1 / 510.0));
                std::vector<std::string> losses;
                if (count > 0)
                    losses.push_back(fmt::format("{} colours outside 0 to 1 are cut to it", count));
                return losses;
            }};
    return row;
}

namespace {

constexpr double kMostScaledOpacity = 0.999;

float scaled_logit(float logit, double factor) {
    const double opacity = std::min(factor / (1 + std::exp(-double{logit})), kMostScaledOpacity);
    return static_cast<float>(std::log(opacity / (1 - opacity)));
}

/// Converts each splat by its own shape, interpolating between fits at kFits shapes; returns the
/// means.
GaussianEquivalent convert_shapes(const SplatModel& model, bool keep_opacity, SplatModel& result) {
    constexpr int kFits = 64;
    const ShapedKernel& kernel = shaped_kernel(model.kernel);
    const bool is_gaussian =
        kernel_profile(model.kernel).form == KERNEL_FORM_GES;  // whose Gaussians have another size
    const double first = kernel.first_shape(), step = (kernel.last_shape() - first) / (kFits - 1);
    std::vector<GaussianEquivalent> fits;
    for (int k = 0; k < kFits; ++k)
        fits.push_back(kernel.gaussian(
            model.footprint, kernel.exponent(model.footprint, first + k * step), keep_opacity));
    GaussianEquivalent mean{0, 0, 0};
    double weights = 0;
    for (std::size_t i = 0; i < model.size(); ++i) {
        const double at = std::clamp((model.shape[i] - first) / step, 0.0, kFits - 1.0);
        const auto k = std::min(static_cast<std::size_t>(at), fits.size() - 2);
        const double part = at - static_cast<double>(k);
        const auto between = [&](double GaussianEquivalent::*of) {
            return fits[k].*of + part * (fits[k + 1].*of - fits[k].*of);
        };
        const double covariance =
            is_gaussian ? kernel.covariance_scale(model.footprint,
                                                  kernel.exponent(model.footprint, model.shape[i]))
                        : between(&GaussianEquivalent::covariance);
        const double opacity = between(&GaussianEquivalent::opacity);
        for (std::size_t c = 3 * i; c < 3 * i + 3; ++c)
            result.log_scale[c] =
                static_cast<float>(model.log_scale[c] + 0.5 * std::log(covariance));
        if (!keep_opacity) result.opacity_logit[i] = scaled_logit(model.opacity_logit[i], opacity);
        const double weight = sigmoid(model.opacity_logit[i]);
        weights += weight;
        mean.covariance += weight * covariance;
        mean.opacity += weight * opacity;
        mean.error += weight * between(&GaussianEquivalent::error);
    }
    if (!(weights > 0)) return {1, 1, 0};
    return {mean.covariance / weights, mean.opacity / weights, mean.error / weights};
}

}  // namespace

SplatModel as_gaussians(const SplatModel& model, bool keep_opacity, GaussianEquivalent* fit) {
    check_splat_shapes(model);
    GaussianEquivalent nearest{1, 1, 0};
    SplatModel result = model;
    if (kernel_has_shape(model.kernel)) {
        nearest = convert_shapes(model, keep_opacity, result);
    } else if (model.kernel != KERNEL_GAUSSIAN) {
        nearest = gaussian_equivalent(model.kernel, model.footprint, keep_opacity);
        const double grown = 0.5 * std::log(nearest.covariance);
        for (float& value : result.log_scale) value = static_cast<float>(value + grown);
        if (nearest.opacity != 1)
            for (float& value : result.opacity_logit) value = scaled_logit(value, nearest.opacity);
    }
    set_kernel(result, KERNEL_GAUSSIAN);
    result.footprint = Footprint::psi;
    if (fit) *fit = nearest;
    return result;
}

}  // namespace darb
