// SPDX-License-Identifier: MIT
// Photos: decode, mask, undistort, scale; many at once.
#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <condition_variable>
#include <cstdint>
#include <exception>
#include <map>
#include <mutex>
#include <new>
#include <thread>
#include <vector>

#include "engine/core/error.h"
#include "engine/core/memory.h"
#include "engine/core/on_threads.h"
#include "engine/data/dataset.h"
#include "engine/data/image_io.h"
#include "engine/data/source.h"
#include "engine/scene/panorama.h"

namespace darb {

namespace {

bool same_aspect(const ImageU8& image, int width, int height) {
    const double wanted = static_cast<double>(image.width) * height / width;
    return std::abs(image.height - wanted) <= 1.5 + 0.01 * wanted;
}

/// The most memory that load_photo holds at a time: libjpeg's buffers for a progressive photo, and
/// the pixels as stored, as RGBA and undistorted.
std::uint64_t bytes_while_loading(const View& view) {
    constexpr std::uint64_t kBytesPerPixel = 16;
    return kBytesPerPixel * static_cast<std::uint64_t>(std::max(view.lens.width, 1)) *
           static_cast<std::uint64_t>(std::max(view.lens.height, 1));
}

/// Admits photos while the memory that they take together is within a budget; a single photo is
/// always admitted.
class MemoryGate {
  public:
    explicit MemoryGate(std::uint64_t budget) : left_(budget), budget_(budget) {}

    void enter(std::uint64_t bytes) {
        std::unique_lock lock(mutex_);
        changed_.wait(lock, [&] { return within(bytes) <= left_; });
        left_ -= within(bytes);
    }
    void leave(std::uint64_t bytes) {
        {
            const std::lock_guard lock(mutex_);
            left_ += within(bytes);
        }
        changed_.notify_all();
    }

  private:
    std::uint64_t within(std::uint64_t bytes) const { return std::min(bytes, budget_); }

    std::mutex mutex_;
    std::condition_variable changed_;
    std::uint64_t left_;
    const std::uint64_t budget_;
};

std::uint64_t bytes_loaded(const View& view) {
    return 4 * static_cast<std::uint64_t>(view.camera.width) *
           static_cast<std::uint64_t>(view.camera.height);
}

/// Throws Error, before the first photo is read, where all of them will take too much memory.
void check_memory(const std::vector<View>& views, std::uint64_t free) {
    std::uint64_t all = 0;
    for (const View& view : views) {
        all += bytes_loaded(view);
        if (bytes_while_loading(view) <= free) continue;
        throw NoRoom(view.photo.string(),
                     fmt::format("takes {} MB of memory while it is read, {} MB are free",
                                 bytes_while_loading(view) >> 20, free >> 20),
                     "Free memory, or make the photo smaller.");
    }
    if (all > free)
        throw NoRoom(fmt::format("{} photos", views.size()),
                     fmt::format("take {} MB of memory, {} MB are free", all >> 20, free >> 20),
                     "Load them smaller with -r 2, 4 or 8, or free memory.");
}

/// Sets alpha to 0 where a pixel is farther than `radius` px from the middle.
void crop_to_circle(ImageU8& rgba, double radius) {
    for (int y = 0; y < rgba.height; ++y)
        for (int x = 0; x < rgba.width; ++x)
            if (std::hypot(x + 0.5 - 0.5 * rgba.width, y + 0.5 - 0.5 * rgba.height) > radius)
                rgba.data[(static_cast<std::size_t>(y) * rgba.width + x) * 4 + 3] = 0;
}

ImageU8 decode_photo(const View& view) {
    ImageU8 photo = to_rgba(read_image(view.photo, view.orientation));
    if (photo.width != view.lens.width || photo.height != view.lens.height)
        throw Error(view.photo.string(),
                    fmt::format("is {} x {} px now, but was {} x {} when the data set was opened",
                                photo.width, photo.height, view.lens.width, view.lens.height),
                    "Leave the photos alone while they are in use.");
    if (!view.mask.empty())
        apply_mask(photo, turn_with_photo(read_image(view.mask, 1), view, view.mask, "masks"));
    if (view.crop_radius > 0) crop_to_circle(photo, view.crop_radius);
    if (view.face >= 0) {
        photo = cut_face(photo, cube_faces().at(static_cast<std::size_t>(view.face)),
                         face_size(photo.width));
    } else if (view.lens.distorted() && !view.camera.lens.active) {
        const Camera full = undistorted_frame(view.lens, view.photo.string()).camera;
        photo = undistort(photo, view.lens, full);
    }
    return box_downscale(photo, view.camera.width, view.camera.height);
}

}  // namespace

ImageU8 turn_with_photo(ImageU8 image, const View& view, const std::filesystem::path& file,
                        const char* kind) {
    const bool turned = view.orientation >= 5;
    const int width = turned ? view.lens.height : view.lens.width;  // as stored
    const int height = turned ? view.lens.width : view.lens.height;
    if (same_aspect(image, width, height)) return orient_image(image, view.orientation);
    if (same_aspect(image, height, width)) {
        if (turned) return image;  // made for the photo as viewers show it
        const int shown = read_image_info(view.photo).orientation;
        // 6 and 8 undo each other, 5 and 7 themselves.
        if (shown >= 5) return orient_image(image, shown == 6 ? 8 : shown == 8 ? 6 : shown);
    }
    throw Error(
        file.string(),
        fmt::format("is {} x {} px, another aspect ratio than that of its photo {}, {} x {}",
                    image.width, image.height, view.photo.string(), width, height),
        fmt::format("Make {} of the same photos, or remove this one.", kind));
}

ImageU8 load_photo(const View& view) try {
    return decode_photo(view);
} catch (const std::bad_alloc&) {
    throw NoRoom(view.photo.string(),
                 fmt::format("does not fit into the memory that is left: {} x {} px",
                             view.lens.width, view.lens.height),
                 "Free memory, or make the photo smaller.");
}

std::vector<ImageU8> load_photos(const std::vector<View>& views, int threads,
                                 std::uint64_t memory) {
    if (memory == 0) memory = free_memory();
    check_memory(views, memory);
    MemoryGate gate(memory / 2);
    std::vector<ImageU8> photos(views.size());
    std::vector<std::exception_ptr> errors(views.size());
    std::atomic<std::size_t> next{0};
    std::atomic<bool> failed{false};
    const auto work = [&] {
        for (std::size_t i; !failed && (i = next++) < views.size();) {
            gate.enter(bytes_while_loading(views[i]));
            try {
                photos[i] = load_photo(views[i]);
            } catch (...) {
                errors[i] = std::current_exception();
                failed = true;
            }
            gate.leave(bytes_while_loading(views[i]));
        }
    };
    const std::size_t wanted = threads > 0 ? static_cast<std::size_t>(threads)
                                           : std::max(1u, std::thread::hardware_concurrency());
    on_threads(std::min(wanted, views.size()), work);
    for (const std::exception_ptr& error : errors)
        if (error) std::rethrow_exception(error);
    return photos;
}

// Measures how much detail the photos have, and finds those that teach nothing.

namespace {

constexpr std::size_t kPhotos = 8;

// Luma of Rec. 601, 0 to 1.
double grey(const ImageU8& photo, int x, int y) {
    return (0.299 * photo.at(x, y, 0) + 0.587 * photo.at(x, y, 1) + 0.114 * photo.at(x, y, 2)) /
           255;
}

bool is_opaque(const ImageU8& photo, int x, int y) {
    const auto opaque = [&](int dx, int dy) { return photo.at(x + dx, y + dy, 3) == 255; };
    return opaque(0, 0) && opaque(-1, 0) && opaque(1, 0) && opaque(0, -1) && opaque(0, 1);
}

double detail_at(const ImageU8& photo, int x, int y) {
    return std::abs(4 * grey(photo, x, y) - grey(photo, x - 1, y) - grey(photo, x + 1, y) -
                    grey(photo, x, y - 1) - grey(photo, x, y + 1));
}

constexpr std::size_t kNamed = 3;        // photos that a sentence names
constexpr std::uint8_t kLeastAlpha = 8;  // below this alpha, a pixel teaches nothing
constexpr std::uint8_t kMostOfBlack = 3;
constexpr std::size_t kCompared = 64;  // bytes compared before the whole photo is

std::string names_of(const Dataset& dataset, const std::vector<std::size_t>& views) {
    std::string names;
    for (std::size_t i = 0; i < std::min(views.size(), kNamed); ++i)
        names += (i > 0 ? ", " : "") + dataset.views[views[i]].name;
    if (views.size() > kNamed) names += fmt::format(" and {} more", views.size() - kNamed);
    return names;
}

bool is_hidden(const ImageU8& photo) {
    for (std::size_t at = 3; at < photo.data.size(); at += 4)
        if (photo.data[at] >= kLeastAlpha) return false;
    return true;
}

// Whether every pixel that is not hidden is black.
bool is_black(const ImageU8& photo) {
    for (std::size_t at = 0; at + 3 < photo.data.size(); at += 4)
        if (photo.data[at + 3] >= kLeastAlpha &&
            std::max({photo.data[at], photo.data[at + 1], photo.data[at + 2]}) > kMostOfBlack)
            return false;
    return true;
}

// Groups of equal photos; each group begins with the first of its kind.
std::vector<std::vector<std::size_t>> repeats(const std::vector<std::size_t>& views,
                                              const std::vector<ImageU8>& photos) {
    std::map<std::vector<std::uint8_t>, std::vector<std::vector<std::size_t>>> kinds;
    for (const std::size_t view : views) {
        const std::vector<std::uint8_t>& data = photos[view].data;
        std::vector<std::uint8_t> few;
        for (std::size_t i = 0; i < kCompared; ++i)
            few.push_back(data[i * data.size() / kCompared]);
        auto& alike = kinds[few];
        const auto same = std::ranges::find_if(
            alike, [&](const auto& kind) { return photos[kind[0]].data == data; });
        if (same == alike.end())
            alike.push_back({view});
        else
            same->push_back(view);
    }
    std::vector<std::vector<std::size_t>> found;
    for (const auto& [few, alike] : kinds)
        for (const auto& kind : alike)
            if (kind.size() > 1) found.push_back(kind);
    return found;
}

[[noreturn]] void refuse_hidden(const Dataset& dataset, const std::vector<std::size_t>& hidden) {
    const View& first = dataset.views[hidden[0]];
    throw Error(
        dataset.root.string(),
        fmt::format("every photo is {} everywhere, as {}: nothing is left to train on",
                    first.mask.empty() ? "transparent" : "masked",
                    (first.mask.empty() ? first.photo : first.mask).string()),
        "Train on the photos' colours without their alpha: --effects=-alpha. Or export photos and "
        "masks again.");
}

}  // namespace

std::vector<std::string> photo_doubts(const Dataset& dataset, const std::vector<ImageU8>& photos) {
    if (photos.size() != dataset.views.size()) return {};  // training refuses these
    std::vector<std::size_t> training, hidden, black, seen;
    for (std::size_t i = 0; i < dataset.views.size(); ++i)
        if (!dataset.views[i].is_test && photos[i].channels == 4 && !photos[i].data.empty())
            training.push_back(i);
    for (const std::size_t i : training)
        (is_hidden(photos[i]) ? hidden : is_black(photos[i]) ? black : seen).push_back(i);
    if (!hidden.empty() && hidden.size() == training.size()) refuse_hidden(dataset, hidden);
    std::vector<std::string> doubts;
    if (!hidden.empty())
        doubts.push_back(fmt::format(
            "{} of {} photos are transparent or masked everywhere and teach nothing: {}",
            hidden.size(), training.size(), names_of(dataset, hidden)));
    if (!black.empty())
        doubts.push_back(fmt::format("{} of {} photos are black everywhere: {}", black.size(),
                                     training.size(), names_of(dataset, black)));
    for (const std::vector<std::size_t>& same : repeats(seen, photos))
        doubts.push_back(fmt::format(
            "{} of {} photos have the same pixels, though each has a camera of its own: {}",
            same.size(), training.size(), names_of(dataset, same)));
    if (training.size() == 1)
        doubts.push_back(fmt::format(
            "one photo alone is trained on, {}, which says nothing of how far anything is",
            dataset.views[training[0]].name));
    return doubts;
}

PhotoDetail photo_detail(const std::vector<View>& views) {
    std::vector<View> training;
    for (const View& view : views)
        if (!view.is_test) training.push_back(view);
    std::vector<View> few;
    const std::size_t count = std::min(kPhotos, training.size());
    for (std::size_t i = 0; i < count; ++i) few.push_back(training[i * training.size() / count]);
    double sum = 0, opaque = 0, pixels = 0;
    for (const ImageU8& photo : load_photos(few))
        for (int y = 1; y + 1 < photo.height; ++y)
            for (int x = 1; x + 1 < photo.width; ++x, ++pixels) {
                if (!is_opaque(photo, x, y)) continue;
                sum += detail_at(photo, x, y);
                ++opaque;
            }
    if (opaque == 0) return {};
    return {sum / opaque, opaque / pixels};
}

}  // namespace darb
