#include "engine/scene/ply_dialects.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <string_view>

#include "engine/core/error.h"
#include "engine/kernels/shaped_kernel.h"
#include "engine/scene/compressed_ply.h"
#include "engine/scene/quantise.h"
#include "engine/scene/splat_file.h"
#include "shaders/shared/kernel_forms.h"
#include "shaders/shared/limits.h"

namespace darb {

namespace {

constexpr std::size_t kRestOfDegree3 = 45, kRestOfDegree4 = 72;
constexpr std::size_t kMostNamed = 8;  // properties, in a note

/// -1 where there is none of that name, or a list.
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

/// Deformable Beta Splatting has other names of harmonics.
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

/// Names; harmonics have a note of their own.
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
    const int missing = static_cast<int>(columns.count);  // translate_row puts it there
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
    row.push_back(-LOG_SCALE_LIMIT);  // of the axis that the file may lack
    double* at = row.data();
    if (columns.dc_is_byte)
        for (const int column : columns.of[kShDc]) at[column] = dc_of_colour(at[column] / 255);
    if (columns.filter >= 0) apply_filter(columns, at);
    return at;
}

}  // namespace darb
