#include "engine/scene/ply.h"

#include <fmt/format.h>

#include <array>
#include <cmath>
#include <cstring>
#include <string_view>

#include "engine/core/check.h"
#include "engine/core/error.h"
#include "engine/core/files.h"
#include "engine/scene/compressed_ply.h"
#include "engine/scene/edit_splats.h"
#include "engine/scene/infinite_values.h"
#include "engine/scene/ply_comments.h"
#include "engine/scene/ply_table.h"
#include "engine/scene/splat_shapes.h"

namespace darb {

namespace {

constexpr std::size_t kRestOfDegree3 = 45, kRestOfDegree4 = 72;

/// Column of every parameter in the vertex element.
struct Columns {
    std::array<int, 3> position{}, dc{}, scale{};
    std::array<int, 4> rotation{};
    int opacity = 0;
    std::vector<int> rest;  // in file order: channel-major
};

int need(const PlyElement& vertex, const std::string& name, const std::string& where) {
    const int column = vertex.find(name);
    if (column < 0 || vertex.properties[static_cast<std::size_t>(column)].is_list)
        throw Error(where, fmt::format("element vertex lacks the property {}", name),
                    "A splat scene is needed, not a point cloud or mesh.");
    return column;
}

Columns find_columns(const PlyElement& vertex, const std::string& where) {
    Columns columns;
    for (int i = 0; i < 3; ++i) {
        columns.position[i] = need(vertex, std::string(1, "xyz"[i]), where);
        columns.dc[i] = need(vertex, fmt::format("f_dc_{}", i), where);
        columns.scale[i] = need(vertex, fmt::format("scale_{}", i), where);
    }
    for (int i = 0; i < 4; ++i) columns.rotation[i] = need(vertex, fmt::format("rot_{}", i), where);
    columns.opacity = need(vertex, "opacity", where);
    for (int i = 0; vertex.find(fmt::format("f_rest_{}", i)) >= 0; ++i)
        columns.rest.push_back(need(vertex, fmt::format("f_rest_{}", i), where));
    const std::size_t count = columns.rest.size();
    if (count == kRestOfDegree4) {  // the last band of each channel is left out
        std::vector<int> kept;
        for (std::size_t i = 0; i < count; ++i)
            if (i % (kRestOfDegree4 / 3) < kRestOfDegree3 / 3) kept.push_back(columns.rest[i]);
        columns.rest = std::move(kept);
    } else if (count != 0 && count != 9 && count != 24 && count != kRestOfDegree3) {
        throw Error(
            where,
            fmt::format("has {} f_rest properties; SH degree 0 to 4 has 0, 9, 24, 45, 72", count),
            "Export the scene again with whole bands.");
    }
    return columns;
}

bool all_finite(const double* values, const Columns& columns) {
    // float32 range is what the model stores.
    const auto value = [&](int column) { return static_cast<float>(values[column]); };
    const auto good = [&](int column) { return std::isfinite(value(column)); };
    bool finite = std::isfinite(limit_infinite_logit(value(columns.opacity)));
    for (int i = 0; i < 3; ++i)
        finite = finite && good(columns.position[i]) && good(columns.dc[i]) &&
                 std::isfinite(limit_infinite_log_scale(value(columns.scale[i])));
    for (const int column : columns.rotation) finite = finite && good(column);
    for (const int column : columns.rest) finite = finite && good(column);
    return finite;
}

void store_splat(const double* values, const Columns& columns, std::size_t at, SplatModel& model) {
    for (std::size_t i = 0; i < 3; ++i) {
        model.sh_dc[at * 3 + i] = static_cast<float>(values[columns.dc[i]]);
        model.log_scale[at * 3 + i] =
            limit_infinite_log_scale(static_cast<float>(values[columns.scale[i]]));
    }
    for (std::size_t i = 0; i < 4; ++i)
        model.rotation[at * 4 + i] = static_cast<float>(values[columns.rotation[i]]);
    model.opacity[at] = limit_infinite_logit(static_cast<float>(values[columns.opacity]));
    const std::size_t rest = columns.rest.size(), per_channel = rest / 3;
    for (std::size_t i = 0; i < rest; ++i) {
        const std::size_t channel = i / per_channel, coefficient = i % per_channel;
        model.sh_rest[at * rest + coefficient * 3 + channel] =
            static_cast<float>(values[columns.rest[i]]);
    }
}

bool needs_double(const SplatModel& model) {
    if (model.origin == glm::dvec3(0.0)) return false;
    std::vector<double> positions(model.position.begin(), model.position.end());
    for (std::size_t i = 0; i < positions.size(); ++i)
        positions[i] += model.origin[static_cast<int>(i % 3)];
    return origin_for_float32(positions) != glm::dvec3(0.0);
}

std::string make_header(const SplatModel& model, bool double_positions) {
    std::string text = fmt::format("ply\nformat binary_little_endian 1.0\n{}element vertex {}\n",
                                   ply_comments(model), model.size());
    for (const char* name : {"x", "y", "z"})
        text += fmt::format("property {} {}\n", double_positions ? "double" : "float", name);
    for (const char* name : {"nx", "ny", "nz", "f_dc_0", "f_dc_1", "f_dc_2"})
        text += fmt::format("property float {}\n", name);
    for (int i = 0; i < model.rest_count(); ++i)
        text += fmt::format("property float f_rest_{}\n", i);
    for (const char* name :
         {"opacity", "scale_0", "scale_1", "scale_2", "rot_0", "rot_1", "rot_2", "rot_3"})
        text += fmt::format("property float {}\n", name);
    return text + "end_header\n";
}

template <class T>
std::byte* put(std::byte* to, const T* values, std::size_t count) {
    if (count > 0) std::memcpy(to, values, count * sizeof(T));  // values may be null without any
    return to + count * sizeof(T);
}

}  // namespace

bool has_degree_4(const PlyElement& vertex) {
    return vertex.find(fmt::format("f_rest_{}", kRestOfDegree4 - 1)) >= 0 &&
           vertex.find(fmt::format("f_rest_{}", kRestOfDegree4)) < 0;
}

SplatModel parse_ply(std::span<const std::byte> file, const std::string& where,
                     std::size_t* dropped, const ReadProgress& progress) {
    const PlyHeader header = parse_ply_header(file, where);
    const PlyElement* vertex = header.find("vertex");
    if (!vertex) throw Error(where, "has no element vertex", "A splat scene is needed.");
    if (is_compressed_ply(header))
        return parse_compressed_ply(file, header, where, dropped, progress);
    const Columns columns = find_columns(*vertex, where);
    check_ply_size(file, header, *vertex, where);

    SplatModel model;
    model.sh_degree = static_cast<int>(std::lround(std::sqrt(columns.rest.size() / 3 + 1))) - 1;
    read_ply_comments(header, where, model);
    model.resize(vertex->count);
    std::vector<double> positions;
    positions.reserve(vertex->count * 3);
    std::size_t kept = 0;
    const PlyRow row = [&](std::size_t, const double* values) {
        if (!all_finite(values, columns)) return;
        for (const int column : columns.position) positions.push_back(values[column]);
        store_splat(values, columns, kept++, model);
    };
    read_ply_rows(file, header, *vertex, where, row, progress);
    if (dropped) *dropped = vertex->count - kept;
    model.resize(kept);
    set_positions(positions, model);
    return model;
}

SplatModel read_ply(const std::filesystem::path& path, std::size_t* dropped) {
    return parse_ply(read_file(path), path.string(), dropped);
}

std::vector<std::byte> encode_ply(const SplatModel& model) {
    check_splat_shapes(model);
    const bool doubles = needs_double(model);
    const std::string header = make_header(model, doubles);
    const std::size_t rest = static_cast<std::size_t>(model.rest_count()), per_channel = rest / 3;
    const std::size_t row = 3 * (doubles ? 8 : 4) + (3 + 3 + rest + 8) * 4;
    std::vector<std::byte> file(header.size() + model.size() * row);
    std::byte* to = put(file.data(), header.data(), header.size());
    std::vector<float> rest_row(rest);
    constexpr float kNoNormal[3] = {0, 0, 0};
    for (std::size_t n = 0; n < model.size(); ++n) {
        for (std::size_t i = 0; i < 3; ++i) {
            const double value =
                model.origin[static_cast<int>(i)] + double{model.position[n * 3 + i]};
            // Adding a zero origin would turn -0 into 0.
            const float narrow = model.origin[static_cast<int>(i)] == 0.0
                                     ? model.position[n * 3 + i]
                                     : static_cast<float>(value);
            to = doubles ? put(to, &value, 1) : put(to, &narrow, 1);
        }
        to = put(to, kNoNormal, 3);
        to = put(to, &model.sh_dc[n * 3], 3);
        for (std::size_t i = 0; i < rest; ++i)
            rest_row[i] = model.sh_rest[n * rest + (i % per_channel) * 3 + i / per_channel];
        to = put(to, rest_row.data(), rest);
        to = put(to, &model.opacity[n], 1);
        to = put(to, &model.log_scale[n * 3], 3);
        to = put(to, &model.rotation[n * 4], 4);
    }
    return file;
}

void write_ply(const std::filesystem::path& path, const SplatModel& model) {
    write_file_atomic(path, encode_ply(model));
}

}  // namespace darb
