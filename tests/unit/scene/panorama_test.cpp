// SPDX-License-Identifier: MIT
#include "engine/scene/panorama.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

namespace darb {
namespace {

/// A colour that changes smoothly over the sphere, 0 to 1.
glm::dvec3 colour_at(const glm::dvec3& direction) {
    const glm::dvec3 d = glm::normalize(direction);
    return {0.5 + 0.4 * d.x, 0.5 + 0.4 * d.y * d.z, 0.5 + 0.4 * std::sin(2 * d.z + d.x)};
}

ImageU8 painted_panorama(int width) {
    ImageU8 panorama(width, width / 2, 4);
    for (int y = 0; y < panorama.height; ++y)
        for (int x = 0; x < width; ++x) {
            const glm::dvec3 colour =
                colour_at(panorama_direction({x + 0.5, y + 0.5}, width, panorama.height));
            for (int c = 0; c < 3; ++c)
                panorama.at(x, y, c) = static_cast<std::uint8_t>(std::lround(255 * colour[c]));
            panorama.at(x, y, 3) = 255;
        }
    return panorama;
}

TEST(Panorama, directions_are_where_colmap_and_nerfstudio_have_them) {
    struct {
        glm::dvec3 direction;
        glm::dvec2 pixel;
    } const known[] = {{{0, 0, 1}, {100, 50}}, {{1, 0, 0}, {150, 50}},  {{-1, 0, 0}, {50, 50}},
                       {{0, -2, 0}, {100, 0}}, {{0, 1, 0}, {100, 100}}, {{1, 0, 1}, {125, 50}},
                       {{0, 1, 1}, {100, 75}}};
    for (const auto& k : known)
        EXPECT_NEAR(glm::distance(panorama_pixel(k.direction, 200, 100), k.pixel), 0, 1e-9);
    for (double x : {0.1, 37.0, 99.9, 180.0})
        for (double y : {0.2, 50.0, 99.5}) {
            const glm::dvec3 direction = panorama_direction({x, y}, 200, 100);
            EXPECT_NEAR(glm::length(direction), 1, 1e-12);
            EXPECT_NEAR(glm::distance(panorama_pixel(direction, 200, 100), {x, y}), 0, 1e-9);
        }
}

TEST(Panorama, faces_are_rotations_that_look_in_six_directions) {
    const glm::dvec3 ahead[] = {{0, 0, -1}, {0, 1, 0}, {0, 0, 1},
                                {-1, 0, 0}, {1, 0, 0}, {0, -1, 0}};
    for (std::size_t f = 0; f < cube_faces().size(); ++f) {
        const CubeFace& face = cube_faces()[f];
        EXPECT_NEAR(glm::determinant(face.rotation), 1, 1e-12) << face.name;
        EXPECT_NEAR(glm::distance(face.rotation * ahead[f], {0, 0, 1}), 0, 1e-12) << face.name;
        if (f > 0) {
            EXPECT_LT(cube_faces()[f - 1].name, face.name);
        }
    }
    // The horizon stays upright; the picture of what is below has what is behind at its bottom.
    EXPECT_NEAR(glm::distance(cube_faces()[4].rotation * glm::dvec3(0, 1, 0), {0, 1, 0}), 0, 1e-12);
    EXPECT_NEAR(glm::distance(cube_faces()[1].rotation * glm::dvec3(0, 0, -1), {0, 1, 0}), 0,
                1e-12);
}

TEST(Panorama, a_face_shows_what_a_pinhole_of_its_pose_sees) {
    const ImageU8 panorama = painted_panorama(512);
    Camera pose;
    pose.rotation = glm::dmat3(0, 1, 0, -1, 0, 0, 0, 0, 1);
    pose.translation = {1, 2, 3};
    for (const CubeFace& face : cube_faces()) {
        const int size = face_size(panorama.width);
        const ImageU8 picture = cut_face(panorama, face, size);
        const Camera camera = face_camera(pose, face, size);
        EXPECT_NEAR(glm::distance(camera.centre(), pose.centre()), 0, 1e-12);
        for (int y = 0; y < size; y += 7)
            for (int x = 0; x < size; x += 7) {
                const glm::dvec3 ray((x + 0.5 - camera.cx) / camera.fx,
                                     (y + 0.5 - camera.cy) / camera.fy, 1);
                const glm::dvec3 in_panorama =
                    pose.rotation * (glm::transpose(camera.rotation) * ray);
                const glm::dvec3 colour = colour_at(in_panorama);
                for (int c = 0; c < 3; ++c)
                    EXPECT_NEAR(picture.at(x, y, c), 255 * colour[c], 1.6) << face.name;
                EXPECT_EQ(picture.at(x, y, 3), 255);
            }
    }
}

TEST(Panorama, the_two_borders_are_neighbours) {
    ImageU8 panorama(64, 32, 4);
    std::fill(panorama.data.begin(), panorama.data.end(), std::uint8_t{255});
    for (int y = 0; y < 32; ++y) {
        panorama.at(0, y, 0) = 200;
        panorama.at(63, y, 0) = 100;
    }
    EXPECT_EQ(cut_face(panorama, cube_faces()[0], 21).at(10, 10, 0), 150) << "straight behind";
}

TEST(Panorama, transparent_pixels_lend_no_colour) {
    ImageU8 panorama = painted_panorama(64);
    for (int y = 0; y < 32; ++y)
        for (int x = 0; x < 32; ++x) {
            for (int c = 0; c < 3; ++c) panorama.at(x, y, c) = 0;
            panorama.at(x, y, 3) = 0;
        }
    const ImageU8 front = cut_face(panorama, cube_faces()[2], 40);
    EXPECT_EQ(front.at(2, 20, 3), 0) << "left of the middle";
    EXPECT_EQ(front.at(38, 20, 3), 255);
    for (int x = 0; x < 40; ++x)
        if (front.at(x, 20, 3) > 0) {
            EXPECT_GT(front.at(x, 20, 0), 100) << x;
        }
}

TEST(Panorama, faces_join_without_a_seam) {
    const int width = 400;
    std::array<ImageF, kCubeFaces> faces;
    for (std::size_t f = 0; f < faces.size(); ++f) {
        const Camera camera = face_camera({}, cube_faces()[f], face_size(width), kJoinMargin);
        faces[f] = ImageF(camera.width, camera.height, 3);
        for (int y = 0; y < camera.height; ++y)
            for (int x = 0; x < camera.width; ++x) {
                const glm::dvec3 ray((x + 0.5 - camera.cx) / camera.fx,
                                     (y + 0.5 - camera.cy) / camera.fy, 1);
                const glm::dvec3 colour = colour_at(glm::transpose(camera.rotation) * ray);
                for (int c = 0; c < 3; ++c) faces[f].at(x, y, c) = static_cast<float>(colour[c]);
            }
    }
    const ImageF joined = join_faces(faces, width, width / 2);
    double worst = 0;
    for (int y = 0; y < joined.height; ++y)
        for (int x = 0; x < joined.width; ++x) {
            const glm::dvec3 colour =
                colour_at(panorama_direction({x + 0.5, y + 0.5}, width, width / 2));
            for (int c = 0; c < 3; ++c)
                worst = std::max(worst, std::abs(joined.at(x, y, c) - colour[c]));
        }
    EXPECT_LT(worst, 2e-4) << "without the margin it is 7e-4";
}

TEST(Panorama, wrong_pictures_are_refused) {
    EXPECT_THROW(cut_face(ImageU8(8, 4, 3), cube_faces()[0], 4), Error);
    EXPECT_THROW(cut_face(ImageU8(8, 4, 4), cube_faces()[0], 0), Error);
    std::array<ImageF, kCubeFaces> faces;
    faces.fill(ImageF(6, 6, 3));
    EXPECT_NO_THROW(join_faces(faces, 8, 4));
    faces[3] = ImageF(5, 6, 3);
    EXPECT_THROW(join_faces(faces, 8, 4), Error);
}

}  // namespace
}  // namespace darb
