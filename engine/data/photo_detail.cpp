// How much of the photos is detail.
#include <algorithm>
#include <cmath>
#include <vector>

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

}  // namespace

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
