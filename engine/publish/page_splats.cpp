// SPDX-License-Identifier: MIT
#include "engine/publish/page_splats.h"

#include <zlib.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <functional>

#include "engine/core/error.h"
#include "engine/kernels/kernel_profile.h"
#include "engine/scene/edit_splats.h"
#include "engine/scene/quantise.h"
#include "engine/scene/sh_basis.h"

namespace darb {

namespace {

constexpr std::size_t kChunk = 256;  // splats, for chunk_order
constexpr double kMostInteger = 4294967294.0;
constexpr std::size_t kSample = 1 << 16;  // bytes used to decide whether differences are smaller

using Values = std::function<double(std::size_t)>;

std::size_t deflated_size(const std::vector<std::byte>& bytes) {
    std::vector<Bytef> out(compressBound(static_cast<uLong>(bytes.size())));
    auto size = static_cast<uLongf>(out.size());
    compress2(out.data(), &size, reinterpret_cast<const Bytef*>(bytes.data()),
              static_cast<uLong>(bytes.size()), 1);
    return size;
}

std::uint32_t zigzag(std::uint32_t difference) {
    return difference << 1 ^ (difference >> 31 ? 0xffffffffu : 0u);
}

std::vector<std::uint32_t> differences(const std::vector<std::uint32_t>& integers) {
    std::vector<std::uint32_t> result(integers);
    for (std::size_t i = 1; i < integers.size(); ++i)
        result[i] = zigzag(integers[i] - integers[i - 1]);
    return result;
}

int bytes_of(const std::vector<std::uint32_t>& integers) {
    std::uint32_t any = 0;
    for (const std::uint32_t v : integers) any |= v;
    return std::max(1, (static_cast<int>(std::bit_width(any)) + 7) / 8);
}

/// The planes of the integers, or of the sample in their middle.
std::vector<std::byte> planes_of(const std::vector<std::uint32_t>& integers, int bytes,
                                 std::size_t most) {
    const std::size_t count = std::min(integers.size(), most);
    const std::size_t first = (integers.size() - count) / 2;
    std::vector<std::byte> planes;
    planes.reserve(count * static_cast<std::size_t>(bytes));
    for (int b = 0; b < bytes; ++b)
        for (std::size_t i = first; i < first + count; ++i)
            planes.push_back(static_cast<std::byte>(integers[i] >> (8 * b) & 0xffu));
    return planes;
}

/// Bits of one number that the page's memory needs.
int bits_of(const PageColumn& column, const std::vector<std::uint32_t>& integers) {
    if (column.exact) return column.attribute == kShRest ? 16 : 32;
    std::uint32_t any = 1;
    for (const std::uint32_t v : integers) any |= v;
    return static_cast<int>(std::bit_width(any));
}

/// Columns fill words in their order, and none stands in two.
void place_in_words(PageSplats& packed) {
    int used = 32;  // bits of the last word
    for (PageColumn& column : packed.columns) {
        if (column.attribute == kPosition) {
            column.word = column.component;
            continue;
        }
        if (used + column.bits > 32) {
            ++packed.words;
            used = 0;
        }
        column.word = packed.words - 1;
        column.shift = used;
        used += column.bits;
    }
}

void add_integers(PageColumn column, const std::vector<std::uint32_t>& integers, PageSplats& to) {
    column.bits = bits_of(column, integers);
    column.bytes = column.exact ? 4 : bytes_of(integers);
    std::vector<std::byte> planes;
    if (!column.exact) {
        const std::vector<std::uint32_t> other = differences(integers);
        const int bytes = bytes_of(other);
        if (deflated_size(planes_of(other, bytes, kSample)) <
            deflated_size(planes_of(integers, column.bytes, kSample))) {
            column.difference = true;
            column.bytes = bytes;
            planes = planes_of(other, bytes, other.size());
        }
    }
    if (!column.difference) planes = planes_of(integers, column.bytes, integers.size());
    to.columns.push_back(column);
    to.planes.insert(to.planes.end(), planes.begin(), planes.end());
}

void add_rounded(int attribute, int component, double step, const Values& value, PageSplats& to) {
    double low = 1e300, high = -1e300;
    for (std::size_t i = 0; i < to.count; ++i) {
        low = std::min(low, value(i));
        high = std::max(high, value(i));
    }
    if (to.count == 0) low = high = 0;
    step = std::max(step, (high - low) / kMostInteger);
    low = std::floor(low / step) * step;  // so that 0 is on a step
    std::vector<std::uint32_t> integers(to.count);
    for (std::size_t i = 0; i < to.count; ++i)
        integers[i] =
            static_cast<std::uint32_t>(std::min(std::round((value(i) - low) / step), kMostInteger));
    add_integers({.attribute = attribute, .component = component, .low = low, .step = step},
                 integers, to);
}

/// The 10 % quantile of the splats' second largest standard deviations, world units.
double typical_size(const SplatModel& model) {
    std::vector<float> middle;
    for (std::size_t i = 0; i < model.size(); ++i) {
        const float* s = &model.log_scale[3 * i];
        middle.push_back(std::max(std::min(s[0], s[1]), std::min(std::max(s[0], s[1]), s[2])));
    }
    if (middle.empty()) return 1;
    const auto tenth = middle.begin() + static_cast<std::ptrdiff_t>(middle.size() / 10);
    std::ranges::nth_element(middle, tenth);
    return std::exp(static_cast<double>(drawn_log_scale(*tenth)));
}

void pack_rounded(const SplatModel& model, const PagePrecision& p, PageSplats& to) {
    const double position_step = std::max(p.position * typical_size(model), 1e-12);
    const std::array<double, kAttributeCount> steps = {
        position_step,       p.log_scale, p.rotation, p.opacity,
        p.colour / kShBand0, p.harmonics, p.shape};
    for (int a = 0; a < kAttributeCount; ++a) {
        const std::vector<float>& values = attribute_values(model, a);
        const std::size_t floats = model.floats(a);
        for (std::size_t k = 0; k < floats && a != kRotation && a != kOpacityLogit; ++k)
            add_rounded(
                a, static_cast<int>(k), steps[static_cast<std::size_t>(a)],
                [&](std::size_t i) {
                    const float v = values[i * floats + k];
                    return double(a == kLogScale ? drawn_log_scale(v) : v);
                },
                to);
    }
    add_rounded(
        kOpacityLogit, 0, p.opacity, [&](std::size_t i) { return sigmoid(model.opacity_logit[i]); },
        to);
    std::vector<SmallestThree> turns;
    for (std::size_t i = 0; i < to.count; ++i) {
        const float* q = &model.rotation[4 * i];
        turns.push_back(smallest_three({q[0], q[1], q[2], q[3]}));
    }
    for (int k = 0; k < 3; ++k)
        add_rounded(
            kRotation, k, p.rotation,
            [&](std::size_t i) { return turns[i].others[static_cast<std::size_t>(k)]; }, to);
    add_rounded(
        kRotation, 3, 1, [&](std::size_t i) { return double(turns[i].largest); }, to);
}

void pack_exact(const SplatModel& model, PageSplats& to) {
    for (int a = 0; a < kAttributeCount; ++a) {
        const std::vector<float>& values = attribute_values(model, a);
        const std::size_t floats = model.floats(a);
        for (std::size_t k = 0; k < floats; ++k) {
            std::vector<std::uint32_t> bits(to.count);
            for (std::size_t i = 0; i < to.count; ++i)
                bits[i] = std::bit_cast<std::uint32_t>(values[i * floats + k]);
            add_integers({.attribute = a, .component = static_cast<int>(k), .exact = true}, bits,
                         to);
        }
    }
}

std::vector<std::uint32_t> integers_at(const PageSplats& packed, const PageColumn& column,
                                       std::size_t at) {
    std::vector<std::uint32_t> integers(packed.count);
    for (int b = 0; b < column.bytes; ++b)
        for (std::size_t i = 0; i < packed.count; ++i, ++at)
            integers[i] |= std::to_integer<std::uint32_t>(packed.planes[at]) << (8 * b);
    if (column.difference)
        for (std::size_t i = 1; i < packed.count; ++i)
            integers[i] = integers[i - 1] + (integers[i] >> 1 ^ (0u - (integers[i] & 1u)));
    return integers;
}

float logit_of(double opacity) {
    return limit_infinite_logit(static_cast<float>(std::log(opacity) - std::log1p(-opacity)));
}

void join_rotations(SplatModel& model) {
    for (std::size_t i = 0; i < model.size(); ++i) {
        float* q = &model.rotation[4 * i];
        const std::array<double, 4> whole = whole_quaternion(
            {.largest = static_cast<std::size_t>(q[3]), .others = {q[0], q[1], q[2]}});
        std::ranges::transform(whole, q, [](double v) { return static_cast<float>(v); });
    }
}

}  // namespace

PagePrecision page_precision(int level, int kernel) {
    if (level >= kPageLevels) return {.exact = true};
    const double share = std::ldexp(1.0, -level);
    // Where w ends with a jump, pixels between the true outline and the rounded one are off by the
    // whole jump. With these steps, the inverse quadratic is as accurate at level 0 as other
    // kernels.
    const bool jumps = ends_with_a_jump(kernel);
    return {.position = share / 8,
            .log_scale = share / (jumps ? 200 : 20),
            .rotation = share / (jumps ? 500 : 100),
            .opacity = share / 255,
            .colour = share / 255,
            .harmonics = share / 64,
            .shape = share / 128};
}

PageSplats pack_page_splats(const SplatModel& model, const PagePrecision& precision) {
    SplatModel kept = model;
    drop_non_finite(kept);
    keep_splats(
        [&](std::size_t i) {
            return has_rotation(kept, i) && static_cast<float>(sigmoid(kept.opacity_logit[i])) >=
                                                ALPHA_CUTOFF_DEFAULT * 0.999;
        },
        kept);
    PageSplats packed;
    packed.count = kept.size();
    packed.sh_degree = kept.sh_degree;
    if (precision.exact)
        pack_exact(kept, packed);
    else
        pack_rounded(pick_splats(kept, chunk_order(kept, kChunk)), precision, packed);
    place_in_words(packed);
    return packed;
}

SplatModel unpack_page_splats(const PageSplats& packed, const SplatModel& like) {
    SplatModel model = pick_splats(like, {});
    model.sh_degree = packed.sh_degree;
    model.resize(packed.count);
    std::size_t at = 0;
    bool exact = false;
    for (const PageColumn& column : packed.columns) {
        const std::vector<std::uint32_t> integers = integers_at(packed, column, at);
        at += packed.count * static_cast<std::size_t>(column.bytes);
        std::vector<float>& values = attribute_values(model, column.attribute);
        const std::size_t floats = attribute_floats(column.attribute, packed.sh_degree);
        values.resize(floats * packed.count);  // an optional one is empty
        exact = column.exact;
        for (std::size_t i = 0; i < packed.count; ++i) {
            const double v = column.low + column.step * integers[i];
            float& value = values[i * floats + static_cast<std::size_t>(column.component)];
            if (column.exact)
                value = std::bit_cast<float>(integers[i]);
            else
                value = column.attribute == kOpacityLogit ? logit_of(v) : static_cast<float>(v);
        }
    }
    DARB_CHECK(at == packed.planes.size(), "{} of {} bytes", at, packed.planes.size());
    if (!exact) join_rotations(model);
    return model;
}

}  // namespace darb
