#include "engine/data/point_cloud_ply.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nanoflann.hpp>

#include "engine/core/error.h"
#include "engine/core/files.h"
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
    int position[3], colour[3], dc[3];
    for (int i = 0; i < 3; ++i) {
        position[i] = vertex->find(std::string(1, "xyz"[i]));
        if (position[i] < 0)
            throw Error(where, fmt::format("element vertex lacks the property {}", "xyz"[i]),
                        "A point cloud is needed.");
        constexpr const char* kNames[3][3] = {{"red", "r", "diffuse_red"},
                                              {"green", "g", "diffuse_green"},
                                              {"blue", "b", "diffuse_blue"}};
        colour[i] = std::max(
            {vertex->find(kNames[i][0]), vertex->find(kNames[i][1]), vertex->find(kNames[i][2])});
        dc[i] = vertex->find(fmt::format("f_dc_{}", i));
    }
    const bool uncoloured = colour[0] < 0 && colour[1] < 0 && colour[2] < 0;
    const bool is_scene = uncoloured && dc[0] >= 0 && dc[1] >= 0 && dc[2] >= 0;
    if (notes && is_scene)
        notes->push_back(
            fmt::format("{} is a splat scene: its points have the colours of its f_dc.", where));
    if (notes && uncoloured && !is_scene && vertex->count > 0)
        notes->push_back(fmt::format("{} has no colours: its points are grey.", where));
    // What each value is multiplied by to be in [0, 255]; for floats, set once the largest is
    // known.
    const auto type_of = [&](int i) {
        return vertex->properties[static_cast<std::size_t>(colour[i])].type;
    };
    bool floats = false;
    double factor[3] = {1, 1, 1}, largest = 0;
    for (int i = 0; i < 3; ++i) {
        if (colour[i] < 0) continue;
        floats |= is_float(type_of(i));
        if (type_of(i) == PlyType::uint16) factor[i] = 1.0 / 257;
    }
    std::vector<float> raw;  // [P][3], where some colour is a float
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
            const double value = is_scene        ? 255 * colour_of_dc(values[dc[i]])
                                 : colour[i] < 0 ? kMidGrey
                                                 : values[colour[i]] * factor[i];
            points.colour.push_back(colour_byte(value));
            if (!floats) continue;
            raw.push_back(static_cast<float>(value));
            if (colour[i] >= 0 && is_float(type_of(i)) && std::isfinite(value))
                largest = std::max(largest, value);
        }
    });
    if (floats && largest <= kLargestUnitColour)
        for (std::size_t i = 0; i < raw.size(); ++i)
            if (const int c = static_cast<int>(i % 3); colour[c] >= 0 && is_float(type_of(c)))
                points.colour[i] = colour_byte(255.0 * raw[i]);
    return points;
}

PointCloud read_point_cloud_ply(const std::filesystem::path& path, std::size_t& dropped,
                                std::vector<std::string>* notes) {
    const std::vector<std::byte> file = read_file(path);
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
