#include "trainer/exposure.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "engine/core/check.h"
#include "engine/core/error.h"
#include "engine/primitives/groups.h"
#include "shaders/shared/effect_args.h"
#include "shaders/shared/render_args.h"

namespace darb {

namespace {

std::uint32_t groups_of(std::uint32_t pixels) {
    return std::clamp((pixels + EXPOSURE_THREADS - 1) / EXPOSURE_THREADS, 1u,
                      static_cast<std::uint32_t>(EXPOSURE_MAX_GROUPS));
}

gpu::ExposureArgs args_of(const ExposedPicture& picture, std::uint32_t photo,
                          std::uint32_t pixels) {
    const glm::vec3& b = picture.background;
    return {pixels, photo, groups_of(pixels), b.r, b.g, b.b};
}

constexpr std::uint64_t kGradientFloats = EXPOSURE_MAX_GROUPS * EXPOSURE_TERMS;
constexpr std::uint64_t kGradientBytes = kGradientFloats * sizeof(float);
static_assert(kGradientBytes % 256 == 0);  // where a binding may begin

}  // namespace

Exposure::Exposure(Device& device, std::uint32_t photos, std::uint64_t pixels, int batch)
    : photos_(photos),
      map_(device, "exposure", {{"THREADS", SPLAT_GROUP}}),
      backward_(device, "exposure_backward", {}, false),
      update_(device, "exposure_update", {}, false) {
    make_buffers(device, *this, buffers(photos, pixels, batch), "exposure");
    std::vector<float> start;
    for (std::uint32_t p = 0; p < photos; ++p)
        start.insert(start.end(), kIdentityColours.begin(), kIdentityColours.end());
    start.resize(state_size(photos));
    restore(start);
}

BufferList<Exposure> Exposure::buffers(std::uint64_t photos, std::uint64_t pixels, int batch) {
    return {{&Exposure::maps_, "exposure maps", photos * EXPOSURE_TERMS * 4},
            {&Exposure::moments_, "exposure moments", photos * EXPOSURE_TERMS * 8},
            {&Exposure::mapped_, "mapped image", pixels * 12},
            {&Exposure::partials_, "exposure partials",
             kGradientBytes * static_cast<std::uint64_t>(batch)}};
}

std::uint64_t Exposure::device_bytes(std::uint32_t photos, std::uint64_t pixels, int batch) {
    return charged_bytes(buffers(photos, pixels, batch));
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
    const std::uint32_t groups = groups_of(step.pixels);
    const BufferRange partials(partials_, kGradientBytes * static_cast<std::uint64_t>(place),
                               kGradientBytes);
    commands.dispatch(backward_, args_of(picture, step.photo, step.pixels),
                      {maps_, picture.image, d_image, partials, picture.transmittance}, groups);
}

void Exposure::record_step(Commands& commands, const Buffer& status, const ExposureStep& step,
                           int place) {
    commands.pass("exposure");
    const double correction1 = 1.0 - std::pow(0.9, step.visits),
                 correction2 = 1.0 - std::pow(0.999, step.visits);
    const gpu::ExposureUpdateArgs args{step.photo, photos_, groups_of(step.pixels),
                                       static_cast<float>(step.rate / correction1),
                                       static_cast<float>(1.0 / std::sqrt(correction2))};
    const BufferRange partials(partials_, kGradientBytes * static_cast<std::uint64_t>(place),
                               kGradientBytes);
    commands.dispatch(update_, args, {partials, maps_, moments_, status}, 1);
}

std::vector<float> Exposure::gradient(int place) const {
    return partials_.download<float>(kGradientFloats,
                                     kGradientBytes * static_cast<std::uint64_t>(place));
}

std::size_t Exposure::gradient_floats() {
    return kGradientFloats;
}

void Exposure::set_gradient(int place, const std::vector<float>& values) {
    DARB_CHECK(values.size() == kGradientFloats, "{} floats", values.size());
    partials_.upload(values, kGradientBytes * static_cast<std::uint64_t>(place));
}

std::vector<ColourMap> Exposure::maps() const {
    const auto values = maps_.download<float>(std::size_t{photos_} * EXPOSURE_TERMS);
    std::vector<ColourMap> maps(photos_);
    for (std::size_t p = 0; p < maps.size(); ++p)
        std::copy_n(values.begin() + static_cast<std::ptrdiff_t>(p * EXPOSURE_TERMS),
                    EXPOSURE_TERMS, maps[p].begin());
    return maps;
}

std::vector<float> Exposure::state() const {
    auto values = maps_.download<float>(std::size_t{photos_} * EXPOSURE_TERMS);
    const auto moments = moments_.download<float>(std::size_t{photos_} * EXPOSURE_TERMS * 2);
    values.insert(values.end(), moments.begin(), moments.end());
    return values;
}

void Exposure::restore(const std::vector<float>& state) {
    if (state.size() != state_size(photos_))
        throw Error("exposure", fmt::format("{} values for {} photos", state.size(), photos_),
                    "Restore what state() gave for as many photos.");
    const auto middle = state.begin() + std::ptrdiff_t{EXPOSURE_TERMS} * photos_;
    maps_.upload(std::vector<float>(state.begin(), middle));
    moments_.upload(std::vector<float>(middle, state.end()));
}

}  // namespace darb
