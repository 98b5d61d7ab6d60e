#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "engine/core/check.h"
#include "engine/core/error.h"
#include "engine/scene/edit_splats.h"
#include "engine/scene/inflate.h"
#include "engine/scene/quantise.h"
#include "engine/scene/splat_shapes.h"
#include "engine/scene/spz.h"
#include "engine/scene/spz_layout.h"
#include "shaders/shared/limits.h"

namespace darb {

namespace {

using Stream = std::vector<std::byte>;

constexpr int kUsualBits = 12;   // fractional; 0.24 mm where the unit is a metre
constexpr int kLeastSteps = 17;  // 2^17 of them across the largest coordinate, where they fit
constexpr int kSteps = 23;       // 24 bits with sign
constexpr int kCoarsestOfDegree1 = 8, kCoarsestOfHigher = 16;  // of the reference writer

// Where bytes end, and half a step of each, which is rounding.
constexpr double kLeastLogScale = -10, kMostLogScale = 255 / 16.0 - 10, kHalfLogScale = 1 / 32.0;
constexpr double kMostDc = 0.5 / spz::kColourScale, kHalfDc = kMostDc / 255;
constexpr double kLeastHarmonic = -1, kMostHarmonic = 127 / 128.0;
constexpr double kHalfHarmonic = kCoarsestOfDegree1 / 256.0;

const glm::dmat3 kToRightUpBack(1, 0, 0, 0, -1, 0, 0, 0, -1);

double largest_coordinate(const SplatModel& model) {
    double largest = 0;
    for (std::size_t i = 0; i < model.size(); ++i) {
        const glm::dvec3 p = glm::abs(position_of(model, i));
        largest = std::max({largest, p.x, p.y, p.z});
    }
    return largest;
}

int choose_fractional_bits(const SplatModel& model, const std::string& where) {
    const double largest = largest_coordinate(model);
    if (largest == 0) return kUsualBits;
    const int exponent = std::ilogb(largest);  // 2^exponent <= largest < 2^(exponent + 1)
    const int fitting = kSteps - 1 - exponent;
    if (fitting < 0)
        throw Error(where, fmt::format("positions reach {:g}, beyond the 24 bits of SPZ", largest),
                    "Move the scene to the origin with --translate, or write a PLY.");
    return std::min({fitting, std::max(kUsualBits, kLeastSteps - exponent), kSteps});
}

void append(std::uint64_t value, std::size_t bytes, Stream& to) {
    for (std::size_t i = 0; i < bytes; ++i)
        to.push_back(static_cast<std::byte>(value >> (8 * i) & 255));
}

std::uint32_t pack_rotation(const float* q) {  // w x y z
    const SmallestThree three = smallest_three({q[1], q[2], q[3], q[0]});
    auto packed = static_cast<std::uint32_t>(three.largest);
    for (const double part : three.others) {
        const auto size =
            static_cast<std::uint32_t>(std::round(std::abs(part) * std::numbers::sqrt2 * 511));
        packed = packed << 10 | (part < 0 ? 512u : 0u) | std::min(size, 511u);
    }
    return packed;
}

std::uint8_t pack_harmonic(float value, int step) {
    return nearest_byte(std::round((value + 1.0) * 128 / step) * step);
}

std::array<Stream, 6> pack(const SplatModel& model, int fractional_bits, const SpzSteps& keep) {
    std::array<Stream, 6> streams;
    const auto rest = static_cast<std::size_t>(model.rest_count());
    for (std::size_t i = 0; i < model.size(); ++i) {
        const glm::dvec3 p = position_of(model, i);
        streams[1].push_back(std::byte{byte_of_logit(model.opacity_logit[i])});
        append(pack_rotation(&model.rotation[4 * i]), 4, streams[4]);
        for (int axis = 0; axis < 3; ++axis) {
            const std::size_t at = 3 * i + static_cast<std::size_t>(axis);
            const double most = (1 << kSteps) - 1;
            const double steps =
                std::clamp(std::round(std::ldexp(p[axis], fractional_bits)), -most, most);
            append(static_cast<std::uint32_t>(static_cast<std::int32_t>(steps)), 3, streams[0]);
            streams[2].push_back(
                std::byte{nearest_byte(255 * (model.sh_dc[at] * spz::kColourScale + 0.5))});
            streams[3].push_back(std::byte{nearest_byte((model.log_scale[at] + 10) * 16)});
        }
        for (std::size_t c = 0; c < rest; ++c)
            streams[5].push_back(std::byte{
                pack_harmonic(model.sh_rest[i * rest + c], c < 9 ? keep.degree_1 : keep.higher)});
    }
    return streams;
}

}  // namespace

std::vector<std::string> spz_losses(const SplatModel& model, const std::string& where) {
    std::vector<std::string> losses;
    if (const std::size_t count = count_outside(model.log_scale, kLeastLogScale - kHalfLogScale,
                                                kMostLogScale + kHalfLogScale);
        count > 0) {
        const auto [least, most] = std::ranges::minmax(model.log_scale);
        const double shrunk = std::min<double>(most, LOG_SCALE_LIMIT) - kMostLogScale;
        const double grown = kLeastLogScale - std::max<double>(least, -LOG_SCALE_LIMIT);
        losses.push_back(fmt::format(
            "{} scales outside {:.2g} to {:.3g} are cut to it, by up to {:.1f} times", count,
            std::exp(kLeastLogScale), std::exp(kMostLogScale), std::exp(std::max(shrunk, grown))));
    }
    if (const std::size_t count = count_outside(model.sh_dc, -kMostDc - kHalfDc, kMostDc + kHalfDc);
        count > 0)
        losses.push_back(fmt::format("{} colours outside {:.2f} to {:.2f} are cut to it", count,
                                     colour_of_dc(-kMostDc), colour_of_dc(kMostDc)));
    if (const std::size_t count = count_outside(model.sh_rest, kLeastHarmonic - kHalfHarmonic,
                                                kMostHarmonic + kHalfHarmonic);
        count > 0)
        losses.push_back(
            fmt::format("{} coefficients of harmonics outside {} to {:.2f} are cut to it", count,
                        kLeastHarmonic, kMostHarmonic));
    if (const int bits = choose_fractional_bits(model, where); bits < kUsualBits)
        losses.push_back(fmt::format(
            "positions reach {:g}: all are rounded to steps of {:g}; --crop leaves out what lies "
            "far off",
            largest_coordinate(model), std::ldexp(1.0, -bits)));
    return losses;
}

SpzSteps spz_steps(int precision) {
    DARB_CHECK(precision >= 0 && precision < kSpzPrecisions, "precision {}", precision);
    return {std::max(1, kCoarsestOfDegree1 >> precision),
            std::max(1, kCoarsestOfHigher >> precision)};
}

std::vector<std::byte> encode_spz(const SplatModel& scene, const std::string& where, int version,
                                  int precision) {
    check_splat_shapes(scene);
    if (version != 3 && version != 4)
        throw Error(where, fmt::format("SPZ version {} is not written", version), "Use 3 or 4.");
    SplatModel model = scene;
    transform_splats({1, kToRightUpBack, glm::dvec3(0.0)}, model);
    const int fractional_bits = choose_fractional_bits(model, where);
    const std::array<Stream, 6> streams = pack(model, fractional_bits, spz_steps(precision));
    const auto filled = std::ranges::count_if(streams, [](const Stream& s) { return !s.empty(); });
    Stream file;
    append(spz::kMagic, 4, file);
    append(static_cast<std::uint64_t>(version), 4, file);
    append(model.size(), 4, file);
    append(static_cast<std::uint64_t>(model.sh_degree), 1, file);
    append(static_cast<std::uint64_t>(fractional_bits), 1, file);
    append(model.antialias ? spz::kFlagAntialias : 0, 1, file);
    append(version == 4 ? static_cast<std::uint64_t>(filled) : 0, 1, file);
    if (version == 3) {
        for (const Stream& stream : streams) file.insert(file.end(), stream.begin(), stream.end());
        return gzip(file);
    }
    append(spz::kHeader, 4, file);  // where the table begins
    file.resize(spz::kHeader);
    Stream packed;
    for (const Stream& stream : streams) {
        if (stream.empty()) continue;
        const Stream frame = zstd(stream);
        append(frame.size(), 8, file);
        append(stream.size(), 8, file);
        packed.insert(packed.end(), frame.begin(), frame.end());
    }
    file.insert(file.end(), packed.begin(), packed.end());
    return file;
}

}  // namespace darb
