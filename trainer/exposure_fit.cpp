#include "trainer/exposure_fit.h"

#include <algorithm>
#include <glm/glm.hpp>

#include "engine/data/compare_view.h"

namespace darb {

namespace {

double mapped_share(const ImageU8& photo, size_t pixel, bool alpha_is_mask) {
    return alpha_is_mask ? 1.0 : photo.data[pixel * 4 + 3] / 255.0;
}

}  // namespace

ColourMap fit_exposure(const ImageF& render, const ImageU8& photo, const glm::vec3& background,
                       bool alpha_is_mask) {
    constexpr double kHold = 1e-6;
    const ImageF truth = composite(photo, background);
    const size_t pixels = size_t(render.width) * render.height;
    const double hold = kHold * static_cast<double>(pixels);
    glm::dmat4 normal(hold);
    glm::dvec4 right[3];
    for (int r = 0; r < 3; ++r) {
        right[r] = glm::dvec4(0.0);
        right[r][r] = hold;
    }
    for (size_t p = 0; p < pixels; ++p) {
        if (alpha_is_mask && photo.data[p * 4 + 3] < 128) continue;
        glm::dvec4 x(0, 0, 0, 1);
        for (int c = 0; c < 3; ++c) x[c] = std::clamp(render.data[p * 3 + c], 0.0f, 1.0f);
        const double share = mapped_share(photo, p, alpha_is_mask);
        normal += share * share * glm::outerProduct(x, x);
        for (int r = 0; r < 3; ++r)
            right[r] += share * x * (double(truth.data[p * 3 + r]) - (1 - share) * x[r]);
    }
    const glm::dmat4 inverse = glm::inverse(normal);
    ColourMap map{};
    for (int r = 0; r < 3; ++r) {
        const glm::dvec4 row = inverse * right[r];
        for (int c = 0; c < 4; ++c) map[r * 4 + c] = static_cast<float>(row[c]);
    }
    return map;
}

ImageF apply_exposure(const ColourMap& map, const ImageF& image, const ImageU8& photo,
                      bool alpha_is_mask) {
    ImageF out(image.width, image.height, 3);
    for (size_t p = 0; p < out.data.size(); p += 3) {
        const auto share = static_cast<float>(mapped_share(photo, p / 3, alpha_is_mask));
        for (size_t r = 0; r < 3; ++r) {
            const float mapped = map[r * 4] * image.data[p] + map[r * 4 + 1] * image.data[p + 1] +
                                 map[r * 4 + 2] * image.data[p + 2] + map[r * 4 + 3];
            out.data[p + r] = share * mapped + (1 - share) * image.data[p + r];
        }
    }
    return out;
}

}  // namespace darb
