// SPDX-License-Identifier: MIT
// Smaller photos against area means in double.
#include "engine/core/rng.h"
#include "tests/support/shared_device.h"
#include "trainer/step/photos.h"

namespace darb::test {
namespace {

std::vector<std::uint32_t> random_photo(int width, int height, std::uint64_t seed) {
    Pcg32 rng(seed);
    std::vector<std::uint32_t> photo(static_cast<size_t>(width) * static_cast<size_t>(height));
    for (std::uint32_t& pixel : photo) pixel = rng.next() | (rng.below(2) == 0 ? 0xff000000u : 0);
    return photo;
}

double channel(std::uint32_t rgba, int c) {
    return (rgba >> (8 * c) & 255u) / 255.0;
}

/// Area mean of pixel (x, y) of the smaller photo, weighted by alpha; [3]: the mean alpha.
glm::dvec4 area_mean(const std::vector<std::uint32_t>& photo, const Camera& from, const Camera& to,
                     int x, int y) {
    const double w = double(from.width) / to.width, h = double(from.height) / to.height;
    glm::dvec4 sum(0);
    for (int v = 0; v < from.height; ++v)
        for (int u = 0; u < from.width; ++u) {
            const double across = std::min(u + 1.0, (x + 1) * w) - std::max(double(u), x * w);
            const double down = std::min(v + 1.0, (y + 1) * h) - std::max(double(v), y * h);
            if (across <= 0 || down <= 0) continue;
            const std::uint32_t p = photo[static_cast<size_t>(v * from.width + u)];
            const double alpha = across * down * channel(p, 3);
            sum += glm::dvec4(alpha * channel(p, 0), alpha * channel(p, 1), alpha * channel(p, 2),
                              alpha);
        }
    const double alpha = sum.w;
    if (alpha > 0) sum /= alpha;
    sum.w = alpha / (w * h);
    return sum;
}

TEST(Downsample, is_the_mean_of_the_area) {
    Camera from;
    from.width = 51;
    from.height = 38;
    const auto photo = random_photo(51, 38, 8);
    Device& d = shared_device();
    Buffer buffer(d, "photo", photo.size() * 4);
    buffer.upload(photo);
    ResolutionRamp ramp(d);
    for (const int divisor : {2, 4}) {
        const Camera to = divided(from, divisor);
        const auto got = ramp.downsample(buffer, from, to)
                             .download<std::uint32_t>(size_t(to.width) * size_t(to.height));
        for (int y = 0; y < to.height; ++y)
            for (int x = 0; x < to.width; ++x) {
                const glm::dvec4 mean = area_mean(photo, from, to, x, y);
                for (int c = 0; c < 4; ++c)
                    EXPECT_NEAR(channel(got[static_cast<size_t>(y * to.width + x)], c), mean[c],
                                0.51 / 255)
                        << divisor << ": " << x << ", " << y << ", " << c;
            }
    }
}

}  // namespace
}  // namespace darb::test
