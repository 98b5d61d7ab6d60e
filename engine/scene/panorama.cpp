// SPDX-License-Identifier: MIT
#include "engine/scene/panorama.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numbers>

#include "engine/core/error.h"
#include "engine/core/on_threads.h"

namespace darb {

namespace {

glm::dmat3 from_rows(const glm::dvec3& x, const glm::dvec3& y, const glm::dvec3& z) {
    return glm::transpose(glm::dmat3(x, y, z));
}

/// Two neighbours along an axis, and the share of the second.
struct Neighbours {
    std::size_t first = 0, second = 0;
    double share = 0;
};

Neighbours clamped(double at, int size) {
    const double x = std::clamp(at - 0.5, 0.0, size - 1.0);
    const auto first = static_cast<std::size_t>(x);
    return {first, std::min(first + 1, static_cast<std::size_t>(size) - 1),
            x - static_cast<double>(first)};
}

Neighbours wrapped(double at, int size) {
    double x = std::fmod(at - 0.5, size);
    if (x < 0) x += size;
    const auto first = std::min(static_cast<std::size_t>(x), static_cast<std::size_t>(size) - 1);
    return {first, (first + 1) % static_cast<std::size_t>(size), x - static_cast<double>(first)};
}

/// The face that sees a direction.
int face_of(const glm::dvec3& direction) {
    int best = 0;
    double most = -2;
    for (int f = 0; f < kCubeFaces; ++f) {
        const glm::dmat3& r = cube_faces()[static_cast<std::size_t>(f)].rotation;
        const double along = r[0][2] * direction.x + r[1][2] * direction.y + r[2][2] * direction.z;
        if (along > most) {
            most = along;
            best = f;
        }
    }
    return best;
}

}  // namespace

const std::array<CubeFace, kCubeFaces>& cube_faces() {
    const glm::dvec3 x(1, 0, 0), y(0, 1, 0), z(0, 0, 1);
    static const std::array<CubeFace, kCubeFaces> faces{{{"back", from_rows(-x, y, -z)},
                                                         {"down", from_rows(x, -z, y)},
                                                         {"front", from_rows(x, y, z)},
                                                         {"left", from_rows(z, y, -x)},
                                                         {"right", from_rows(-z, y, x)},
                                                         {"up", from_rows(x, z, -y)}}};
    return faces;
}

int face_size(int panorama_width) {
    return std::max(1, static_cast<int>(std::lround(panorama_width / std::numbers::pi)));
}

glm::dvec2 panorama_pixel(const glm::dvec3& direction, int width, int height) {
    const double longitude = std::atan2(direction.x, direction.z);
    const double latitude = std::atan2(direction.y, std::hypot(direction.x, direction.z));
    return {width * (0.5 + longitude / (2 * std::numbers::pi)),
            height * (0.5 + latitude / std::numbers::pi)};
}

glm::dvec3 panorama_direction(const glm::dvec2& pixel, int width, int height) {
    const double longitude = 2 * std::numbers::pi * (pixel.x / width - 0.5);
    const double latitude = std::numbers::pi * (pixel.y / height - 0.5);
    return {std::cos(latitude) * std::sin(longitude), std::sin(latitude),
            std::cos(latitude) * std::cos(longitude)};
}

Camera face_camera(const Camera& camera, const CubeFace& face, int size, int margin) {
    Camera of_face;
    of_face.width = of_face.height = size + 2 * margin;
    of_face.fx = of_face.fy = 0.5 * size;
    of_face.cx = of_face.cy = 0.5 * size + margin;
    of_face.rotation = face.rotation * camera.rotation;
    of_face.translation = face.rotation * camera.translation;
    return of_face;
}

ImageU8 cut_face(const ImageU8& rgba, const CubeFace& face, int size) {
    if (rgba.channels != 4 || rgba.width < 1 || rgba.height < 1 || size < 1)
        throw Error("panorama",
                    fmt::format("a picture of {}x{}x{} has no face of {} px", rgba.width,
                                rgba.height, rgba.channels, size),
                    "Give RGBA and a positive size.");
    ImageU8 out(size, size, 4);
    const glm::dmat3 back = glm::transpose(face.rotation);
    const auto stride = static_cast<std::size_t>(rgba.width);
    for (int y = 0; y < size; ++y)
        for (int x = 0; x < size; ++x) {
            const glm::dvec3 ray(2 * (x + 0.5) / size - 1, 2 * (y + 0.5) / size - 1, 1);
            const glm::dvec2 at = panorama_pixel(back * ray, rgba.width, rgba.height);
            const Neighbours u = wrapped(at.x, rgba.width), v = clamped(at.y, rgba.height);
            const std::size_t corners[4] = {v.first * stride + u.first, v.first * stride + u.second,
                                            v.second * stride + u.first,
                                            v.second * stride + u.second};
            const double weights[4] = {(1 - u.share) * (1 - v.share), u.share * (1 - v.share),
                                       (1 - u.share) * v.share, u.share * v.share};
            double sum[4] = {};  // colour by alpha, alpha
            for (int i = 0; i < 4; ++i) {
                const std::uint8_t* from = &rgba.data[4 * corners[i]];
                const double alpha = weights[i] * from[3];
                for (int c = 0; c < 3; ++c) sum[c] += alpha * from[c];
                sum[3] += alpha;
            }
            if (!(sum[3] > 0)) continue;
            std::uint8_t* to =
                &out.data[4 * (static_cast<std::size_t>(y) * static_cast<std::size_t>(size) +
                               static_cast<std::size_t>(x))];
            for (int c = 0; c < 3; ++c)
                to[c] = static_cast<std::uint8_t>(std::min(sum[c] / sum[3] + 0.5, 255.0));
            to[3] = static_cast<std::uint8_t>(std::min(sum[3] + 0.5, 255.0));
        }
    return out;
}

ImageF join_faces(std::span<const ImageF, kCubeFaces> faces, int width, int height) {
    const int side = faces[0].width, size = side - 2 * kJoinMargin, channels = faces[0].channels;
    for (const ImageF& face : faces)
        if (face.width != side || face.height != side || face.channels != channels || size < 1 ||
            width < 1 || height < 1)
            throw Error(
                "panorama",
                fmt::format("a face of {}x{}x{} beside one of {}x{}x{}, for {}x{} px", face.width,
                            face.height, face.channels, side, side, channels, width, height),
                "Render all faces as face_camera says, with kJoinMargin.");
    ImageF out(width, height, channels);
    const auto values = static_cast<std::size_t>(channels);
    const auto add = [&](const glm::dvec2& pixel, float* to) {
        const glm::dvec3 direction = panorama_direction(pixel, width, height);
        const auto f = static_cast<std::size_t>(face_of(direction));
        const glm::dvec3 p = cube_faces()[f].rotation * direction;
        const Neighbours u = clamped(0.5 * size * (p.x / p.z + 1) + kJoinMargin, side);
        const Neighbours v = clamped(0.5 * size * (p.y / p.z + 1) + kJoinMargin, side);
        const auto value = [&](std::size_t x, std::size_t y, std::size_t c) {
            return faces[f].data[(y * static_cast<std::size_t>(side) + x) * values + c];
        };
        for (std::size_t c = 0; c < values; ++c)
            to[c] += static_cast<float>(
                0.25 *
                std::lerp(std::lerp(value(u.first, v.first, c), value(u.second, v.first, c),
                                    static_cast<float>(u.share)),
                          std::lerp(value(u.first, v.second, c), value(u.second, v.second, c),
                                    static_cast<float>(u.share)),
                          static_cast<float>(v.share)));
    };
    in_pieces(static_cast<std::size_t>(height), 16, [&](std::size_t first, std::size_t count) {
        for (std::size_t y = first; y < first + count; ++y)
            for (int x = 0; x < width; ++x)
                for (int s = 0; s < 4; ++s)
                    add({x + 0.25 + 0.5 * (s % 2), double(y) + 0.25 + 0.5 * double(s / 2)},
                        &out.data[(y * static_cast<std::size_t>(width) +
                                   static_cast<std::size_t>(x)) *
                                  values]);
    });
    return out;
}

}  // namespace darb
