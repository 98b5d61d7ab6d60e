// SPDX-License-Identifier: MIT
#include "viewer/photo_compare.h"

#include <algorithm>
#include <cstring>

#include "engine/core/error.h"
#include "viewer/splat_picture.h"
#include "viewer/view_camera.h"

namespace darb {

Camera camera_in_window(const Photos& photos, const Navigation& free, const WindowArea& area) {
    if (photos.current < 0) return free.camera(area.width, area.height);
    return fitted(photos.view().camera, area);
}

PhotoOverlay overlay_of(const Photos& photos, const Camera& camera, const WindowArea& area) {
    PhotoOverlay o;
    if (photos.current < 0 || photos.loaded != photos.current) return o;
    const Camera& of = photos.view().camera;
    const double share = double(camera.width) / area.width;
    o.scale = fit_scale(of, area.free_width(), area.free_height()) * share;
    o.x = share * area.left + 0.5 * (share * area.free_width() - o.scale * of.width);
    o.y = share * area.top + 0.5 * (camera.height - share * area.top - o.scale * of.height);
    o.photo = &photos.buffer;
    o.width = photos.width;
    o.height = photos.height;
    return o;
}

bool photo_beside(const Photos& photos, const DisplaySettings& display) {
    return photos.compare && photos.current >= 0 && photos.loaded == photos.current &&
           display.mode == VIEW_COLOUR;
}

Strip compared_strip(const Photos& photos, const DisplaySettings& display, const WindowArea& area) {
    const double width = std::max(area.width, 1);
    double begin = area.left, end = width - area.right;
    if (photo_beside(photos, display)) {
        const Camera& of = photos.view().camera;
        const double beyond =
            std::max(0.0, area.free_width() -
                              fit_scale(of, area.free_width(), area.free_height()) * of.width);
        begin += beyond / 2;
        end -= beyond / 2;
    }
    return {static_cast<float>(begin / width), static_cast<float>(end / width)};
}

void load_photo_of_view(Device& device, Photos& photos) {
    const View& view = photos.view();
    if (view.photo.empty())
        throw Error(view.name, "this camera has no photo",
                    "Name the data set with its photos: --cameras DATASET.");
    const ImageU8 photo = load_photo(view);
    std::vector<std::uint32_t> texels(photo.data.size() / 4);
    std::memcpy(texels.data(), photo.data.data(), photo.data.size());
    Buffer buffer(device, "photo", texels.size() * 4);
    buffer.upload(texels);  // ordered after what reads the previous photo
    photos.buffer = std::move(buffer);
    photos.width = photo.width;
    photos.height = photo.height;
    photos.loaded = photos.current;
}

}  // namespace darb
