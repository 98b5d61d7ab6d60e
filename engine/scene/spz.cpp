// SPDX-License-Identifier: MIT
#include "engine/scene/spz.h"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <numbers>

#include "engine/core/error.h"
#include "engine/scene/edit_splats.h"
#include "engine/scene/inflate.h"
#include "engine/scene/quantise.h"
#include "engine/scene/splat_format.h"
#include "engine/scene/splat_model.h"
#include "shaders/shared/limits.h"

namespace darb {

namespace {

using Bytes = std::span<const std::byte>;

constexpr int kMostFractionalBits = 24;
constexpr std::size_t kMostExtensionBytes = std::size_t{1} << 20;

struct Header {
    std::uint32_t version = 0, count = 0;
    int degree = 0, fractional_bits = 0;
    std::uint8_t flags = 0, streams = 0;
};

Header read_header(Bytes bytes, const std::string& where) {
    if (bytes.size() < spz::kOldHeader)
        throw Error(
            where,
            fmt::format("holds {} bytes; the SPZ header has {}", bytes.size(), spz::kOldHeader),
            kCopyAgain);
    if (load_le<std::uint32_t>(bytes, 0) != spz::kMagic)
        throw Error(where, "the content is not SPZ: it does not begin with NGSP",
                    "Unpack a gzip file of another kind first.");
    Header header;
    header.version = load_le<std::uint32_t>(bytes, 4);
    header.count = load_le<std::uint32_t>(bytes, 8);
    header.degree = static_cast<int>(bytes[12]);
    header.fractional_bits = static_cast<int>(bytes[13]);
    header.flags = static_cast<std::uint8_t>(bytes[14]);
    header.streams = static_cast<std::uint8_t>(bytes[15]);
    if (header.version < 1 || header.version > 4)
        throw Error(where, fmt::format("is SPZ version {}; 1 to 4 are known", header.version),
                    "Export it in one of these versions.");
    if (header.degree > 4)
        throw Error(where, fmt::format("header: SH degree {}; 0 to 4 are known", header.degree),
                    kCopyAgain);
    if (header.fractional_bits > kMostFractionalBits)
        throw Error(where, fmt::format("header: {} fractional bits of 24", header.fractional_bits),
                    kCopyAgain);
    return header;
}

/// The uncompressed attributes in file order; in versions 1 to 3 with extensions, also what follows
/// them.
struct Content {
    Header header;
    std::vector<std::byte> whole;  // versions 1 to 3
    std::array<std::vector<std::byte>, 6> parts;
    std::array<Bytes, 6> attributes;
    Bytes extensions;
};

void split_old(Content& content, const std::string& where) {
    const spz::Strides strides =
        spz::strides(static_cast<int>(content.header.version), content.header.degree);
    const std::uint64_t size = std::uint64_t{content.header.count} * strides.total();
    const Bytes all = content.whole;
    if (all.size() - spz::kOldHeader < size)
        throw Error(
            where,
            fmt::format("declares {} splats of {} bytes, but holds {} bytes for them",
                        content.header.count, strides.total(), all.size() - spz::kOldHeader),
            kCopyAgain);
    std::size_t at = spz::kOldHeader;
    for (std::size_t i = 0; i < 6; ++i) {
        const std::size_t bytes = strides.bytes[i] * content.header.count;
        content.attributes[i] = all.subspan(at, bytes);
        at += bytes;
    }
    content.extensions = all.subspan(at);
}

void read_old(Bytes file, bool is_gzip, Content& content, const std::string& where) {
    if (is_gzip) {
        content.header = read_header(gunzip(file, spz::kOldHeader, where), where);
        const std::uint64_t size =
            spz::strides(static_cast<int>(content.header.version), content.header.degree).total() *
            std::uint64_t{content.header.count};
        check_expansion(file.size(), size, where);
        // One byte more than needed makes zlib reach the end of the stream and verify its checksum.
        const bool extended = content.header.flags & spz::kFlagExtensions;
        const std::size_t most = spz::kOldHeader + size + (extended ? kMostExtensionBytes : 1);
        content.whole = gunzip(file, most, where);
        if (content.whole.size() == most)
            throw Error(where,
                        fmt::format("holds more than the {} splats that its header declares",
                                    content.header.count),
                        kCopyAgain);
    } else {
        content.whole.assign(file.begin(), file.end());
    }
    split_old(content, where);
}

constexpr std::array<const char*, 6> kNames = {"positions", "opacities", "colours",
                                               "scales",    "rotations", "harmonics"};

void read_streams(Bytes file, Content& content, const std::string& where) {
    if (file.size() < spz::kHeader)
        throw Error(where,
                    fmt::format("holds {} bytes; the SPZ header has {}", file.size(), spz::kHeader),
                    kCopyAgain);
    const std::size_t toc = load_le<std::uint32_t>(file, 16);
    const std::size_t begin = toc + content.header.streams * spz::kTocEntry;
    if (toc < spz::kHeader || begin > file.size())
        throw Error(where,
                    fmt::format("header: a table of {} streams at byte {} of a file of {}",
                                content.header.streams, toc, file.size()),
                    kCopyAgain);
    content.extensions = file.subspan(spz::kHeader, toc - spz::kHeader);
    const spz::Strides strides = spz::strides(4, content.header.degree);
    check_expansion(file.size(), std::uint64_t{content.header.count} * strides.total(), where);
    std::size_t at = begin, stream = 0;
    for (std::size_t i = 0; i < 6; ++i) {
        const std::size_t size = strides.bytes[i] * content.header.count;
        if (size == 0) continue;  // attributes without bytes have no stream
        if (stream == content.header.streams)
            throw Error(where, fmt::format("has no stream of {}", kNames[i]), kCopyAgain);
        const auto packed = load_le<std::uint64_t>(file, toc + stream * spz::kTocEntry);
        const auto declared = load_le<std::uint64_t>(file, toc + stream * spz::kTocEntry + 8);
        if (declared != size || packed > file.size() - at)
            throw Error(
                where,
                fmt::format("the stream of {} declares {} bytes, packed to {}; {} bytes are "
                            "needed and {} are left in the file",
                            kNames[i], declared, packed, size, file.size() - at),
                kCopyAgain);
        content.parts[i] = unzstd(file.subspan(at, packed), size, where);
        content.attributes[i] = content.parts[i];
        at += packed;
        ++stream;
    }
    if (stream != content.header.streams)
        throw Error(where,
                    fmt::format("has {} streams; {} are known", content.header.streams, stream),
                    kCopyAgain);
}

/// Columns: the axes of the file in the model's frame (x right, y down, z forward). Numbers 1 to 16
/// are those of the reference library, with n - 1 in bits: bit 0 is right or left; the second axis
/// is down or up (bit 1) and the third back or front (bit 2), or, with bit 3, the second is front
/// or back (bit 2) and the third down or up (bit 1).
glm::dmat3 frame_of(std::uint32_t system) {
    const std::uint32_t bits = system - 1;
    const bool rotated = bits & 8;
    const glm::dvec3 x(bits & 1 ? 1 : -1, 0, 0);
    const glm::dvec3 vertical(0, bits & 2 ? -1 : 1, 0);
    const glm::dvec3 depth(0, 0, bool(bits & 4) != rotated ? 1 : -1);
    return rotated ? glm::dmat3(x, depth, vertical) : glm::dmat3(x, vertical, depth);
}

constexpr std::uint32_t kRightUpBack = 4;

/// In versions 1 to 3, the records are whatever follows the attributes, and end where one does not
/// fit (facts.extensions_cut). In version 4 their length is declared, and one that does not fit is
/// an Error.
std::uint32_t read_extensions(Bytes records, int version, const std::string& where,
                              SpzFacts& facts) {
    std::uint32_t system = kRightUpBack;
    int& count = facts.extensions;
    for (count = 0; records.size() >= 8; ++count) {
        const auto type = load_le<std::uint32_t>(records, 0);
        const auto size = load_le<std::uint32_t>(records, 4);
        records = records.subspan(8);
        if (size > records.size() && version < 4) {
            facts.extensions_cut = true;
            break;
        }
        if (size > records.size())
            throw Error(where,
                        fmt::format("extension record {} declares {} bytes, {} are left", count,
                                    size, records.size()),
                        kCopyAgain);
        if (type == spz::kCoordinateSystem && size >= 4) {
            system = load_le<std::uint32_t>(records, 0);
            if (system > 16)
                throw Error(where, fmt::format("names the unknown coordinate system {}", system),
                            "Export it with the axes right, up, back.");
            if (system == 0) system = kRightUpBack;  // unspecified
        }
        records = records.subspan(size);
    }
    return system;
}

void read_positions(const Content& content, SplatModel& model) {
    const Bytes bytes = content.attributes[0];
    for (std::size_t i = 0; i < model.position.size(); ++i) {
        if (content.header.version == 1) {
            model.position[i] = half_to_float(load_le<std::uint16_t>(bytes, 2 * i));
            continue;
        }
        std::uint32_t value = 0;
        for (std::size_t k = 0; k < 3; ++k)
            value |= static_cast<std::uint32_t>(bytes[3 * i + k]) << (8 * k + 8);
        const int fixed = static_cast<std::int32_t>(value) >> 8;  // including the sign
        model.position[i] = static_cast<float>(std::ldexp(fixed, -content.header.fractional_bits));
    }
}

/// x y z w
std::array<double, 4> rotation_of(const Content& content, std::size_t i) {
    const Bytes bytes = content.attributes[4];
    if (content.header.version >= 3) {
        const auto packed = load_le<std::uint32_t>(bytes, 4 * i);
        SmallestThree three{packed >> 30, {}};
        for (std::size_t k = 0; k < 3; ++k) {
            const std::uint32_t part = packed >> (20 - 10 * k);
            const double size = (part & 511) / 511.0 * (1 / std::numbers::sqrt2);
            three.others[k] = part & 512 ? -size : size;
        }
        return whole_quaternion(three);
    }
    SmallestThree xyz{3, {}};  // w is left out, whether or not it is the largest
    for (std::size_t k = 0; k < 3; ++k)
        xyz.others[k] = static_cast<double>(bytes[3 * i + k]) / 127.5 - 1;
    return whole_quaternion(xyz);
}

SplatModel decode(const Content& content) {
    SplatModel model;
    model.sh_degree = std::min(content.header.degree, kMaxShDegree);
    model.antialias = content.header.flags & spz::kFlagAntialias;
    model.resize(content.header.count);
    read_positions(content, model);
    const auto& at = content.attributes;
    for (std::size_t i = 0; i < model.size(); ++i) {
        model.opacity_logit[i] = logit_of_byte(static_cast<std::uint8_t>(at[1][i]));
        const std::array<double, 4> q = rotation_of(content, i);
        for (std::size_t k = 0; k < 4; ++k)
            model.rotation[4 * i + k] = static_cast<float>(q[(k + 3) % 4]);
    }
    for (std::size_t i = 0; i < 3 * model.size(); ++i) {
        model.sh_dc[i] =
            static_cast<float>((static_cast<double>(at[2][i]) / 255 - 0.5) / spz::kColourScale);
        model.log_scale[i] = static_cast<float>(at[3][i]) / 16 - 10;
    }
    const std::size_t stored = spz::strides(4, content.header.degree).bytes[5];
    const auto rest = static_cast<std::size_t>(model.rest_count());
    for (std::size_t i = 0; i < model.size(); ++i)
        for (std::size_t c = 0; c < rest; ++c)
            model.sh_rest[i * rest + c] = (static_cast<float>(at[5][i * stored + c]) - 128) / 128;
    return model;
}

/// RFC 1952: the magic number, deflate as the method, and no reserved flag; a .splat might begin
/// with the first two bytes.
bool is_gzip(Bytes file) {
    return file.size() >= 4 && file[0] == std::byte{0x1f} && file[1] == std::byte{0x8b} &&
           file[2] == std::byte{8} && (file[3] & std::byte{0xe0}) == std::byte{0};
}

SplatModel load_spz(const SplatSource& source, SplatFile& file) {
    SpzFacts facts;
    SplatModel model = parse_spz(source.bytes, source.where, &facts);
    file.version = facts.version;
    file.position_step = facts.position_step;
    if (facts.sh_degree > model.sh_degree)
        file.notes.push_back(fmt::format("harmonics of degree {} were left out", facts.sh_degree));
    if (facts.extensions_cut)
        file.notes.push_back("what follows the splats is no whole extension record: left out");
    if (facts.extensions > 0) file.details = fmt::format("{} extensions", facts.extensions);
    file.dropped = drop_non_finite(model);  // version 1 stores float16
    return model;
}

}  // namespace

bool looks_like_spz(Bytes file) {
    return is_gzip(file) || (file.size() >= 4 && load_le<std::uint32_t>(file, 0) == spz::kMagic);
}

SplatModel parse_spz(Bytes file, const std::string& where, SpzFacts* facts) {
    Content content;
    if (!is_gzip(file)) content.header = read_header(file, where);
    if (content.header.version == 4)
        read_streams(file, content, where);
    else
        read_old(file, is_gzip(file), content, where);
    SpzFacts found;
    found.version = static_cast<int>(content.header.version);
    found.sh_degree = content.header.degree;
    if (content.header.version > 1)
        found.position_step = std::ldexp(1.0, -content.header.fractional_bits);
    std::uint32_t system = kRightUpBack;
    if (content.header.flags & spz::kFlagExtensions)
        system = read_extensions(content.extensions, found.version, where, found);
    SplatModel model = decode(content);
    transform_splats({1, frame_of(system), glm::dvec3(0.0)}, model);
    if (facts) *facts = found;
    return model;
}

const SplatFormatRow& spz_format() {
    static const SplatFormatRow row{
        .name = "SPZ",
        .endings = {".spz"},
        .recognise = [](const SplatSource& source) { return looks_like_spz(source.bytes); },
        .parse = load_spz,
        .encode =
            [](const SplatModel& model, const std::string& where, const EncodeOptions& options) {
                return EncodedSplats{
                    encode_spz(model, where, options.spz_version,
                               options.precision < 0 ? kSpzPrecisions - 1 : options.precision)};
            },
        // Positions have steps of their own, whose size spz_losses reports.
        .keeps = kKeepsRenderMode | kKeepsHarmonics | kKeepsDoublePositions,
        .cuts = spz_losses,
        .precisions =
            [](const SplatModel& model) { return model.sh_degree > 0 ? kSpzPrecisions : 1; }};
    return row;
}

namespace {

using Stream = std::vector<std::byte>;

constexpr int kUsualBits = 12;   // fractional; 0.24 mm where the unit is a metre
constexpr int kLeastSteps = 17;  // the largest coordinate has 2^17 steps, where they fit
constexpr int kSteps = 23;       // 24 bits with sign
constexpr int kCoarsestOfDegree1 = 8, kCoarsestOfHigher = 16;  // as in the reference writer

// The ranges of bytes, and half a step of each, which is rounding.
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
        throw Error(where, fmt::format("SPZ version {} cannot be written", version), "Use 3 or 4.");
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
    append(spz::kHeader, 4, file);  // offset of the table
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
