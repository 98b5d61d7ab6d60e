// SPDX-License-Identifier: MIT
#include "engine/raster/frame_view.h"

#include <fmt/format.h>
#include <cmath>

#include "engine/core/error.h"
#include "shaders/shared/lens.h"

namespace darb {

namespace {

std::uint32_t tiles_along(std::uint32_t pixels) {
    return (pixels + TILE_SIZE - 1) / TILE_SIZE;
}

}  // namespace

std::uint32_t image_tiles(int width, int height) {
    return tiles_along(static_cast<std::uint32_t>(width)) *
           tiles_along(static_cast<std::uint32_t>(height));
}

gpu::CameraData camera_data(const Camera& camera, const glm::dvec3& origin, float near_plane) {
    gpu::CameraData d{};
    const glm::dmat3 rows = glm::transpose(camera.rotation);  // glm columns of the transpose = rows
    d.row0 = glm::vec3(rows[0]);
    d.row1 = glm::vec3(rows[1]);
    d.row2 = glm::vec3(rows[2]);
    const glm::dvec3 centre = camera.centre() - origin;
    d.centre = glm::vec3(centre);
    d.centre_rest = glm::vec3(centre - glm::dvec3(d.centre));
    d.focal = glm::vec2(camera.fx, camera.fy);
    d.principal = glm::vec2(camera.cx, camera.cy);
    glm::dvec2 low(-camera.cx / camera.fx, -camera.cy / camera.fy);
    glm::dvec2 high((camera.width - camera.cx) / camera.fx,
                    (camera.height - camera.cy) / camera.fy);
    glm::dvec2 margin =
        JACOBIAN_MARGIN * 0.5 * glm::dvec2(camera.width / camera.fx, camera.height / camera.fy);
    d.lens_fold = static_cast<float>(LENS_FOLD_NONE);
    if (const LensTerms& lens = camera.lens; lens.active) {
        low = lens.ray_min;
        high = lens.ray_max;
        margin = JACOBIAN_MARGIN * 0.5 * (high - low);
        d.lens_radial = glm::vec4(lens.k[0], lens.k[1], lens.k[2], lens.k[3]);
        d.lens_rational = glm::vec3(lens.d[0], lens.d[1], lens.d[2]);
        d.lens_tangential = glm::vec2(lens.tangential);
        d.lens_prism = glm::vec2(lens.prism);
        d.lens_front = glm::vec2(lens.front_tan, lens.front_scale);
        d.lens_fold = static_cast<float>(lens.fold);
        d.lens_radial_high = glm::vec2(lens.k[4], lens.k[5]);
        d.lens_prism_high = glm::vec2(lens.prism_high);
        d.lens_after = lens.after ? 1 : 0;
    }
    d.ratio_min = glm::vec2(low - margin);
    d.ratio_max = glm::vec2(high + margin);
    d.shutter_turn = glm::vec3(camera.shutter.turn);
    d.shutter_move = glm::vec3(camera.shutter.move);
    d.width = static_cast<std::uint32_t>(camera.width);
    d.height = static_cast<std::uint32_t>(camera.height);
    d.tiles_x = tiles_along(d.width);
    d.tiles_y = tiles_along(d.height);
    d.near_plane = near_plane;
    return d;
}

Buffer upload_cameras(Device& device, const std::vector<gpu::CameraData>& cameras) {
    Buffer buffer(device, "cameras", cameras.size() * sizeof(gpu::CameraData));
    if (!cameras.empty()) buffer.upload(cameras);
    return buffer;
}

std::uint64_t max_frame_pixels(const Device& device, std::uint64_t planes) {
    return device.info().max_storage_buffer_bytes / (planes * sizeof(float));
}

void check_frame(const Device& device, int width, int height, const std::string& camera,
                 std::uint64_t planes) {
    const std::uint64_t pixels = std::uint64_t(width) * height,
                        most = max_frame_pixels(device, planes);
    if (pixels <= most) return;
    // A width, which means the same whatever -r was, less what the height is rounded up by.
    const int fitting = static_cast<int>(std::sqrt(double(most) * width / height)) - 2;
    throw NoRoom(
        camera.empty() ? "frame" : fmt::format("camera \"{}\"", camera),
        fmt::format("a frame of {} x {} px is too large: {} holds at most {} pixels a frame", width,
                    height, device.info().name, most),
        fmt::format("{} {} (a width in px), or choose another device (darb devices).",
                    camera.empty() ? "Use at most" : "Use -r", fitting));
}

}  // namespace darb
