// SPDX-License-Identifier: MIT
// PointTree: nearest neighbours among points in double, by nanoflann.
#pragma once

#include <cstddef>
#include <cstdint>
#include <glm/glm.hpp>
#include <nanoflann.hpp>
#include <utility>
#include <vector>

namespace darb {

/// The points as nanoflann reads them. They must outlive it, and a tree over it.
struct PointsView {
    const std::vector<glm::dvec3>& points;
    std::size_t kdtree_get_point_count() const { return points.size(); }
    double kdtree_get_pt(std::size_t i, std::size_t axis) const {
        return points[i][static_cast<int>(axis)];
    }
    template <class Box>
    bool kdtree_get_bbox(Box&) const {
        return false;
    }
};

using PointTree =
    nanoflann::KDTreeSingleIndexAdaptor<nanoflann::L2_Simple_Adaptor<double, PointsView>,
                                        PointsView, 3>;

/// Calls visit(index) for each point within this squared distance of a place, in no order.
template <class Visit>
void for_each_within(const PointTree& tree, const glm::dvec3& place, double distance2,
                     const Visit& visit) {
#if NANOFLANN_VERSION >= 0x150
    std::vector<nanoflann::ResultItem<std::uint32_t, double>> found;
    tree.radiusSearch(&place[0], distance2, found, nanoflann::SearchParameters(0, false));
#else
    std::vector<std::pair<std::uint32_t, double>> found;
    tree.radiusSearch(&place[0], distance2, found, nanoflann::SearchParams(32, 0, false));
#endif
    for (const auto& item : found) visit(item.first);
}

}  // namespace darb
