#include "tools/paper/compare_crops.h"

#include <algorithm>
#include <optional>

namespace darb {

namespace {

constexpr int kLeastSide = 24;  // px

/// Sums over rectangles in constant time.
class SumTable {
  public:
    SumTable(int width, int height)
        : width_(width), sums_(static_cast<std::size_t>(width + 1) * (height + 1), 0.0) {}
    void set(int x, int y, double v) {
        sums_[at(x + 1, y + 1)] = v + sums_[at(x, y + 1)] + sums_[at(x + 1, y)] - sums_[at(x, y)];
    }
    double square(int x, int y, int side) const {
        return sums_[at(x + side, y + side)] - sums_[at(x, y + side)] - sums_[at(x + side, y)] +
               sums_[at(x, y)];
    }

  private:
    std::size_t at(int x, int y) const { return static_cast<std::size_t>(y) * (width_ + 1) + x; }
    int width_;
    std::vector<double> sums_;
};

double squared_error(const ImageU8& a, const ImageU8& b, int x, int y) {
    double sum = 0;
    for (int c = 0; c < 3; ++c) {
        const double d = (double(a.at(x, y, c)) - b.at(x, y, c)) / 255;
        sum += d * d / 3;
    }
    return sum;
}

ImageU8 cut(const ImageU8& image, const Crop& crop) {
    ImageU8 part(crop.side, crop.side, 3);
    for (int y = 0; y < crop.side; ++y)
        for (int x = 0; x < crop.side; ++x)
            for (int c = 0; c < 3; ++c) part.at(x, y, c) = image.at(crop.x + x, crop.y + y, c);
    return part;
}

void take(std::optional<Crop>& best, bool better, const Crop& place, const HeldOutPicture& a,
          const HeldOutPicture& b) {
    if (best && !better) return;
    best = place;
    best->photo = cut(a.photo, place);
    best->first = cut(a.render, place);
    best->second = cut(b.render, place);
}

}  // namespace

std::vector<Crop> crops_of(const ComparedAt& first, const ComparedAt& second) {
    std::optional<Crop> gain, loss;
    for (const ComparedView& view : first.views) {
        const auto other = std::find_if(second.views.begin(), second.views.end(),
                                        [&](const ComparedView& v) { return v.name == view.name; });
        if (other == second.views.end() || !std::filesystem::exists(view.picture) ||
            !std::filesystem::exists(other->picture))
            continue;
        const HeldOutPicture a = read_held_out(view.picture), b = read_held_out(other->picture);
        const int width = a.photo.width, height = a.photo.height;
        const int shorter = std::min(width, height);
        const int side = std::min(shorter, std::max(shorter / 4, kLeastSide));
        if (b.photo.width != width || b.photo.height != height) continue;
        SumTable table(width, height);
        for (int y = 0; y < height; ++y)
            for (int x = 0; x < width; ++x)
                table.set(x, y,
                          squared_error(a.render, a.photo, x, y) -
                              squared_error(b.render, b.photo, x, y));
        Crop most{view.name, 0, 0, side, -1e30, {}, {}, {}}, least = most;
        least.gain = 1e30;
        for (int y = 0; y + side <= height; ++y)
            for (int x = 0; x + side <= width; ++x) {
                const double mean = table.square(x, y, side) / (double(side) * side);
                if (mean > most.gain) most.x = x, most.y = y, most.gain = mean;
                if (mean < least.gain) least.x = x, least.y = y, least.gain = mean;
            }
        take(gain, gain && most.gain > gain->gain, most, a, b);
        take(loss, loss && least.gain < loss->gain, least, a, b);
    }
    if (!gain) return {};
    return {std::move(*gain), std::move(*loss)};
}

}  // namespace darb
