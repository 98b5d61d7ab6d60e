#include "engine/scene/ply.h"

#include <fmt/format.h>

#include <cmath>
#include <cstring>

#include "engine/core/check.h"
#include "engine/core/error.h"
#include "engine/core/files.h"
#include "engine/scene/compressed_ply.h"
#include "engine/scene/edit_splats.h"
#include "engine/scene/infinite_values.h"
#include "engine/scene/ply_comments.h"
#include "engine/scene/ply_dialects.h"
#include "engine/scene/ply_table.h"
#include "engine/scene/splat_shapes.h"

namespace darb {

namespace {

bool all_finite(const double* values, const PlyColumns& columns) {
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

void store_splat(const double* values, const PlyColumns& columns, std::size_t at,
                 SplatModel& model) {
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
    const PlyColumns columns = find_ply_columns(*vertex, where);
    check_ply_size(file, header, *vertex, where);

    SplatModel model;
    PlyFacts said;
    model.sh_degree = static_cast<int>(std::lround(std::sqrt(columns.rest.size() / 3 + 1))) - 1;
    read_ply_comments(header, where, model, said.notes);
    model.resize(vertex->count);
    std::vector<double> positions, translated;
    positions.reserve(vertex->count * 3);
    std::size_t kept = 0;
    bool has_normals = false;
    const PlyRow row = [&](std::size_t, const double* read) {
        const double* values = translate_row(columns, read, translated);
        for (const int column : columns.normal) has_normals |= values[column] != 0;
        if (!all_finite(values, columns)) return;
        for (const int column : columns.position) positions.push_back(values[column]);
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
