#include "engine/data/point_splats.h"

#include <algorithm>
#include <cmath>
#include <nanoflann.hpp>

#include "engine/scene/edit_splats.h"
#include "engine/scene/quantise.h"

namespace darb {

namespace {

constexpr double kMinDistance2 = 1e-7;
constexpr double kPointOpacity = 0.95;
constexpr double kSizeShare = 1.0 / 3;  // of the distance to the neighbours
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
