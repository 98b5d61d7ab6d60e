// SPDX-License-Identifier: MIT
// Stereo on photos of a scene whose depth is known: a ball before two walls, all textured.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "engine/reference/reference_stereo.h"
#include "engine/stereo/surface_points.h"
#include "tests/support/shared_device.h"

namespace darb::test {
namespace {

constexpr int kWidth = 72, kHeight = 56;  // px
const glm::dvec3 kBall(0.2, -0.1, 3.2);
constexpr double kRadius = 0.7;

struct Hit {
    double distance;  // along the ray, whose length is not 1
    glm::dvec3 point, normal;
};

Hit hit_of(const glm::dvec3& from, const glm::dvec3& along) {
    const glm::dvec3 slanted = glm::normalize(glm::dvec3(0.5, 0.1, -1));
    double nearest = (5 - from.z) / along.z;
    glm::dvec3 normal(0, 0, -1);
    const double wall = glm::dot(slanted, glm::dvec3(0, 0, 4.5) - from) / glm::dot(slanted, along);
    if (wall > 0 && wall < nearest) {
        nearest = wall;
        normal = slanted;
    }
    const double a = glm::dot(along, along), b = glm::dot(along, from - kBall),
                 c = glm::dot(from - kBall, from - kBall) - kRadius * kRadius;
    if (b * b > a * c) {
        const double ball = (-b - std::sqrt(b * b - a * c)) / a;
        if (ball > 0 && ball < nearest) {
            nearest = ball;
            normal = glm::normalize(from + ball * along - kBall);
        }
    }
    return {nearest, from + nearest * along, normal};
}

double texture(const glm::dvec3& p) {
    double sum = 0;
    for (int k = 1; k <= 4; ++k)
        sum += std::sin(5.1 * k * p.x + 2.3 * k * k) * std::sin(4.3 * k * p.y + 3.1 * p.z * k + k);
    return 0.5 + 0.12 * sum;
}

Camera camera_at(double x, double y) {
    Camera c;
    c.width = kWidth;
    c.height = kHeight;
    c.fx = 70;
    c.fy = 71;
    c.cx = 36.5;
    c.cy = 27.5;
    const double turn = -0.15 * x;
    c.rotation =
        glm::dmat3(std::cos(turn), 0, -std::sin(turn), 0, 1, 0, std::sin(turn), 0, std::cos(turn));
    c.translation = -(c.rotation * glm::dvec3(x, y, 0));
    return c;
}

Hit hit_at(const Camera& c, double x, double y) {
    const glm::dvec3 inside((x - c.cx) / c.fx, (y - c.cy) / c.fy, 1);
    return hit_of(c.centre(), glm::transpose(c.rotation) * inside);
}

struct Scene {
    Dataset dataset;
    std::vector<ImageU8> photos;
};

// The depth along the axis is the hit's distance: the ray's third coordinate in the camera is 1.
Scene scene_with_depths() {
    Scene scene;
    for (const auto& [x, y] :
         {std::pair{0.0, 0.0}, {-0.7, 0.1}, {0.7, 0.0}, {0.1, -0.6}, {0.0, 0.6}}) {
        View view;
        view.name = "photo " + std::to_string(scene.photos.size());
        view.camera = camera_at(x, y);
        ImageU8 photo(kWidth, kHeight, 4);
        for (int j = 0; j < kHeight; ++j)
            for (int i = 0; i < kWidth; ++i) {
                const double grey = texture(hit_at(view.camera, i + 0.5, j + 0.5).point);
                const auto byte =
                    static_cast<std::uint8_t>(std::lround(255 * std::clamp(grey, 0.01, 1.0)));
                for (int c = 0; c < 3; ++c) photo.at(i, j, c) = byte;
                photo.at(i, j, 3) = 255;
            }
        for (int k = 0; k < 30; ++k) {
            const Hit hit = hit_at(view.camera, 2 + 2.2 * k, 3 + 1.6 * k);
            for (int a = 0; a < 3; ++a) scene.dataset.points.position.push_back(hit.point[a]);
            for (int a = 0; a < 3; ++a) scene.dataset.points.colour.push_back(128);
        }
        scene.dataset.views.push_back(view);
        scene.photos.push_back(std::move(photo));
    }
    return scene;
}

std::vector<StereoPhoto> photos_of(const Scene& scene) {
    return stereo_photos(scene.dataset, scene.photos, {});
}

struct Found {
    std::vector<StereoPhoto> photos = photos_of(scene_with_depths());
    std::vector<PlaneMap> maps = plane_maps(shared_device(), photos, 0);
    SurfacePoints surface = surface_points(photos, maps, FusionOptions{});
};

const Found& found_once() {
    static const Found found;
    return found;
}

TEST(Stereo, cost_is_that_of_the_double_reference) {
    const auto& [photos, maps, surface] = found_once();
    int compared = 0, apart = 0;
    for (std::size_t r = 0; r < photos.size(); ++r) {
        const StereoPhoto& from = photos[r];
        ASSERT_EQ(from.sources.size(), 4u);
        for (int y = 0; y < kHeight; y += 3)
            for (int x = 0; x < kWidth; x += 2) {
                const float* plane = &maps[r].data[maps[r].index(x, y, 0)];
                std::vector<double> costs;
                for (const std::uint32_t s : from.sources)
                    costs.push_back(reference::stereo_cost({from.camera, from.grey},
                                                           {photos[s].camera, photos[s].grey}, x, y,
                                                           plane[0], plane[1], plane[2]));
                std::sort(costs.begin(), costs.end());
                ++compared;
                // A variance of 4e-5 of squares of 0.25 keeps three digits; at the edge of a source
                // a sample may count on one side only.
                apart += std::abs(0.5 * (costs[0] + costs[1]) - plane[3]) > 2e-3 ? 1 : 0;
            }
    }
    EXPECT_GT(compared, 3000);
    EXPECT_LE(apart, compared / 200);
}

TEST(Stereo, most_pixels_are_within_a_hundredth_of_the_true_depth) {
    const auto& [photos, maps, surface] = found_once();
    int near_truth = 0, all = 0, agreeing = 0, wrong = 0;
    for (std::size_t r = 0; r < photos.size(); ++r)
        for (int y = 0; y < kHeight; ++y)
            for (int x = 0; x < kWidth; ++x) {
                const double truth = hit_at(photos[r].camera, x + 0.5, y + 0.5).distance;
                const bool is_near = std::abs(maps[r].at(x, y, 0) * truth - 1) < 0.01;
                ++all;
                near_truth += is_near ? 1 : 0;
                if (surface.consistent[r].at(x, y, 0) == 0) continue;
                ++agreeing;
                wrong += is_near ? 0 : 1;
            }
    RecordProperty("near_truth_percent", 100 * near_truth / all);
    RecordProperty("agreeing_percent", 100 * agreeing / all);
    RecordProperty("wrong_per_mille", 1000 * wrong / std::max(agreeing, 1));
    EXPECT_GT(near_truth, 0.65 * all);
    EXPECT_GT(agreeing, 0.6 * all);
    EXPECT_LT(wrong, 0.04 * agreeing);
}

TEST(Stereo, points_lie_on_the_surface_with_its_normal_at_their_spacing) {
    const PointCloud& cloud = found_once().surface.points;
    ASSERT_GT(cloud.size(), 300u);
    ASSERT_EQ(cloud.normal.size(), 3 * cloud.size());
    ASSERT_EQ(cloud.spacing.size(), cloud.size());
    std::size_t off = 0, turned = 0;
    for (std::size_t p = 0; p < cloud.size(); ++p) {
        const glm::dvec3 at(cloud.position[3 * p], cloud.position[3 * p + 1],
                            cloud.position[3 * p + 2]);
        const glm::dvec3 normal(cloud.normal[3 * p], cloud.normal[3 * p + 1],
                                cloud.normal[3 * p + 2]);
        const Camera c = camera_at(0, 0);
        const glm::dvec3 seen = c.rotation * at + c.translation;
        const Hit hit = hit_at(c, c.fx * seen.x / seen.z + c.cx, c.fy * seen.y / seen.z + c.cy);
        EXPECT_NEAR(cloud.spacing[p], 2.5 * seen.z / c.fx, 0.3 * cloud.spacing[p]);
        if (std::abs(hit.distance / seen.z - 1) > 0.02) {  // hidden from here, or wrong
            ++off;
            continue;
        }
        turned += glm::dot(normal, hit.normal) < 0.9 ? 1 : 0;
    }
    EXPECT_LT(off, cloud.size() / 10);
    EXPECT_LT(turned, cloud.size() / 5);
}

TEST(Stereo, repeats_bit_by_bit) {
    const std::vector<PlaneMap> again = plane_maps(shared_device(), found_once().photos, 0);
    for (std::size_t r = 0; r < again.size(); ++r)
        EXPECT_EQ(again[r].data, found_once().maps[r].data) << r;
}

TEST(Stereo, transparent_pixels_and_photos_that_share_nothing_have_no_depth) {
    Scene scene = scene_with_depths();
    for (int i = 0; i < 20; ++i)
        for (int j = 0; j < kHeight; ++j) scene.photos[0].at(i, j, 3) = 0;
    Camera& away = scene.dataset.views[4].camera;  // turned around
    away.rotation = glm::dmat3(-1, 0, 0, 0, 1, 0, 0, 0, -1) * away.rotation;
    away.translation = glm::dmat3(-1, 0, 0, 0, 1, 0, 0, 0, -1) * away.translation;
    scene.dataset.views[3].is_test = true;
    const std::vector<StereoPhoto> photos = photos_of(scene);
    const std::vector<PlaneMap> maps = plane_maps(shared_device(), photos, 0);
    for (std::size_t r = 0; r < photos.size(); ++r) {
        EXPECT_NE(photos[r].view, 3u) << "held out";
        EXPECT_TRUE(photos[r].view != 4 || photos[r].sources.empty());
        for (std::size_t i = 0; i < maps[r].data.size(); i += 4) {
            const bool clear = photos[r].view == 0 && i / 4 % kWidth < 20;
            if (!clear && photos[r].view != 4) continue;
            ASSERT_EQ(maps[r].data[i + 3], float(STEREO_NO_COST)) << "view " << photos[r].view;
        }
    }
}

}  // namespace
}  // namespace darb::test
