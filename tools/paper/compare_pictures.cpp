// SPDX-License-Identifier: MIT
#include "tools/paper/compare_pictures.h"

#include <fmt/format.h>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <utility>

#include "engine/data/image_io.h"
#include "engine/kernels/kernel_family.h"
#include "engine/report/html.h"
#include "tools/paper/compare_stats.h"

namespace darb {

namespace {

constexpr int kLeastSide = 24;      // px
constexpr int kCropWidth = 200;     // px on the page
constexpr int kPictureWidth = 255;  // px on the page
constexpr int kPageQuality = 88;    // of JPEG
constexpr std::size_t kTellingViews = 2;

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

template <class Square>
ImageU8 cut(const ImageU8& image, const Square& square) {
    ImageU8 part(square.side, square.side, 3);
    for (int y = 0; y < square.side; ++y)
        for (int x = 0; x < square.side; ++x)
            for (int c = 0; c < 3; ++c) part.at(x, y, c) = image.at(square.x + x, square.y + y, c);
    return part;
}

int side_of_square(const ImageU8& picture) {
    const int shorter = std::min(picture.width, picture.height);
    return std::min(shorter, std::max(shorter / 4, kLeastSide));
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
        const int side = side_of_square(a.photo);
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

namespace {

const ComparedRun* first_run(const Comparison& c, const ComparedDataset& dataset,
                             std::size_t kernel) {
    for (const ComparedRun& run : dataset.runs)
        if (run.kernel == c.kernels[kernel] && run.failure.empty()) return &run;
    return nullptr;
}

std::string crop_rows(const Comparison& c, const ComparedDataset& dataset) {
    const ComparedRun* base = nullptr;
    for (std::size_t k = 0; k < c.kernels.size(); ++k)
        if (const ComparedRun* run = first_run(c, dataset, k);
            run != nullptr && (base == nullptr || run->kernel == kernel_name(KERNEL_GAUSSIAN)))
            base = run;
    if (base == nullptr || base->at.empty()) return {};
    std::string html;
    for (std::size_t k = 0; k < c.kernels.size(); ++k) {
        const ComparedRun* run = first_run(c, dataset, k);
        if (run == nullptr || run == base || run->at.empty()) continue;
        for (const Crop& crop : crops_of(base->at.back(), run->at.back())) {
            const std::string gain =
                fmt::format("{}: {}", run->kernel, format_number(-1e3 * crop.gain, 2));
            html +=
                html_pictures({{crop.photo, fmt::format("{} at {}, {}", crop.view, crop.x, crop.y)},
                               {crop.first, base->kernel},
                               {crop.second, gain}},
                              kCropWidth);
        }
    }
    return html.empty()
               ? ""
               : fmt::format(
                     "<h3>Where the errors differ most</h3><p class='soft'>Photo, {0}, kernel: "
                     "first where the kernel gains most on {0}, then where it loses most; the "
                     "number is its squared error less that of {0}, times 1,000.</p>",
                     html_escape(base->kernel)) +
                     html;
}

}  // namespace

namespace {

const ComparedView* view_of(const ComparedAt& at, const std::string& name) {
    for (const ComparedView& view : at.views)
        if (view.name == name && std::filesystem::exists(view.picture)) return &view;
    return nullptr;
}

/// The square of the view where the methods differ most; nothing where one has no picture of it, or
/// one of another size.
std::optional<TellingView> telling_square(const std::string& name,
                                          const std::vector<const ComparedAt*>& methods) {
    std::vector<SumTable> errors;
    TellingView found{name};
    int width = 0, height = 0;
    for (const ComparedAt* at : methods) {
        const ComparedView* view = view_of(*at, name);
        if (view == nullptr) return {};
        const HeldOutPicture picture = read_held_out(view->picture);
        if (!errors.empty() && (picture.photo.width != width || picture.photo.height != height))
            return {};
        width = picture.photo.width;
        height = picture.photo.height;
        found.side = side_of_square(picture.photo);
        SumTable& table = errors.emplace_back(width, height);
        for (int y = 0; y < height; ++y)
            for (int x = 0; x < width; ++x)
                table.set(x, y, squared_error(picture.render, picture.photo, x, y));
    }
    const double area = double(found.side) * found.side, count = double(methods.size());
    found.spread = -1;
    for (int y = 0; y + found.side <= height; ++y)
        for (int x = 0; x + found.side <= width; ++x) {
            double sum = 0, squares = 0;
            for (const SumTable& table : errors) {
                const double error = table.square(x, y, found.side) / area;
                sum += error / count;
                squares += error * error / count;
            }
            const double spread = std::sqrt(std::max(squares - sum * sum, 0.0));
            if (spread > found.spread) found.x = x, found.y = y, found.spread = spread;
        }
    for (const SumTable& table : errors)
        found.square_error.push_back(table.square(found.x, found.y, found.side) / area);
    return found;
}

}  // namespace

std::vector<TellingView> telling_views(const std::vector<const ComparedAt*>& methods,
                                       std::size_t most) {
    std::vector<TellingView> found;
    if (methods.size() < 2) return found;
    for (const ComparedView& view : methods.front()->views)
        if (auto square = telling_square(view.name, methods)) found.push_back(std::move(*square));
    std::stable_sort(found.begin(), found.end(), [](const TellingView& a, const TellingView& b) {
        return a.spread > b.spread;
    });
    if (found.size() > most) found.resize(most);
    return found;
}

namespace {

ImageU8 framed(ImageU8 picture, const TellingView& square) {
    constexpr std::array<std::uint8_t, 3> kRed = {230, 30, 30};
    const int thick = std::max(1, square.side / 60);
    for (int y = 0; y < square.side; ++y)
        for (int x = 0; x < square.side; ++x) {
            const bool inside =
                x >= thick && y >= thick && x < square.side - thick && y < square.side - thick;
            for (int c = 0; c < 3 && !inside; ++c)
                picture.at(square.x + x, square.y + y, c) = kRed[static_cast<std::size_t>(c)];
        }
    return picture;
}

void add_telling_view(const Comparison& comparison, const ComparedDataset& dataset,
                      const TellingView& square,
                      const std::vector<std::pair<std::string, const ComparedAt*>>& methods,
                      Report& report) {
    std::vector<Captioned> whole, cuts;
    const auto add = [&](const std::string& name, const ImageU8& picture,
                         const std::string& whole_text, const std::string& cut_text) {
        const ImageU8 part = cut(picture, square);
        report.picture(fmt::format("{} {} {}", dataset.name, square.view, name),
                       encode_png(picture));
        report.picture(fmt::format("{} {} crop {}", dataset.name, square.view, name),
                       encode_png(part));
        whole.push_back({framed(picture, square), whole_text, true});
        cuts.push_back({part, cut_text});
    };
    for (std::size_t m = 0; m < methods.size(); ++m) {
        const auto& [name, at] = methods[m];
        const ComparedView& view = *view_of(*at, square.view);
        const HeldOutPicture picture = read_held_out(view.picture);
        if (m == 0)
            add("photo", picture.photo, square.view, fmt::format("at {}, {}", square.x, square.y));
        const std::string shown = method_text(comparison, name);
        add(name, picture.render, fmt::format("{}: {:.2f} dB", shown, view.psnr_db),
            fmt::format("{}: {}", shown, format_number(1e3 * square.square_error[m], 2)));
    }
    report.html(html_pictures(whole, kPictureWidth) + html_pictures(cuts, kCropWidth));
}

}  // namespace

void add_pictures(const Comparison& c, const ComparedDataset& dataset, Report& report) {
    std::vector<std::pair<std::string, const ComparedAt*>> methods;
    std::vector<const ComparedAt*> evaluations;
    for (std::size_t k = 0; k < c.kernels.size(); ++k)
        if (const ComparedRun* run = first_run(c, dataset, k); run != nullptr && !run->at.empty())
            methods.emplace_back(run->kernel, &run->at.back());
    for (const auto& [name, at] : methods) evaluations.push_back(at);
    const std::vector<TellingView> views = telling_views(evaluations, kTellingViews);
    if (!views.empty()) {
        report.heading(dataset.name + ", held-out pictures", 3);
        report.html(
            "<p class='soft'>The views, and in them the framed square, where the methods differ "
            "most: by the standard deviation over the methods of the mean squared error in a "
            "square of a quarter of the shorter side. Below the square, with its error times "
            "1,000.</p>");
        for (const TellingView& view : views) add_telling_view(c, dataset, view, methods, report);
    }
    report.html(crop_rows(c, dataset));
}

namespace {

std::uint8_t byte(double v) {
    return static_cast<std::uint8_t>(std::clamp(v, 0.0, 1.0) * 255 + 0.5);
}

}  // namespace

ImageU8 grey_field(int size, double white, const std::function<double(int, int)>& value) {
    ImageU8 image(size, size, 1);
    for (int y = 0; y < size; ++y)
        for (int x = 0; x < size; ++x) image.at(x, y, 0) = byte(value(x, y) / white);
    return image;
}

ImageU8 signed_field(int size, double limit, const std::function<double(int, int)>& value) {
    ImageU8 image(size, size, 3);
    for (int y = 0; y < size; ++y)
        for (int x = 0; x < size; ++x) {
            const double v = limit > 0 ? value(x, y) / limit : 0;
            image.at(x, y, 0) = byte(1 + std::min(v, 0.0));
            image.at(x, y, 1) = byte(1 - std::abs(v));
            image.at(x, y, 2) = byte(1 - std::max(v, 0.0));
        }
    return image;
}

std::string html_pictures(const std::vector<Captioned>& pictures, int width_px) {
    std::string html = "<div style='display:flex;flex-wrap:wrap;gap:.8rem'>";
    for (const Captioned& one : pictures)
        html += fmt::format(
            "<figure style='margin:0;width:{0}px'><img alt='{1}' style='width:100%;"
            "{3}border-radius:4px' src='data:image/{4};base64,{2}'/>"
            "<figcaption style='overflow-wrap:anywhere'>{1}</figcaption></figure>",
            width_px, html_escape(one.caption),
            base64(one.is_large ? encode_jpeg(one.picture, kPageQuality) : encode_png(one.picture)),
            one.is_large ? "" : "image-rendering:pixelated;", one.is_large ? "jpeg" : "png");
    return html + "</div>\n";
}

}  // namespace darb
