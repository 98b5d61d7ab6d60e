// SPDX-License-Identifier: MIT
// .ksplat, the format of the viewer GaussianSplats3D (github.com/mkkellogg/GaussianSplats3D): a
// header of 4,096 bytes, one of 1,024 bytes per section, then the sections: lengths of the buckets
// that are not full, the buckets' centres, the splats. Numbers are float32 at compression level 0
// and float16 at 1 and 2; harmonics take one byte each at 2; positions at 1 and 2 are 16 bits,
// relative to the bucket.
//   centre 3, standard deviation 3, rotation w x y z, r g b opacity 4 x uint8,
//   harmonics of degree 1, then 2: all red, then green, then blue
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>

#include "engine/core/error.h"
#include "engine/core/text.h"
#include "engine/scene/edit_splats.h"
#include "engine/scene/inflate.h"
#include "engine/scene/quantise.h"
#include "engine/scene/splat_format.h"

namespace darb {

namespace {

using KsplatBytes = std::span<const std::byte>;

constexpr std::size_t kHead = 4096, kSectionHead = 1024;  // bytes
constexpr std::uint64_t kMostSections = 1 << 16;
constexpr int kMostKsplatDegree = 2;

/// Bytes that a number of each kind takes, by compression level.
struct KsplatLevel {
    std::size_t centre, scale, rotation, harmonic;
};
constexpr KsplatLevel kLevels[] = {{4, 4, 4, 4}, {2, 2, 2, 2}, {2, 2, 2, 1}};

struct KsplatSection {
    std::uint64_t splats = 0, room = 0;  // splats stored, and splats that there is room for
    std::uint64_t bucket_size = 0, buckets = 0, full_buckets = 0, part_buckets = 0;
    std::uint64_t bucket_bytes = 0;  // bytes of a bucket's centre
    double step = 0;                 // step of a position, world units
    double range = 0;                // subtracted from its 16 bits
    int degree = 0;
    std::uint64_t begin = 0;  // offset of the section's data in the file

    std::size_t harmonics() const {
        return 3 * static_cast<std::size_t>((degree + 1) * (degree + 1) - 1);
    }
    std::uint64_t splat_bytes(const KsplatLevel& level) const {
        return 3 * level.centre + 3 * level.scale + 4 * level.rotation + 4 +
               harmonics() * level.harmonic;
    }
    std::uint64_t splats_begin() const { return begin + 4 * part_buckets + bucket_bytes * buckets; }
    std::uint64_t end(const KsplatLevel& level) const {
        return splats_begin() + splat_bytes(level) * room;
    }
};

struct KsplatFile {
    KsplatBytes bytes;
    std::string where;
    KsplatLevel level{};
    int number = 0;  // number of the compression level
    double least_harmonic = -1.5, most_harmonic = 1.5;
    std::vector<KsplatSection> sections;
    bool logarithms = false;  // the user says that scales are logarithms
    bool scales_below_0 = false;

    std::uint32_t word(std::size_t at) const { return load_le<std::uint32_t>(bytes, at); }
    std::uint16_t half(std::size_t at) const { return load_le<std::uint16_t>(bytes, at); }
    float number_at(std::size_t at, std::size_t size) const {
        return size == 4 ? load_le<float>(bytes, at) : half_to_float(half(at));
    }
};

KsplatSection read_section(const KsplatFile& file, std::size_t head, std::uint64_t begin) {
    KsplatSection section;
    section.splats = file.word(head);
    section.room = file.word(head + 4);
    section.bucket_size = file.word(head + 8);
    section.buckets = file.word(head + 12);
    const double block = load_le<float>(file.bytes, head + 16);
    section.bucket_bytes = file.half(head + 20);
    const std::uint32_t range = file.word(head + 24);
    section.range = range == 0 ? 32767 : range;
    section.step = block / 2 / section.range;
    section.full_buckets = file.word(head + 32);
    section.part_buckets = file.word(head + 36);
    section.degree = file.half(head + 40);
    section.begin = begin;
    return section;
}

/// The reason why these bytes are not .ksplat; nothing where they are.
std::optional<std::string> read_layout(KsplatFile& file) {
    if (file.bytes.size() < kHead)
        return fmt::format("holds {} bytes; the header has {}", file.bytes.size(), kHead);
    const auto major = static_cast<int>(file.bytes[0]), minor = static_cast<int>(file.bytes[1]);
    if (major != 0 || minor < 1)
        return fmt::format("is .ksplat version {}.{}; 0.1 is known", major, minor);
    file.number = file.half(20);
    if (file.number > 2)
        return fmt::format("has compression level {}; 0 to 2 are known", file.number);
    file.level = kLevels[file.number];
    if (const float least = load_le<float>(file.bytes, 36); least != 0) file.least_harmonic = least;
    if (const float most = load_le<float>(file.bytes, 40); most != 0) file.most_harmonic = most;
    const std::uint64_t sections = file.word(4);
    std::uint64_t at = kHead + kSectionHead * sections, splats = 0;
    if (sections > kMostSections || at > file.bytes.size())
        return fmt::format("declares {} sections, but holds {} bytes", sections, file.bytes.size());
    for (std::uint64_t i = 0; i < sections; ++i) {
        const KsplatSection section = read_section(file, kHead + kSectionHead * i, at);
        if (section.degree > kMostKsplatDegree)
            return fmt::format("section {}: SH degree {}; 0 to 2 are known", i, section.degree);
        if (section.splats > section.room)
            return fmt::format("section {}: {} splats in room for {}", i, section.splats,
                               section.room);
        at = section.end(file.level);
        if (at > file.bytes.size())
            return fmt::format("section {} ends at byte {} of {}", i, at, file.bytes.size());
        if (file.number > 0 && section.bucket_bytes < 12)
            return fmt::format("section {}: buckets of {} bytes", i, section.bucket_bytes);
        splats += section.splats;
        file.sections.push_back(section);
    }
    if (splats != file.word(16))
        return fmt::format("declares {} splats, and its sections hold {}", file.word(16), splats);
    return std::nullopt;
}

/// The bucket of each splat of a section, in order: the full buckets, then those whose lengths are
/// listed.
std::vector<std::uint32_t> buckets_of(const KsplatFile& file, const KsplatSection& section) {
    std::vector<std::uint32_t> bucket(section.splats);
    const auto full = std::min(section.splats, section.full_buckets * section.bucket_size);
    for (std::uint64_t i = 0; i < full; ++i)
        bucket[i] = static_cast<std::uint32_t>(i / section.bucket_size);
    std::uint64_t at = full;
    for (std::uint64_t part = 0; part < section.part_buckets && at < section.splats; ++part) {
        const std::uint64_t length = file.word(section.begin + 4 * part);
        for (std::uint64_t i = 0; i < length && at < section.splats; ++i)
            bucket[at++] = static_cast<std::uint32_t>(section.full_buckets + part);
    }
    if (at < section.splats || (section.splats > 0 && bucket.back() >= section.buckets))
        throw Error(file.where, "a splat is in no bucket", kCopyAgain);
    return bucket;
}

float harmonic_at(const KsplatFile& file, std::size_t at) {
    if (file.level.harmonic != 1) return file.number_at(at, file.level.harmonic);
    const double unit = std::to_integer<int>(file.bytes[at]) / 255.0;
    return static_cast<float>(file.least_harmonic +
                              unit * (file.most_harmonic - file.least_harmonic));
}

/// Converts harmonics stored band by band and channel by channel to coefficient-major, rgb
/// innermost.
void read_harmonics_at(const KsplatFile& file, std::size_t at, int degree, float* to) {
    for (int l = 1; l <= degree; ++l) {
        const int before = l * l - 1, of_band = 2 * l + 1;
        for (int channel = 0; channel < 3; ++channel)
            for (int c = 0; c < of_band; ++c, at += file.level.harmonic)
                to[3 * (before + c) + channel] = harmonic_at(file, at);
    }
}

void read_splat(KsplatFile& file, const KsplatSection& section, std::size_t at,
                const std::array<float, 3>& centre, std::size_t i, SplatModel& model) {
    const KsplatLevel& level = file.level;
    for (std::size_t k = 0; k < 3; ++k) {
        model.position[3 * i + k] =
            level.centre == 4
                ? load_le<float>(file.bytes, at + 4 * k)
                : static_cast<float>((file.half(at + 2 * k) - section.range) * section.step +
                                     double{centre[k]});
        const float scale = file.number_at(at + 3 * level.centre + k * level.scale, level.scale);
        model.log_scale[3 * i + k] =
            file.logarithms ? scale : limit_infinite_log_scale(std::log(scale));
        file.scales_below_0 |= scale < 0;
    }
    at += 3 * level.centre + 3 * level.scale;
    for (std::size_t k = 0; k < 4; ++k, at += level.rotation)
        model.rotation[4 * i + k] = file.number_at(at, level.rotation);
    for (std::size_t k = 0; k < 3; ++k)
        model.sh_dc[3 * i + k] =
            static_cast<float>(dc_of_colour(std::to_integer<int>(file.bytes[at + k]) / 255.0));
    model.opacity_logit[i] = logit_of_byte(std::to_integer<std::uint8_t>(file.bytes[at + 3]));
    if (section.degree > 0)
        read_harmonics_at(file, at + 4, section.degree,
                          &model.sh_rest[i * static_cast<std::size_t>(model.rest_count())]);
}

SplatModel load_ksplat(const SplatSource& source, SplatFile& facts) {
    KsplatFile file{source.bytes, source.where, {}, 0, -1.5, 1.5, {}};
    if (const std::optional<std::string> reason = read_layout(file))
        throw Error(source.where, *reason, kCopyAgain);
    file.logarithms = source.units.scales == StoredScales::logarithms;
    facts.details = fmt::format("compression level {}", file.number);
    SplatModel model;
    for (const KsplatSection& section : file.sections)
        model.sh_degree = std::max(model.sh_degree, section.degree);
    model.resize(file.word(16));
    std::size_t i = 0;
    for (const KsplatSection& section : file.sections) {
        const std::vector<std::uint32_t> bucket =
            file.number == 0 ? std::vector<std::uint32_t>{} : buckets_of(file, section);
        for (std::uint64_t s = 0; s < section.splats; ++s, ++i) {
            std::array<float, 3> centre{};
            if (file.number > 0)
                for (std::size_t k = 0; k < 3; ++k)
                    centre[k] =
                        load_le<float>(source.bytes, section.begin + 4 * section.part_buckets +
                                                         section.bucket_bytes * bucket[s] + 4 * k);
            read_splat(file, section, section.splats_begin() + section.splat_bytes(file.level) * s,
                       centre, i, model);
        }
    }
    facts.dropped = drop_non_finite(model);
    if (file.scales_below_0 && !file.logarithms) facts.notes.emplace_back(kScalesBelow0);
    return model;
}

// The format has no signature; it is recognised by sections that fit the file to the byte.
bool is_ksplat(const SplatSource& source) {
    if (lower(source.where).ends_with(".ksplat")) return true;
    KsplatFile file{source.bytes, source.where, {}, 0, -1.5, 1.5, {}};
    return !read_layout(file) && !file.sections.empty() &&
           file.sections.back().end(file.level) == source.bytes.size();
}

}  // namespace

const SplatFormatRow& ksplat_format() {
    static const SplatFormatRow row{
        .name = ".ksplat", .endings = {".ksplat"}, .recognise = is_ksplat, .parse = load_ksplat};
    return row;
}

}  // namespace darb
