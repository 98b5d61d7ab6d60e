#include "engine/data/point_cloud_ply.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "engine/core/error.h"
#include "engine/core/files.h"
#include "engine/scene/ply_table.h"

namespace darb {

namespace {

constexpr std::uint8_t kMidGrey = 128;

std::uint8_t colour_byte(double value, PlyType type) {
    if (type == PlyType::float32 || type == PlyType::float64) value *= 255;
    if (type == PlyType::uint16) value /= 257;
    return static_cast<std::uint8_t>(std::isfinite(value) ? std::clamp(value + 0.5, 0.0, 255.0)
                                                          : kMidGrey);
}

}  // namespace

PointCloud parse_point_cloud_ply(std::span<const std::byte> file, const std::string& where,
                                 std::size_t& dropped) {
    const PlyHeader header = parse_ply_header(file, where);
    const PlyElement* vertex = header.find("vertex");
    if (!vertex) throw Error(where, "has no element vertex", "A point cloud is needed.");
    int position[3], colour[3];
    for (int i = 0; i < 3; ++i) {
        position[i] = vertex->find(std::string(1, "xyz"[i]));
        if (position[i] < 0)
            throw Error(where, fmt::format("element vertex lacks the property {}", "xyz"[i]),
                        "A point cloud is needed.");
        constexpr const char* kNames[3][2] = {{"red", "r"}, {"green", "g"}, {"blue", "b"}};
        colour[i] = std::max(vertex->find(kNames[i][0]), vertex->find(kNames[i][1]));
    }
    check_ply_size(file, header, *vertex, where);
    PointCloud points;
    points.position.reserve(vertex->count * 3);
    points.colour.reserve(vertex->count * 3);
    dropped = 0;
    read_ply_rows(file, header, *vertex, where, [&](std::size_t, const double* values) {
        if (!std::isfinite(values[position[0]] + values[position[1]] + values[position[2]])) {
            ++dropped;
            return;
        }
        for (int i = 0; i < 3; ++i) {
            points.position.push_back(values[position[i]]);
            points.colour.push_back(
                colour[i] < 0
                    ? kMidGrey
                    : colour_byte(values[colour[i]],
                                  vertex->properties[static_cast<std::size_t>(colour[i])].type));
        }
    });
    return points;
}

PointCloud read_point_cloud_ply(const std::filesystem::path& path, std::size_t& dropped) {
    return parse_point_cloud_ply(read_file(path), path.string(), dropped);
}

}  // namespace darb
