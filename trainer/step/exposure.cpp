// SPDX-License-Identifier: MIT
#include "trainer/step/exposure.h"

#include <fmt/format.h>
#include <algorithm>
#include <cmath>
#include <glm/glm.hpp>

#include "engine/core/error.h"
#include "engine/data/metrics.h"
#include "engine/primitives/groups.h"
#include "shaders/shared/effect_args.h"
#include "shaders/shared/render_args.h"

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

namespace {

std::uint32_t groups_of(std::uint32_t pixels) {
    return std::clamp((pixels + EXPOSURE_THREADS - 1) / EXPOSURE_THREADS, 1u,
                      static_cast<std::uint32_t>(EXPOSURE_MAX_GROUPS));
}

gpu::ExposureArgs args_of(const ExposedPicture& picture, std::uint32_t photo,
                          std::uint32_t pixels) {
    const glm::vec3& b = picture.background;
    return {pixels, photo, groups_of(pixels), b.r, b.g, b.b, picture.width};
}

// Adam's steps for vertices of a grid, of which each sees a few pixels.
constexpr float kGridRate = 4;

std::uint64_t gradient_floats_of(const ExposureMaps& maps) {
    return maps.grid ? maps.terms() : EXPOSURE_MAX_GROUPS * EXPOSURE_TERMS;
}
std::uint64_t gradient_bytes_of(const ExposureMaps& maps) {
    return gradient_floats_of(maps) * sizeof(float);
}
static_assert(EXPOSURE_MAX_GROUPS * EXPOSURE_TERMS % 64 == 0);  // where a binding may begin
static_assert(EXPOSURE_GRID_VERTICES * EXPOSURE_TERMS % 64 == 0);

}  // namespace

std::size_t ExposureMaps::terms() const {
    return std::size_t{EXPOSURE_TERMS} * (grid ? EXPOSURE_GRID_VERTICES : 1);
}

ExposureMaps exposure_maps(const TrainOptions& options, std::uint32_t photos) {
    return {photos, options.exposure_grid, options.batch};
}

Exposure::Exposure(Device& device, const ExposureMaps& maps, std::uint64_t pixels)
    : of_(maps), update_(device, "exposure_update", {{"THREADS", SPLAT_GROUP}}) {
    const SpecConstants threads{{"THREADS", SPLAT_GROUP}};
    map_ = Pipeline(device, maps.grid ? "exposure_grid" : "exposure", threads);
    gradient_ =
        Pipeline(device, maps.grid ? "exposure_grid_gradient" : "exposure_backward", {}, false);
    if (maps.grid) backward_ = Pipeline(device, "exposure_grid_backward", threads);
    make_buffers(device, *this, buffers(maps, pixels), "exposure");
    std::vector<float> start;
    for (std::size_t m = 0; m < maps.photos * maps.terms() / EXPOSURE_TERMS; ++m)
        start.insert(start.end(), kIdentityColours.begin(), kIdentityColours.end());
    start.resize(maps.state_size());
    restore(start);
}

BufferList<Exposure> Exposure::buffers(const ExposureMaps& maps, std::uint64_t pixels) {
    return {{&Exposure::maps_, "exposure maps", maps.photos * maps.terms() * 4},
            {&Exposure::moments_, "exposure moments", maps.photos * maps.terms() * 8},
            {&Exposure::mapped_, "mapped image", pixels * 12},
            {&Exposure::partials_, "exposure partials",
             gradient_bytes_of(maps) * static_cast<std::uint64_t>(maps.batch)}};
}

std::uint64_t Exposure::device_bytes(const ExposureMaps& maps, std::uint64_t pixels) {
    return charged_bytes(buffers(maps, pixels));
}

BufferRange Exposure::partials(int place) const {
    const std::uint64_t bytes = gradient_bytes_of(of_);
    return {partials_, bytes * static_cast<std::uint64_t>(place), bytes};
}

void Exposure::record(Commands& commands, const ExposedPicture& picture, std::uint32_t photo,
                      std::uint32_t pixels) {
    commands.pass("exposure");
    const Groups g = groups_for(pixels);
    commands.dispatch(map_, args_of(picture, photo, pixels),
                      {maps_, picture.image, mapped_, picture.transmittance}, g.x, g.y);
}

void Exposure::record_backward(Commands& commands, const ExposedPicture& picture,
                               const Buffer& d_image, const ExposureStep& step, int place) {
    commands.pass("exposure");
    const gpu::ExposureArgs args = args_of(picture, step.photo, step.pixels);
    const std::uint32_t groups = of_.grid ? EXPOSURE_GRID_X * EXPOSURE_GRID_Y : args.groups;
    commands.dispatch(gradient_, args,
                      {maps_, picture.image, d_image, partials(place), picture.transmittance},
                      groups);
    if (!of_.grid) return;
    const Groups g = groups_for(step.pixels);
    commands.dispatch(backward_, args, {maps_, picture.image, d_image, picture.transmittance}, g.x,
                      g.y);
}

void Exposure::record_step(Commands& commands, const Buffer& status, const ExposureStep& step,
                           int place) {
    commands.pass("exposure");
    const double correction1 = 1.0 - std::pow(0.9, step.visits),
                 correction2 = 1.0 - std::pow(0.999, step.visits);
    const auto terms = static_cast<std::uint32_t>(of_.terms());
    const float rate = of_.grid ? kGridRate * step.rate : step.rate;
    const gpu::ExposureUpdateArgs args{step.photo,
                                       of_.photos,
                                       of_.grid ? 1 : groups_of(step.pixels),
                                       terms,
                                       static_cast<float>(rate / correction1),
                                       static_cast<float>(1.0 / std::sqrt(correction2))};
    const Groups g = groups_for(terms);
    commands.dispatch(update_, args, {partials(place), maps_, moments_, status}, g.x, g.y);
}

std::vector<float> Exposure::gradient(int place) const {
    return partials_.download<float>(gradient_floats(),
                                     gradient_bytes_of(of_) * static_cast<std::uint64_t>(place));
}

std::size_t Exposure::gradient_floats() const {
    return gradient_floats_of(of_);
}

void Exposure::set_gradient(int place, const std::vector<float>& values) {
    DARB_CHECK(values.size() == gradient_floats(), "{} floats", values.size());
    partials_.upload(values, gradient_bytes_of(of_) * static_cast<std::uint64_t>(place));
}

std::vector<ColourMap> Exposure::maps() const {
    const std::size_t each = of_.terms() / EXPOSURE_TERMS;
    const auto values = maps_.download<float>(of_.photos * of_.terms());
    std::vector<ColourMap> maps(of_.photos);
    for (std::size_t p = 0; p < maps.size(); ++p)
        for (std::size_t k = 0; k < EXPOSURE_TERMS; ++k) {
            double sum = 0;
            for (std::size_t m = 0; m < each; ++m)
                sum += double{values[(p * each + m) * EXPOSURE_TERMS + k]};
            maps[p][k] = static_cast<float>(sum / static_cast<double>(each));
        }
    return maps;
}

std::vector<float> Exposure::state() const {
    auto values = maps_.download<float>(of_.photos * of_.terms());
    const auto moments = moments_.download<float>(of_.photos * of_.terms() * 2);
    values.insert(values.end(), moments.begin(), moments.end());
    return values;
}

void Exposure::restore(const std::vector<float>& state) {
    if (state.size() != of_.state_size())
        throw Error("exposure", fmt::format("{} values for {} photos", state.size(), of_.photos),
                    "Restore what state() gave for as many photos.");
    const auto middle = state.begin() + static_cast<std::ptrdiff_t>(of_.photos * of_.terms());
    maps_.upload(std::vector<float>(state.begin(), middle));
    moments_.upload(std::vector<float>(middle, state.end()));
}

}  // namespace darb
