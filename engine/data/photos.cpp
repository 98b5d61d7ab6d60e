// Photos: decode, mask, undistort, scale; many at once.
#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <exception>
#include <thread>

#include "engine/core/error.h"
#include "engine/data/dataset.h"
#include "engine/data/image_io.h"
#include "engine/data/resample.h"

namespace darb {

namespace {

bool same_aspect(const ImageU8& image, int width, int height) {
    const double wanted = static_cast<double>(image.width) * height / width;
    return std::abs(image.height - wanted) <= 1.5 + 0.01 * wanted;
}

/// The mask, turned like the photo: masks are made of the stored pixels or of the photo as viewers
/// show it, and its shape tells which.
ImageU8 load_mask(const View& view, const ImageU8& photo) {
    const bool turned = view.orientation >= 5;
    const int width = turned ? photo.height : photo.width;  // as stored
    const int height = turned ? photo.width : photo.height;
    ImageU8 mask = read_image(view.mask, 1);
    if (same_aspect(mask, width, height)) return orient_image(mask, view.orientation);
    if (same_aspect(mask, height, width)) {
        if (turned) return mask;  // as viewers show the photo, and so it is
        const int shown = read_image_info(view.photo).orientation;
        // 6 and 8 undo each other, 5 and 7 themselves.
        if (shown >= 5) return orient_image(mask, shown == 6 ? 8 : shown == 8 ? 6 : shown);
    }
    throw Error(
        view.mask.string(),
        fmt::format("is {} x {} px, another aspect ratio than that of its photo {}, {} x {}",
                    mask.width, mask.height, view.photo.string(), width, height),
        "Make masks of the same photos, or remove this one.");
}

}  // namespace

ImageU8 load_photo(const View& view) {
    ImageU8 photo = to_rgba(read_image(view.photo, view.orientation));
    if (photo.width != view.lens.width || photo.height != view.lens.height)
        throw Error(view.photo.string(),
                    fmt::format("is {} x {} px now, but was {} x {} when the data set was opened",
                                photo.width, photo.height, view.lens.width, view.lens.height),
                    "Leave the photos alone while they are in use.");
    if (!view.mask.empty()) apply_mask(photo, load_mask(view, photo));
    if (view.lens.distorted() && !view.camera.lens.active) {
        const Camera full = undistorted_frame(view.lens, view.photo.string()).camera;
        photo = undistort(photo, view.lens, full);
    }
    return box_downscale(photo, view.camera.width, view.camera.height);
}

std::vector<ImageU8> load_photos(const std::vector<View>& views, int threads) {
    std::vector<ImageU8> photos(views.size());
    std::vector<std::exception_ptr> errors(views.size());
    std::atomic<std::size_t> next{0};
    std::atomic<bool> failed{false};
    const auto work = [&] {
        for (std::size_t i; !failed && (i = next++) < views.size();) try {
                photos[i] = load_photo(views[i]);
            } catch (...) {
                errors[i] = std::current_exception();
                failed = true;
            }
    };
    const std::size_t wanted = threads > 0 ? static_cast<std::size_t>(threads)
                                           : std::max(1u, std::thread::hardware_concurrency());
    {
        std::vector<std::jthread> workers(std::min(wanted, views.size()));
        for (std::jthread& worker : workers) worker = std::jthread(work);
    }
    for (const std::exception_ptr& error : errors)
        if (error) std::rethrow_exception(error);
    return photos;
}

}  // namespace darb
