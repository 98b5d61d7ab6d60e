// Photos: decode, mask, undistort, scale; many at once.
#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <exception>
#include <thread>

#include "engine/core/error.h"
#include "engine/data/dataset.h"
#include "engine/data/image_io.h"
#include "engine/data/resample.h"

namespace darb {

ImageU8 load_photo(const View& view) {
    ImageU8 photo = to_rgba(read_image(view.photo, view.orientation));
    if (photo.width != view.lens.width || photo.height != view.lens.height)
        throw Error(view.photo.string(),
                    fmt::format("is {} x {} px now, but was {} x {} when the data set was opened",
                                photo.width, photo.height, view.lens.width, view.lens.height),
                    "Leave the photos alone while they are in use.");
    if (!view.mask.empty()) apply_mask(photo, read_image(view.mask, view.orientation));
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
