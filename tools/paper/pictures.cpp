// SPDX-License-Identifier: MIT
#include "tools/paper/pictures.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "engine/data/image_io.h"
#include "engine/report/html.h"

namespace darb {

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
            "image-rendering:pixelated;border-radius:4px' src='data:image/png;base64,{2}'/>"
            "<figcaption style='overflow-wrap:anywhere'>{1}</figcaption></figure>",
            width_px, html_escape(one.caption), base64(encode_png(one.picture)));
    return html + "</div>\n";
}

}  // namespace darb
