// SPDX-License-Identifier: MIT
#include "engine/scene/compressed_ply.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <functional>
#include <numbers>

#include "engine/core/error.h"
#include "engine/core/quantile.h"
#include "engine/scene/edit_splats.h"
#include "engine/scene/ply.h"
#include "engine/scene/quantise.h"
#include "engine/scene/splat_format.h"
#include "engine/scene/splat_model.h"
#include "shaders/shared/limits.h"

namespace darb {

namespace {

constexpr std::size_t kChunk = 256;  // splats
constexpr std::array<const char*, 9> kBounds = {"x",       "y", "z", "scale_x", "scale_y",
                                                "scale_z", "r", "g", "b"};
constexpr std::array<const char*, 4> kPacked = {"packed_position", "packed_rotation",
                                                "packed_scale", "packed_color"};

/// Bounds of one chunk, in the order of kBounds.
struct Chunk {
    std::array<float, 9> low{0, 0, 0, 0, 0, 0, 0, 0, 0};
    std::array<float, 9> high{0, 0, 0, 0, 0, 0, 1, 1, 1};
};

std::size_t column_of(const PlyElement& element, const std::string& name, PlyType type,
                      const char* type_name, const std::string& where) {
    const int column = element.find(name);
    if (column < 0)
        throw Error(where, fmt::format("element {} lacks {}", element.name, name),
                    "The compressed PLY is damaged: export it again.");
    const PlyProperty& property = element.properties[static_cast<std::size_t>(column)];
    if (property.is_list || property.type != type)
        throw Error(where, fmt::format("{} of element {} is no {}", name, element.name, type_name),
                    "The compressed PLY is damaged: export it again.");
    return static_cast<std::size_t>(column);
}

std::vector<Chunk> read_chunks(std::span<const std::byte> file, const PlyHeader& header,
                               const std::string& where) {
    const PlyElement& element = *header.find("chunk");
    const std::size_t count = element.find("min_r") < 0 ? 6 : 9;  // older files: no colours
    std::array<std::size_t, 9> low{}, high{};
    for (std::size_t i = 0; i < count; ++i) {
        const auto column = [&](const char* end) {
            return column_of(element, fmt::format("{}_{}", end, kBounds[i]), PlyType::float32,
                             "float", where);
        };
        low[i] = column("min");
        high[i] = column("max");
    }
    std::vector<Chunk> chunks(element.count);
    read_ply_rows(file, header, element, where, [&](std::size_t row, const double* values) {
        for (std::size_t i = 0; i < count; ++i) {
            chunks[row].low[i] = static_cast<float>(values[low[i]]);
            chunks[row].high[i] = static_cast<float>(values[high[i]]);
        }
    });
    return chunks;
}

double unit_of(std::uint32_t bits, int shift, int width) {
    const std::uint32_t mask = (1u << width) - 1;
    return static_cast<double>((bits >> shift) & mask) / mask;
}

std::array<double, 3> unpack_11_10_11(std::uint32_t bits) {
    return {unit_of(bits, 21, 11), unit_of(bits, 11, 10), unit_of(bits, 0, 11)};
}

/// The step between positions in a chunk, as the median over the chunks.
double usual_step(const std::vector<Chunk>& chunks) {
    constexpr std::array<double, 3> kSteps{2047, 1023, 2047};
    std::vector<double> steps;
    for (const Chunk& chunk : chunks) {
        double step = 0;
        for (std::size_t i = 0; i < 3; ++i)
            step = std::max(step, (double{chunk.high[i]} - double{chunk.low[i]}) / kSteps[i]);
        if (std::isfinite(step)) steps.push_back(step);
    }
    return steps.empty() ? 0 : nearest_rank(steps, 0.5);
}

void unpack_splat(const std::array<std::uint32_t, 4>& packed, const Chunk& chunk, std::size_t at,
                  SplatModel& model) {
    const auto place = [&](std::size_t bound, double unit) {
        return chunk.low[bound] * (1 - unit) + chunk.high[bound] * unit;
    };
    const auto position = unpack_11_10_11(packed[0]), scale = unpack_11_10_11(packed[2]);
    for (std::size_t i = 0; i < 3; ++i) {
        model.position[3 * at + i] = static_cast<float>(place(i, position[i]));
        model.log_scale[3 * at + i] = static_cast<float>(place(3 + i, scale[i]));
        const double colour = place(6 + i, unit_of(packed[3], 24 - 8 * static_cast<int>(i), 8));
        model.sh_dc[3 * at + i] = static_cast<float>(dc_of_colour(colour));
    }
    model.opacity_logit[at] = logit_of_byte(static_cast<std::uint8_t>(packed[3] & 255));
    SmallestThree three{packed[1] >> 30, {}};
    for (std::size_t i = 0; i < 3; ++i)
        three.others[i] =
            (unit_of(packed[1], 20 - 10 * static_cast<int>(i), 10) - 0.5) * std::numbers::sqrt2;
    const std::array<double, 4> q = whole_quaternion(three);
    for (std::size_t i = 0; i < 4; ++i) model.rotation[4 * at + i] = static_cast<float>(q[i]);
}

/// The middle of the byte's step; 0 and 255 mean the ends -4 and 4.
float sh_of_byte(double byte) {
    const double unit = byte == 0 ? 0 : byte == 255 ? 1 : (byte + 0.5) / 256;
    return static_cast<float>((unit - 0.5) * 8);
}

/// Returns a sentence on bytes after the rows, as ply_bytes_behind does.
std::string read_sh(std::span<const std::byte> file, const PlyHeader& header, const PlyElement& sh,
                    const std::string& where, SplatModel& model) {
    const std::size_t rest = sh.properties.size(), per_channel = rest / 3;
    if (rest == 0) return {};  // gsplat writes this for degree 0
    if (rest != 9 && rest != 24 && rest != 45)
        throw Error(where,
                    fmt::format("element sh has {} properties; degree 1, 2, 3 has 9, 24, 45", rest),
                    "The compressed PLY is damaged: export it again.");
    if (sh.count != model.size())
        throw Error(where,
                    fmt::format("has {} splats and {} rows of harmonics", model.size(), sh.count),
                    "The compressed PLY is damaged: export it again.");
    std::vector<std::size_t> columns;
    for (std::size_t i = 0; i < rest; ++i)
        columns.push_back(
            column_of(sh, fmt::format("f_rest_{}", i), PlyType::uint8, "uchar", where));
    check_ply_size(file, header, sh, where);
    model.sh_degree = rest == 9 ? 1 : rest == 24 ? 2 : 3;
    model.resize(model.size());
    const PlyRow store = [&](std::size_t row, const double* values) {
        for (std::size_t i = 0; i < rest; ++i)
            model.sh_rest[row * rest + (i % per_channel) * 3 + i / per_channel] =
                sh_of_byte(values[columns[i]]);
    };
    return ply_bytes_behind(file, header, sh, read_ply_rows(file, header, sh, where, store));
}

std::uint32_t to_unit(double value, double low, double high, int width) {
    const double most = (1u << width) - 1;
    const double unit = high > low ? (value - low) / (high - low) : 0;
    return static_cast<std::uint32_t>(std::clamp(std::round(unit * most), 0.0, most));
}

/// The nine numbers that a chunk bounds: position, log scale, colour.
std::array<float, 9> bounded_numbers(const SplatModel& model, std::size_t i) {
    const glm::dvec3 p = position_of(model, i);
    std::array<float, 9> values{};
    for (std::size_t a = 0; a < 3; ++a) {
        values[a] = static_cast<float>(p[static_cast<int>(a)]);
        values[3 + a] = drawn_log_scale(model.log_scale[3 * i + a]);
        values[6 + a] = static_cast<float>(colour_of_dc(model.sh_dc[3 * i + a]));
    }
    return values;
}

std::array<std::uint32_t, 4> pack_splat(const SplatModel& model, std::size_t i,
                                        const Chunk& chunk) {
    const std::array<float, 9> values = bounded_numbers(model, i);
    const auto part = [&](std::size_t bound, int width) {
        return to_unit(values[bound], chunk.low[bound], chunk.high[bound], width);
    };
    const auto pack_11_10_11 = [&](std::size_t first) {
        return part(first, 11) << 21 | part(first + 1, 10) << 11 | part(first + 2, 11);
    };
    const SmallestThree three =
        smallest_three({model.rotation[4 * i], model.rotation[4 * i + 1], model.rotation[4 * i + 2],
                        model.rotation[4 * i + 3]});
    auto rotation = static_cast<std::uint32_t>(three.largest);
    for (const double other : three.others)
        rotation = rotation << 10 | to_unit(other / std::numbers::sqrt2, -0.5, 0.5, 10);
    return {pack_11_10_11(0), rotation, pack_11_10_11(3),
            part(6, 8) << 24 | part(7, 8) << 16 | part(8, 8) << 8 |
                byte_of_logit(model.opacity_logit[i])};
}

Chunk bounds_of(const SplatModel& model, std::span<const std::uint32_t> splats) {
    Chunk chunk;
    chunk.low = chunk.high = bounded_numbers(model, splats[0]);
    for (const std::uint32_t i : splats) {
        const std::array<float, 9> values = bounded_numbers(model, i);
        for (std::size_t b = 0; b < 9; ++b) {
            chunk.low[b] = std::min(chunk.low[b], values[b]);
            chunk.high[b] = std::max(chunk.high[b], values[b]);
        }
    }
    return chunk;
}

using UseChunk = std::function<void(std::span<const std::uint32_t> splats, const Chunk& chunk)>;

void for_each_chunk(const SplatModel& model, std::span<const std::uint32_t> order,
                    const UseChunk& use) {
    for (std::size_t begin = 0; begin < order.size(); begin += kChunk) {
        const auto splats = order.subspan(begin, std::min(kChunk, order.size() - begin));
        use(splats, bounds_of(model, splats));
    }
}

/// How far rounding within its chunk moves a splat, world units.
double shift_of(const SplatModel& model, std::size_t i, const Chunk& chunk) {
    const std::array<float, 9> values = bounded_numbers(model, i);
    const auto unit = unpack_11_10_11(pack_splat(model, i, chunk)[0]);
    double square = 0;
    for (std::size_t a = 0; a < 3; ++a) {
        const double off = chunk.low[a] * (1 - unit[a]) + chunk.high[a] * unit[a] - values[a];
        square += off * off;
    }
    return std::sqrt(square);
}

std::string make_header(const SplatModel& model) {
    std::string text = fmt::format("ply\nformat binary_little_endian 1.0\n{}element chunk {}\n",
                                   ply_comments(model), (model.size() + kChunk - 1) / kChunk);
    // Low and high of positions, then of scales, then of colours.
    for (std::size_t first = 0; first < 9; first += 3)
        for (const char* end : {"min", "max"})
            for (std::size_t i = first; i < first + 3; ++i)
                text += fmt::format("property float {}_{}\n", end, kBounds[i]);
    text += fmt::format("element vertex {}\n", model.size());
    for (const char* name : kPacked) text += fmt::format("property uint {}\n", name);
    if (model.sh_degree > 0) text += fmt::format("element sh {}\n", model.size());
    for (int i = 0; i < model.rest_count(); ++i)
        text += fmt::format("property uchar f_rest_{}\n", i);
    return text + "end_header\n";
}

template <class T>
void append(const T& value, std::vector<std::byte>& to) {
    const auto bytes = std::as_bytes(std::span(&value, 1));
    to.insert(to.end(), bytes.begin(), bytes.end());
}

}  // namespace

bool is_compressed_ply(const PlyHeader& header) {
    const PlyElement* vertex = header.find("vertex");
    return vertex && header.find("chunk") && vertex->find(kPacked[0]) >= 0;
}

SplatModel parse_compressed_ply(std::span<const std::byte> file, const PlyHeader& header,
                                const std::string& where, PlyFacts* facts,
                                const ReadProgress& progress) {
    const PlyElement& vertex = *header.find("vertex");
    const PlyElement& chunk = *header.find("chunk");
    check_ply_size(file, header, vertex, where);
    check_ply_size(file, header, chunk, where);
    if (chunk.count != vertex.count / kChunk + (vertex.count % kChunk != 0))
        throw Error(where,
                    fmt::format("has {} chunks for {} splats; one is for {}", chunk.count,
                                vertex.count, kChunk),
                    "The compressed PLY is damaged: export it again.");
    std::array<std::size_t, 4> columns{};
    for (std::size_t i = 0; i < 4; ++i)
        columns[i] = column_of(vertex, kPacked[i], PlyType::uint32, "uint", where);
    const std::vector<Chunk> chunks = read_chunks(file, header, where);
    SplatModel model;
    PlyFacts said;
    read_ply_comments(header, where, model, said.notes);
    said.up = stated_up(header);
    model.resize(vertex.count);
    const PlyRow row = [&](std::size_t i, const double* values) {
        std::array<std::uint32_t, 4> packed{};
        for (std::size_t word = 0; word < 4; ++word)
            packed[word] = static_cast<std::uint32_t>(values[columns[word]]);
        unpack_splat(packed, chunks[i / kChunk], i, model);
    };
    const std::size_t end = read_ply_rows(file, header, vertex, where, row, progress);
    std::string behind = ply_bytes_behind(file, header, vertex, end);
    if (const PlyElement* sh = header.find("sh")) behind = read_sh(file, header, *sh, where, model);
    if (!behind.empty()) said.notes.push_back(behind);
    settle_shapes(model, said.notes);
    said.dropped = drop_non_finite(model);
    said.position_step = usual_step(chunks);
    if (facts) *facts = std::move(said);
    return model;
}

std::vector<std::string> compressed_ply_losses(const SplatModel& model) {
    std::vector<std::string> losses;
    if (const std::size_t count = count_outside(model.sh_rest, -4, 4); count > 0)
        losses.push_back(
            fmt::format("{} coefficients of harmonics outside -4 to 4 are cut to it", count));
    std::size_t count = 0;
    double farthest = 0;
    for_each_chunk(model, chunk_order(model, kChunk),
                   [&](std::span<const std::uint32_t> splats, const Chunk& chunk) {
                       for (const std::uint32_t i : splats) {
                           const double shift = shift_of(model, i, chunk);
                           const float* s = &model.log_scale[3 * std::size_t{i}];
                           if (shift <= std::exp(drawn_log_scale(std::max({s[0], s[1], s[2]}))))
                               continue;
                           ++count;
                           farthest = std::max(farthest, shift);
                       }
                   });
    if (count > 0)
        losses.push_back(
            fmt::format("{} splats move by more than their own size, by up to {:.3g}, as {} share "
                        "the bounds of "
                        "their positions: --crop leaves out what lies far off",
                        count, farthest, kChunk));
    return losses;
}

std::vector<std::byte> encode_compressed_ply(const SplatModel& model) {
    check_splat_shapes(model);
    const std::vector<std::uint32_t> order = chunk_order(model, kChunk);
    const std::string header = make_header(model);
    const auto text = std::as_bytes(std::span(header.data(), header.size()));
    std::vector<std::byte> file(text.begin(), text.end()), packed;
    for_each_chunk(model, order, [&](std::span<const std::uint32_t> splats, const Chunk& chunk) {
        for (std::size_t first = 0; first < 9; first += 3)
            for (const std::array<float, 9>* end : {&chunk.low, &chunk.high})
                for (std::size_t i = first; i < first + 3; ++i) append((*end)[i], file);
        for (const std::uint32_t i : splats) append(pack_splat(model, i, chunk), packed);
    });
    const auto rest = static_cast<std::size_t>(model.rest_count());
    for (const std::uint32_t i : order)
        for (std::size_t c = 0; c < rest; ++c) {
            const double value = model.sh_rest[i * rest + (c % (rest / 3)) * 3 + c / (rest / 3)];
            const double step = std::floor((value / 8 + 0.5) * 256);
            packed.push_back(static_cast<std::byte>(std::clamp(step, 0.0, 255.0)));
        }
    file.insert(file.end(), packed.begin(), packed.end());
    return file;
}

// The reader of PLY also reads this format; the header tells which it is.
const SplatFormatRow& compressed_ply_format() {
    static const SplatFormatRow row{
        .name = "compressed PLY",
        .endings = {".compressed.ply"},
        .encode = [](const SplatModel& model, const std::string&,
                     const EncodeOptions&) { return EncodedSplats{encode_compressed_ply(model)}; },
        .keeps = kKeepsKernel | kKeepsRenderMode | kKeepsHarmonics | kKeepsUnit | kKeepsPlace,
        .cuts = [](const SplatModel& model,
                   const std::string&) { return compressed_ply_losses(model); }};
    return row;
}

}  // namespace darb
