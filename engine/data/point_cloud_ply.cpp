// SPDX-License-Identifier: MIT
#include "engine/data/point_cloud_ply.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nanoflann.hpp>

#include "engine/core/error.h"
#include "engine/core/files.h"
#include "engine/data/las_points.h"
#include "engine/scene/edit_splats.h"
#include "engine/scene/ply_table.h"
#include "engine/scene/quantise.h"

namespace darb {

namespace {

constexpr std::uint8_t kMidGrey = 128;
// Float colours are 0 to 1, but 0 to 255 with some writers: any value above this tells.
constexpr double kLargestUnitColour = 1.0 + 1.0 / 255;

bool is_float(PlyType type) {
    return type == PlyType::float32 || type == PlyType::float64;
}

std::uint8_t colour_byte(double value) {
    return static_cast<std::uint8_t>(std::isfinite(value) ? std::clamp(value + 0.5, 0.0, 255.0)
                                                          : kMidGrey);
}

// Which columns of element vertex a cloud takes, and what their values mean.
struct CloudColumns {
    int position[3] = {}, colour[3] = {}, dc[3] = {};  // -1: there is none
    bool is_scene = false;                             // has splats, whose f_dc is the colour
    bool uncoloured = false;
    bool floats[3] = {};           // colours of 0 to 1 or 0 to 255: the largest of all says which
    double factor[3] = {1, 1, 1};  // what else a value is multiplied by, to 0 .. 255
    bool any_floats() const { return floats[0] || floats[1] || floats[2]; }

    /// The colour of a row: 0 to 255, or 0 to 1 where it is stored in such floats.
    double colour_of(const double* values, int channel) const {
        if (is_scene) return 255 * colour_of_dc(values[dc[channel]]);
        return colour[channel] < 0 ? kMidGrey : values[colour[channel]] * factor[channel];
    }
};

CloudColumns find_columns(const PlyElement& vertex, const std::string& where) {
    CloudColumns c;
    for (int i = 0; i < 3; ++i) {
        c.position[i] = vertex.find(std::string(1, "xyz"[i]));
        if (c.position[i] < 0)
            throw Error(where, fmt::format("element vertex lacks the property {}", "xyz"[i]),
                        "A point cloud is needed.");
        constexpr const char* kNames[3][3] = {{"red", "r", "diffuse_red"},
                                              {"green", "g", "diffuse_green"},
                                              {"blue", "b", "diffuse_blue"}};
        c.colour[i] = std::max(
            {vertex.find(kNames[i][0]), vertex.find(kNames[i][1]), vertex.find(kNames[i][2])});
        c.dc[i] = vertex.find(fmt::format("f_dc_{}", i));
        if (c.colour[i] < 0) continue;
        const PlyType type = vertex.properties[static_cast<std::size_t>(c.colour[i])].type;
        c.floats[i] = is_float(type);
        if (type == PlyType::uint16) c.factor[i] = 1.0 / 257;
    }
    c.uncoloured = c.colour[0] < 0 && c.colour[1] < 0 && c.colour[2] < 0;
    c.is_scene = c.uncoloured && c.dc[0] >= 0 && c.dc[1] >= 0 && c.dc[2] >= 0;
    return c;
}

}  // namespace

PointCloud parse_point_cloud_ply(std::span<const std::byte> file, const std::string& where,
                                 std::size_t& dropped) {
    return parse_point_cloud_ply(file, parse_ply_header(file, where), where, dropped);
}

PointCloud parse_point_cloud_ply(std::span<const std::byte> file, const PlyHeader& header,
                                 const std::string& where, std::size_t& dropped,
                                 std::vector<std::string>* notes) {
    const PlyElement* vertex = header.find("vertex");
    if (!vertex) throw Error(where, "has no element vertex", "A point cloud is needed.");
    const CloudColumns columns = find_columns(*vertex, where);
    if (notes && columns.is_scene)
        notes->push_back(
            fmt::format("{} is a splat scene: its points have the colours of its f_dc.", where));
    if (notes && columns.uncoloured && !columns.is_scene && vertex->count > 0)
        notes->push_back(fmt::format("{} has no colours: its points are grey.", where));
    const bool floats = columns.any_floats();
    double largest = 0;
    std::vector<float> raw;  // [P][3], where some colour is a float
    check_ply_size(file, header, *vertex, where);
    PointCloud points;
    points.position.reserve(vertex->count * 3);
    points.colour.reserve(vertex->count * 3);
    dropped = 0;
    read_ply_rows(file, header, *vertex, where, [&](std::size_t, const double* values) {
        const int* const at = columns.position;
        if (!std::isfinite(values[at[0]] + values[at[1]] + values[at[2]])) {
            ++dropped;
            return;
        }
        for (int i = 0; i < 3; ++i) {
            const double value = columns.colour_of(values, i);
            points.position.push_back(values[at[i]]);
            points.colour.push_back(colour_byte(value));
            if (!floats) continue;
            raw.push_back(static_cast<float>(value));
            if (columns.floats[i] && std::isfinite(value)) largest = std::max(largest, value);
        }
    });
    if (floats && largest <= kLargestUnitColour)
        for (std::size_t i = 0; i < raw.size(); ++i)
            if (columns.floats[i % 3]) points.colour[i] = colour_byte(255.0 * raw[i]);
    return points;
}

PointCloud read_point_cloud_ply(const std::filesystem::path& path, std::size_t& dropped,
                                std::vector<std::string>* notes) {
    const std::vector<std::byte> file = read_file(path);
    return parse_point_cloud_ply(file, parse_ply_header(file, path.string()), path.string(),
                                 dropped, notes);
}

PointCloud read_point_cloud(const std::filesystem::path& path, std::size_t& dropped,
                            std::vector<std::string>* notes) {
    const std::vector<std::byte> file = read_file(path);
    if (looks_like_las(file)) return parse_las(file, path.string(), dropped, notes);
    return parse_point_cloud_ply(file, parse_ply_header(file, path.string()), path.string(),
                                 dropped, notes);
}

namespace {

constexpr double kMinDistance2 = 1e-7;
constexpr double kPointOpacity = 0.95;
constexpr double kSizeShare = 1.0 / 3;  // share of the distance to the neighbours
constexpr double kLargestOfMedian = 4;

struct CloudView {
    const std::vector<double>& position;
    size_t kdtree_get_point_count() const { return position.size() / 3; }
    double kdtree_get_pt(size_t i, size_t axis) const { return position[3 * i + axis]; }
    template <class Box>
    bool kdtree_get_bbox(Box&) const {
        return false;
    }
};

using Tree = nanoflann::KDTreeSingleIndexAdaptor<nanoflann::L2_Simple_Adaptor<double, CloudView>,
                                                 CloudView, 3>;

}  // namespace

std::vector<double> neighbour_distance2(const std::vector<double>& position) {
    const CloudView view{position};
    const size_t count = view.kdtree_get_point_count();
    std::vector<double> result(count, kMinDistance2);
    if (count < 2) return result;
    Tree tree(3, view, nanoflann::KDTreeSingleIndexAdaptorParams(10));
    tree.buildIndex();
    const size_t wanted = std::min<size_t>(4, count);  // the point itself comes first
    for (size_t i = 0; i < count; ++i) {
        std::uint32_t index[4];
        double distance2[4];
        const size_t found = tree.knnSearch(&position[3 * i], wanted, index, distance2);
        double sum = 0.0;
        for (size_t k = 1; k < found; ++k) sum += distance2[k];
        result[i] = std::max(kMinDistance2, sum / static_cast<double>(found - 1));
    }
    return result;
}

SplatModel points_as_splats(const PointCloud& points) {
    SplatModel model;
    model.resize(points.size());
    set_positions(points.position, model);
    const std::vector<double> distance2 = neighbour_distance2(points.position);
    std::vector<double> sorted = distance2;
    const auto middle = sorted.begin() + static_cast<std::ptrdiff_t>(sorted.size() / 2);
    std::nth_element(sorted.begin(), middle, sorted.end());
    for (size_t i = 0; i < model.size(); ++i) {
        const double distance =
            std::min(std::sqrt(distance2[i]), kLargestOfMedian * std::sqrt(*middle));
        for (size_t k = 0; k < 3; ++k) {
            model.log_scale[3 * i + k] = static_cast<float>(std::log(kSizeShare * distance));
            model.sh_dc[3 * i + k] =
                static_cast<float>(dc_of_colour(points.colour[3 * i + k] / 255.0));
        }
        model.rotation[4 * i] = 1;
        model.opacity_logit[i] = static_cast<float>(std::log(kPointOpacity / (1 - kPointOpacity)));
    }
    return model;
}

}  // namespace darb
