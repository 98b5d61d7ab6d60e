// How much of the photos is detail, and which of them teach nothing.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <vector>

#include "engine/core/error.h"
#include "engine/data/dataset.h"

namespace darb {

namespace {

constexpr std::size_t kPhotos = 8;

// Rec. 601.
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

constexpr std::size_t kNamed = 3;        // photos, in a sentence
constexpr std::uint8_t kLeastAlpha = 8;  // below, nothing of the pixel is learned
constexpr std::uint8_t kMostOfBlack = 3;
constexpr std::size_t kCompared = 64;  // bytes of a photo, before it is compared as a whole

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

// Of what is not hidden.
bool is_black(const ImageU8& photo) {
    for (std::size_t at = 0; at + 3 < photo.data.size(); at += 4)
        if (photo.data[at + 3] >= kLeastAlpha &&
            std::max({photo.data[at], photo.data[at + 1], photo.data[at + 2]}) > kMostOfBlack)
            return false;
    return true;
}

// Photos that another one equals, the first of each kind with them.
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
    if (photos.size() != dataset.views.size()) return {};  // which training refuses
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
