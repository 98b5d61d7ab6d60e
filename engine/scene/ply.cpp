// SPDX-License-Identifier: MIT
#include "engine/scene/ply.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <nlohmann/json.hpp>
#include <optional>
#include <string_view>

#include "engine/core/error.h"
#include "engine/core/files.h"
#include "engine/core/parse_number.h"
#include "engine/core/text.h"
#include "engine/kernels/kernel_coefficients.h"
#include "engine/kernels/kernel_definition.h"
#include "engine/kernels/kernel_registry.h"
#include "engine/kernels/shaped_kernel.h"
#include "engine/scene/compressed_ply.h"
#include "engine/scene/edit_splats.h"
#include "engine/scene/ply_table.h"
#include "engine/scene/quantise.h"
#include "engine/scene/splat_file.h"
#include "engine/scene/splat_format.h"
#include "engine/scene/splat_model.h"
#include "shaders/shared/kernel_forms.h"
#include "shaders/shared/limits.h"

namespace darb {

namespace {

// The model stores float32.
float stored(const double* values, const PlyColumns& columns, std::size_t a, std::size_t c) {
    const auto value = static_cast<float>(values[columns.of[a][c]]);
    const auto limit = kSplatAttributes[a].from_file;
    return limit ? limit(value) : value;
}

bool all_finite(const double* values, const PlyColumns& columns) {
    for (std::size_t a = 0; a < kAttributeCount; ++a)
        for (std::size_t c = 0; c < columns.of[a].size(); ++c)
            if (!std::isfinite(stored(values, columns, a, c))) return false;
    return true;
}

// Drops a column that is named like shapes, where the kernel has none.
void drop_shapes_of_others(int kernel, PlyColumns& columns) {
    if (columns.foreign_beta || columns.of[kShape].empty() || kernel_takes(kernel, kShape)) return;
    columns.of[kShape].clear();
    columns.unread.push_back(ply_column(kShape, 0));
}

// Positions are set later, all at once.
void store_splat(const double* values, const PlyColumns& columns, std::size_t at,
                 SplatModel& model) {
    for (std::size_t a = 0; a < kAttributeCount; ++a) {
        if (a == kPosition) continue;
        const std::size_t floats = columns.of[a].size();
        float* to = attribute_values(model, static_cast<int>(a)).data() + at * floats;
        for (std::size_t c = 0; c < floats; ++c) to[c] = stored(values, columns, a, c);
    }
}

std::string make_header(const SplatModel& model, bool double_positions) {
    std::string text = fmt::format("ply\nformat binary_little_endian 1.0\n{}element vertex {}\n",
                                   ply_comments(model), model.size());
    for (const int a : attributes_in_file_order()) {
        const bool wide = double_positions && a == kPosition;
        for (std::size_t c = 0; c < model.floats(a); ++c)
            text += fmt::format("property {} {}\n", wide ? "double" : "float", ply_column(a, c));
        if (a != kPosition) continue;
        for (const char* name : {"nx", "ny", "nz"})
            text += fmt::format("property float {}\n", name);
    }
    return text + "end_header\n";
}

template <class T>
std::byte* put(std::byte* to, const T* values, std::size_t count) {
    if (count > 0)
        std::memcpy(to, values, count * sizeof(T));  // values may be null where count is
                                                     // 0
    return to + count * sizeof(T);
}

std::byte* put_position(std::byte* to, const SplatModel& model, std::size_t splat, bool doubles) {
    for (std::size_t i = 0; i < 3; ++i) {
        const float local = model.position[splat * 3 + i];
        const double origin = model.origin[static_cast<int>(i)], value = origin + double{local};
        // Adding a zero origin would turn -0 into 0.
        const float narrow = origin == 0.0 ? local : static_cast<float>(value);
        to = doubles ? put(to, &value, 1) : put(to, &narrow, 1);
    }
    constexpr float kNoNormal[3] = {0, 0, 0};
    return put(to, kNoNormal, 3);
}

std::byte* put_row(std::byte* to, const SplatModel& model, int attribute, std::size_t splat) {
    const std::size_t floats = model.floats(attribute);
    const float* from = attribute_values(model, attribute).data() + splat * floats;
    if (!kSplatAttributes[static_cast<std::size_t>(attribute)].per_coefficient)
        return put(to, from, floats);
    for (std::size_t c = 0; c < floats; ++c)
        put(to + file_column(attribute, model.sh_degree, c) * sizeof(float), from + c, 1);
    return to + floats * sizeof(float);
}

std::string encoding_of(const PlyHeader& header) {
    if (header.format == PlyFormat::ascii) return "ascii";
    return header.format == PlyFormat::big_endian ? "binary, big-endian" : "binary, little-endian";
}

// These programs write logarithms and logits, and are read accordingly.
void refuse_units(const PlyHeader& header, const SplatSource& source) {
    const PlyElement* vertex = header.find("vertex");
    const bool changed =
        source.units.scales != StoredScales{} || source.units.opacities != StoredOpacities{};
    if (!vertex || !changed || (vertex->find("filter_3D") < 0 && vertex->find("sh0_0") < 0)) return;
    throw Error(source.where,
                "is a scene of Mip-Splatting or Deformable Beta Splatting, whose scales are "
                "logarithms and whose opacities are logits",
                "Leave out --scales and --opacities.");
}

// Reads compressed PLY, too.
SplatModel load_ply(const SplatSource& source, SplatFile& file) {
    const PlyHeader header = parse_ply_header(source.bytes, source.where);
    if (is_compressed_ply(header)) file.format = SplatFormat::compressed_ply;
    file.details = encoding_of(header);
    const bool points = is_point_cloud(header);
    if (points && source.read_points) return source.read_points(header);
    if (points)
        throw Error(source.where,
                    "is a point cloud: its vertices have no opacity, scale and rotation",
                    "darb train starts from it where it lies beside the cameras; a viewer shows it "
                    "as points.");
    refuse_units(header, source);
    PlyFacts facts;
    SplatModel model = parse_ply(source.bytes, header, source.where, &facts, source.progress);
    file.dropped = facts.dropped;
    file.notes = facts.notes;
    file.up = facts.up;
    file.position_step = facts.position_step;
    return model;
}

void said_of_foreign_shapes(std::size_t held, PlyFacts* facts) {
    if (!facts) return;
    facts->notes.push_back(
        "is a scene of Deformable Beta Splatting: drawn with the kernel beta (exact)");
    if (held > 0)
        facts->notes.push_back(
            fmt::format("{} of its exponents lie outside of {} to {} and are held there", held,
                        BETA_EXPONENT_LEAST, BETA_EXPONENT_MOST));
}

std::vector<std::string> ply_losses(const SplatModel& model, const std::string&) {
    if (!needs_double_positions(model)) return {};
    const glm::dvec3 to_0 = 0.0 - model.origin;
    return {fmt::format(
        "positions are written as double, which few other programs read, as float32 does not "
        "resolve them: --translate {},{},{} brings the scene to 0",
        to_0.x, to_0.y, to_0.z)};
}

std::size_t floats_in_all(const SplatModel& model) {
    std::size_t sum = 0;
    for (int a = 0; a < kAttributeCount; ++a) sum += model.floats(a);
    return sum;
}

}  // namespace

SplatModel parse_ply(std::span<const std::byte> file, const std::string& where, PlyFacts* facts,
                     const ReadProgress& progress) {
    return parse_ply(file, parse_ply_header(file, where), where, facts, progress);
}

SplatModel parse_ply(std::span<const std::byte> file, const PlyHeader& header,
                     const std::string& where, PlyFacts* facts, const ReadProgress& progress) {
    const PlyElement* vertex = header.find("vertex");
    if (!vertex) throw Error(where, "has no element vertex", "A splat scene is needed.");
    if (is_compressed_ply(header))
        return parse_compressed_ply(file, header, where, facts, progress);
    PlyColumns columns = find_ply_columns(*vertex, where);
    check_ply_size(file, header, *vertex, where);

    SplatModel model;
    PlyFacts said;
    model.sh_degree =
        static_cast<int>(std::lround(std::sqrt(columns.of[kShRest].size() / 3 + 1))) - 1;
    read_ply_comments(header, where, model, said.notes);
    said.up = stated_up(header);
    drop_shapes_of_others(model.kernel, columns);
    const bool foreign = columns.foreign_beta;  // a scene of Deformable Beta Splatting
    if (foreign) {
        model.kernel = KERNEL_BETA;
        model.footprint = Footprint::exact;
    }
    for (std::size_t a = 0; a < kAttributeCount; ++a)
        attribute_values(model, static_cast<int>(a)).resize(vertex->count * columns.of[a].size());
    std::vector<double> positions, translated;
    positions.reserve(vertex->count * 3);
    std::size_t kept = 0;
    bool has_normals = false;
    const PlyRow row = [&](std::size_t, const double* read) {
        const double* values = translate_row(columns, read, translated);
        for (const int column : columns.normal) has_normals |= values[column] != 0;
        if (!all_finite(values, columns)) return;
        for (const int column : columns.of[kPosition]) positions.push_back(values[column]);
        store_splat(values, columns, kept++, model);
    };
    const std::size_t end = read_ply_rows(file, header, *vertex, where, row, progress);
    if (facts) {
        const std::string behind = ply_bytes_behind(file, header, *vertex, end);
        if (!behind.empty()) said.notes.push_back(behind);
        const std::vector<std::string> notes = ply_notes(columns, has_normals);
        said.notes.insert(said.notes.end(), notes.begin(), notes.end());
        said.dropped = vertex->count - kept;
        *facts = std::move(said);
    }
    model.resize(kept);
    if (foreign) said_of_foreign_shapes(take_foreign_shapes(model), facts);
    std::vector<std::string> notes;
    settle_shapes(model, notes);
    if (facts) facts->notes.insert(facts->notes.end(), notes.begin(), notes.end());
    set_positions(positions, model);
    return model;
}

SplatModel read_ply(const std::filesystem::path& path) {
    return parse_ply(read_file(path), path.string());
}

bool needs_double_positions(const SplatModel& model) {
    if (model.origin == glm::dvec3(0.0)) return false;
    std::vector<double> positions(model.position.begin(), model.position.end());
    for (std::size_t i = 0; i < positions.size(); ++i)
        positions[i] += model.origin[static_cast<int>(i % 3)];
    return origin_for_float32(positions) != glm::dvec3(0.0);
}

std::vector<std::byte> encode_ply(const SplatModel& model) {
    check_splat_shapes(model);
    const bool doubles = needs_double_positions(model);
    const std::string header = make_header(model, doubles);
    const std::size_t row = 3 * (doubles ? 8 : 4) + 3 * 4 + (floats_in_all(model) - 3) * 4;
    std::vector<std::byte> file(header.size() + model.size() * row);
    std::byte* to = put(file.data(), header.data(), header.size());
    for (std::size_t n = 0; n < model.size(); ++n)
        for (const int a : attributes_in_file_order())
            to = a == kPosition ? put_position(to, model, n, doubles) : put_row(to, model, a, n);
    return file;
}

void write_ply(const std::filesystem::path& path, const SplatModel& model) {
    write_file_atomic(path, encode_ply(model));
}

const SplatFormatRow& ply_format() {
    static const SplatFormatRow row{
        .name = "PLY",
        .endings = {".ply"},
        .recognise = [](const SplatSource& source) { return looks_like_ply(source.bytes); },
        .parse = load_ply,
        .encode = [](const SplatModel& model, const std::string&,
                     const EncodeOptions&) { return EncodedSplats{encode_ply(model)}; },
        .keeps = kKeepsKernel | kKeepsRenderMode | kKeepsHarmonics | kKeepsDoublePositions |
                 kKeepsUnturned | kKeepsShape | kKeepsUnit | kKeepsPlace,
        .cuts = ply_losses};
    return row;
}

namespace {

/// The value in "Key: value" or "Key value"; empty where the comment has another key.
std::string_view value_of(std::string_view comment, std::string_view key) {
    if (lower(comment.substr(0, key.size())) != lower(key)) return {};
    comment.remove_prefix(key.size());
    if (comment.empty() || (comment[0] != ':' && comment[0] != ' ')) return {};
    return comment.substr(std::min(comment.find_first_not_of(": \t"), comment.size()));
}

std::string_view last_value(const PlyHeader& header, std::string_view key) {
    std::string_view value;
    for (const std::string& comment : header.comments)
        if (const std::string_view one = value_of(comment, key); !one.empty()) value = one;
    return value;
}

int kernel_defined_by(std::string_view name, std::string_view function, const std::string& where,
                      std::vector<std::string>& notes) {
    const auto parsed = nlohmann::json::parse(function, nullptr, false);
    if (!parsed.is_object())
        throw Error(where, "its comment SplatKernelFunction is no JSON object", kCopyAgain);
    return register_kernel_of_file(
        definition_from_json({{"name", std::string(name)}, {"function", parsed}}, where), where,
        notes);
}

/// Comments on a user's own kernel: what defines it here, and what draws it in a program that
/// cannot fit one.
std::string function_comments(const SplatModel& model) {
    const KernelDefinition* definition = kernel_definition(model.kernel);
    if (definition == nullptr) return {};
    std::string lines = fmt::format("comment SplatKernelFunction: {}\n",
                                    definition_json(*definition)["function"].dump(
                                        -1, ' ', true, nlohmann::json::error_handler_t::replace));
    const KernelCoefficients& k = kernel_coefficients(model.kernel, model.footprint, kFullDegree);
    if (k.form != KERNEL_FORM_COMPACT) return lines;
    const std::string t = fmt::format("q / {}", k.support);
    lines += fmt::format("comment SplatKernelPolynomial: w = (1 - x)^{} P(x), x = {}, P",
                         0.5 * k.half_power, k.squared ? "(" + t + ")^2" : t);
    for (int i = 0; i <= k.degree; ++i)
        lines += fmt::format(" {}", static_cast<float>(k.c[static_cast<std::size_t>(i)]));
    return lines + "\n";
}

void read_render_mode(const PlyHeader& header, SplatModel& model, std::vector<std::string>& notes) {
    std::string mode = "default";
    for (const std::string& comment : header.comments) {
        const std::string_view named = value_of(comment, "SplatRenderMode");
        const std::string_view flag = value_of(comment, "antialiased");
        if (!named.empty()) mode = lower(named);
        if (flag == "0" || flag == "1") mode = flag == "1" ? "mip" : "default";
    }
    model.antialias = mode == "mip";
    if (mode != "mip" && mode != "default")
        notes.push_back(
            fmt::format("the SplatRenderMode '{}' is not known: drawn as default", mode));
}

void read_unit(const PlyHeader& header, SplatModel& model, std::vector<std::string>& notes) {
    const std::string_view text = last_value(header, "SplatMetresPerUnit");
    if (text.empty()) return;
    double value = 0;
    const auto [end, error] = parse_number(text.data(), text.data() + text.size(), value);
    const bool whole = error == std::errc{} && end == text.data() + text.size();
    if (whole && std::isfinite(value) && value > 0)
        model.metres_per_unit = value;
    else
        notes.push_back(fmt::format("the SplatMetresPerUnit '{}' is no length: left out",
                                    printable(text.substr(0, 40))));
}

void read_place(const PlyHeader& header, SplatModel& model, std::vector<std::string>& notes) {
    const std::string_view text = last_value(header, "SplatEarthPlace");
    if (text.empty()) return;
    if (const std::optional<EarthPlace> place = place_from_text(text))
        model.place = *place;
    else
        notes.push_back(fmt::format("the SplatEarthPlace '{}' is no place: left out",
                                    printable(text.substr(0, 80))));
}

}  // namespace

void read_ply_comments(const PlyHeader& header, const std::string& where, SplatModel& model,
                       std::vector<std::string>& notes) {
    if (const std::string_view name = last_value(header, "SplatKernel"); !name.empty()) {
        const std::string_view function = last_value(header, "SplatKernelFunction");
        const std::optional<int> kernel = function.empty()
                                              ? kernel_from_name(name)
                                              : kernel_defined_by(name, function, where, notes);
        if (!kernel)
            throw Error(where, fmt::format("names the unknown SplatKernel '{}'", name),
                        "darb train --help lists the kernels; correct or remove the comment.");
        model.kernel = *kernel;
    }
    if (const std::string_view name = last_value(header, "SplatFootprint"); !name.empty()) {
        const std::optional<Footprint> footprint = footprint_from_name(name);
        if (!footprint)
            throw Error(where, fmt::format("names the unknown SplatFootprint '{}'", name),
                        "psi and exact are known; correct or remove the comment.");
        model.footprint = *footprint;
    }
    if (model.footprint == Footprint::exact && !has_exact_footprint(model.kernel))
        throw Error(where,
                    fmt::format("names SplatFootprint exact, which {} does not have",
                                kernel_name(model.kernel)),
                    "Correct the comment to psi, or remove it.");
    read_render_mode(header, model, notes);
    read_unit(header, model, notes);
    read_place(header, model, notes);
    if (stated_up(header) == "z")
        notes.emplace_back(
            "its comment 'Vertical axis: z' says what is up: darb view follows it, --up z of darb "
            "convert turns the scene");
}

std::string stated_up(const PlyHeader& header) {
    return lower(last_value(header, "Vertical axis")) == "z" ? "z" : "";
}

std::string ply_comments(const SplatModel& model) {
    std::string unit = model.metres_per_unit > 0
                           ? fmt::format("comment SplatMetresPerUnit: {}\n", model.metres_per_unit)
                           : "";
    if (model.place.known())
        unit += fmt::format("comment SplatEarthPlace: {}\n", place_text(model.place));
    return fmt::format(
        "comment SplatKernel: {}\ncomment SplatFootprint: {}\ncomment SplatRenderMode: {}\n{}{}",
        kernel_name(model.kernel), footprint_name(model.footprint),
        model.antialias ? "mip" : "default", unit, function_comments(model));
}

namespace {

constexpr std::size_t kRestOfDegree3 = 45, kRestOfDegree4 = 72;
constexpr std::size_t kMostNamed = 8;  // properties, in a note

/// Column of the property; -1 where there is none with that name, or it is a list.
int find_value(const PlyElement& vertex, std::string_view name) {
    const int column = vertex.find(name);
    return column < 0 || vertex.properties[static_cast<std::size_t>(column)].is_list ? -1 : column;
}

int need(const PlyElement& vertex, const std::string& name, const std::string& where) {
    const int column = find_value(vertex, name);
    if (column < 0)
        throw Error(where, fmt::format("element vertex lacks the property {}", name),
                    "A splat scene is needed, not a point cloud or mesh.");
    return column;
}

bool is_foreign_beta(const PlyElement& vertex) {
    return find_value(vertex, "beta") >= 0 && vertex.find("sh0_0") >= 0 &&
           vertex.find(ply_column(kShape, 0)) < 0;
}

/// The column of a harmonic; Deformable Beta Splatting has other names.
std::string harmonics_column(const PlyElement& vertex, int attribute, std::size_t c) {
    return is_foreign_beta(vertex) ? fmt::format("{}_{}", attribute == kShDc ? "sh0" : "shN", c)
                                   : ply_column(attribute, c);
}

bool has_colour_bytes(const PlyElement& vertex) {
    return vertex.find(harmonics_column(vertex, kShDc, 0)) < 0 &&
           std::ranges::all_of(std::array{"red", "green", "blue"}, [&](const char* name) {
               const int column = find_value(vertex, name);
               return column >= 0 &&
                      vertex.properties[static_cast<std::size_t>(column)].type == PlyType::uint8;
           });
}

void find_harmonics(const PlyElement& vertex, const std::string& where, PlyColumns& columns) {
    std::vector<int> rest;  // in the file's order, channel by channel
    for (std::size_t i = 0; vertex.find(harmonics_column(vertex, kShRest, i)) >= 0; ++i)
        rest.push_back(need(vertex, harmonics_column(vertex, kShRest, i), where));
    const std::size_t count = rest.size();
    if (count == kRestOfDegree4) {  // the last band of each channel is left out
        std::vector<int> kept;
        for (std::size_t i = 0; i < count; ++i)
            if (i % (kRestOfDegree4 / 3) < kRestOfDegree3 / 3) kept.push_back(rest[i]);
        rest = std::move(kept);
        columns.notes.emplace_back("harmonics of degree 4 were left out");
    } else if (count != 0 && count != 9 && count != 24 && count != kRestOfDegree3) {
        throw Error(
            where,
            fmt::format("has {} f_rest properties; SH degree 0 to 4 has 0, 9, 24, 45, 72", count),
            "Export the scene again with whole bands.");
    }
    for (std::size_t i = 0; i < rest.size(); ++i)
        columns.of[kShRest].push_back(rest[i % 3 * (rest.size() / 3) + i / 3]);
}

/// Names of unread properties, but for harmonics, which have a note of their own.
std::vector<std::string> unread_properties(const PlyElement& vertex, const PlyColumns& columns) {
    const bool lobes = vertex.find("sb_params_0") >= 0;
    std::vector<int> read = columns.normal;
    read.push_back(columns.filter);
    for (const auto& of : columns.of) read.insert(read.end(), of.begin(), of.end());
    std::vector<std::string> names;
    for (std::size_t i = 0; i < vertex.properties.size(); ++i)
        if (const std::string& name = vertex.properties[i].name;
            std::ranges::count(read, static_cast<int>(i)) == 0 && !name.starts_with("f_rest_") &&
            !(lobes && name.starts_with("sb_params_")))
            names.push_back(name);
    if (lobes) names.emplace_back("sb_params, its lobes of colour");
    return names;
}

/// ln sqrt(s^2 + f^2), without overflow.
double log_of_blurred(double log_scale, double filter) {
    const double a = 2 * log_scale, b = 2 * std::log(std::abs(filter));
    return (std::max(a, b) + std::log1p(std::exp(-std::abs(a - b)))) / 2;
}

/// As Mip-Splatting draws: s'^2 = s^2 + f^2, opacity' = opacity * product of s / s'.
void apply_filter(const PlyColumns& columns, double* row) {
    double shrink = 0;  // -ln of the product
    for (const int column : columns.of[kLogScale]) {
        const double log_scale = limit_infinite_log_scale(static_cast<float>(row[column]));
        row[column] = log_of_blurred(log_scale, row[columns.filter]);
        shrink += row[column] - log_scale;
    }
    double& logit = row[columns.of[kOpacityLogit][0]];
    logit = -shrink - std::log(std::exp(-logit) - std::expm1(-shrink));
}

}  // namespace

bool is_point_cloud(const PlyHeader& header) {
    const PlyElement* vertex = header.find("vertex");
    return vertex && vertex->find("x") >= 0 && vertex->find("opacity") < 0 &&
           vertex->find("scale_0") < 0 && vertex->find("f_dc_0") < 0 && !is_compressed_ply(header);
}

PlyColumns find_ply_columns(const PlyElement& vertex, const std::string& where) {
    PlyColumns columns;
    columns.count = vertex.properties.size();
    columns.dc_is_byte = has_colour_bytes(vertex);
    const char* const colours[] = {"red", "green", "blue"};
    const int missing = static_cast<int>(columns.count);  // the column that translate_row adds
    const bool flat = vertex.find(ply_column(kLogScale, 2)) < 0;
    for (const int a : attributes_in_file_order()) {
        if (a == kShRest) continue;
        std::vector<int>& of = columns.of[static_cast<std::size_t>(a)];
        const SplatAttribute& row = kSplatAttributes[static_cast<std::size_t>(a)];
        if (row.optional && find_value(vertex, ply_column(a, 0)) < 0) {
            if (a != kShape || !is_foreign_beta(vertex)) continue;
            of.push_back(find_value(vertex, "beta"));
            columns.foreign_beta = true;
            continue;
        }
        for (std::size_t c = 0; c < row.floats; ++c) {
            const bool byte = a == kShDc && columns.dc_is_byte;
            of.push_back(a == kLogScale && c == 2 && flat
                             ? missing
                             : need(vertex,
                                    byte         ? colours[c]
                                    : a == kShDc ? harmonics_column(vertex, a, c)
                                                 : ply_column(a, c),
                                    where));
        }
    }
    if (flat)
        columns.notes.emplace_back("has no scale_2, as scenes of 2DGS: splats have no thickness");
    for (const char* name : {"nx", "ny", "nz"})
        if (const int normal = find_value(vertex, name); normal >= 0)
            columns.normal.push_back(normal);
    columns.filter = find_value(vertex, "filter_3D");
    if (columns.filter >= 0)
        columns.notes.emplace_back("filter_3D (Mip-Splatting) is now part of scales and opacities");
    find_harmonics(vertex, where, columns);
    columns.unread = unread_properties(vertex, columns);
    return columns;
}

std::size_t take_foreign_shapes(SplatModel& model) {
    const auto longer = static_cast<float>(0.5 * std::log(BETA_SUPPORT));
    for (float& scale : model.log_scale) scale -= longer;
    std::size_t held = 0;
    for (float& shape : model.shape) {
        const double drawn = BETA_START * std::exp(double{shape});
        held += drawn < BETA_EXPONENT_LEAST || drawn > BETA_EXPONENT_MOST ? 1 : 0;
        const double inside = std::clamp<double>(drawn, BETA_EXPONENT_LEAST, BETA_EXPONENT_MOST);
        shape = static_cast<float>(beta_shape_of(inside - 0.5));
    }
    return held;
}

std::vector<std::string> ply_notes(const PlyColumns& columns, bool has_normals) {
    std::vector<std::string> notes = columns.notes, names = columns.unread;
    if (has_normals) names.insert(names.begin(), "normals");
    if (names.empty()) return notes;
    const std::size_t named = std::min(names.size(), kMostNamed);
    notes.push_back(fmt::format(
        "left out, as nothing here uses them: {}{}",
        fmt::join(names.begin(), names.begin() + static_cast<std::ptrdiff_t>(named), ", "),
        names.size() > named ? fmt::format(" and {} others", names.size() - named) : ""));
    return notes;
}

const double* translate_row(const PlyColumns& columns, const double* values,
                            std::vector<double>& row) {
    const bool as_3dgs = columns.of[kLogScale][2] < static_cast<int>(columns.count);
    if (as_3dgs && !columns.dc_is_byte && columns.filter < 0) return values;
    row.assign(values, values + columns.count);
    row.push_back(-LOG_SCALE_LIMIT);  // for an axis that the file may lack
    double* at = row.data();
    if (columns.dc_is_byte)
        for (const int column : columns.of[kShDc]) at[column] = dc_of_colour(at[column] / 255);
    if (columns.filter >= 0) apply_filter(columns, at);
    return at;
}

}  // namespace darb
