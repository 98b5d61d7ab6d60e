// SPDX-License-Identifier: MIT
#include "trainer/step/photos.h"

#include <fmt/format.h>
#include <algorithm>
#include <cmath>
#include <filesystem>
#include <map>
#include <span>
#include <utility>

#include "engine/core/error.h"
#include "engine/core/quantile.h"
#include "engine/data/depths.h"
#include "engine/primitives/groups.h"
#include "shaders/shared/strategy_args.h"

namespace darb {

Camera divided(const Camera& camera, double divisor) {
    Camera smaller = camera;
    smaller.width = std::max(1, static_cast<int>(std::lround(camera.width / divisor)));
    smaller.height = std::max(1, static_cast<int>(std::lround(camera.height / divisor)));
    const double x = double(smaller.width) / camera.width,
                 y = double(smaller.height) / camera.height;
    smaller.fx *= x;
    smaller.cx *= x;
    smaller.fy *= y;
    smaller.cy *= y;
    return smaller;
}

std::vector<std::uint32_t> exposure_numbers(const std::vector<View>& views) {
    std::vector<std::uint32_t> numbers;
    std::map<std::filesystem::path, std::uint32_t> panoramas;
    std::uint32_t count = 0;
    for (const View& view : views) {
        if (view.is_test) continue;
        const bool known = view.face >= 0 && !panoramas.try_emplace(view.photo, count).second;
        numbers.push_back(known ? panoramas.at(view.photo) : count++);
    }
    return numbers;
}

std::uint32_t exposure_count(const std::vector<View>& views) {
    const std::vector<std::uint32_t> numbers = exposure_numbers(views);
    return numbers.empty() ? 0 : *std::ranges::max_element(numbers) + 1;
}

ResolutionRamp::ResolutionRamp(Device& device)
    : device_(&device),
      commands_(device),
      pipeline_(device, "downsample_photo", {{"THREADS", SPLAT_GROUP}}) {}

Buffer ResolutionRamp::downsample(const Buffer& photo, const Camera& camera, const Camera& smaller,
                                  Memory memory) {
    const gpu::DownsampleArgs args{
        static_cast<std::uint32_t>(camera.width), static_cast<std::uint32_t>(camera.height),
        static_cast<std::uint32_t>(smaller.width), static_cast<std::uint32_t>(smaller.height)};
    const std::uint64_t pixels = std::uint64_t{args.out_width} * args.out_height;
    const bool depths = photo.bytes() >= std::uint64_t{args.width} * args.height * 8;
    if (depths && !depths_)
        depths_ = Pipeline(*device_, "downsample_photo", {{"THREADS", SPLAT_GROUP}, {"DEPTHS", 1}});
    Buffer result(*device_, "smaller " + photo.name(), pixels * (depths ? 8 : 4), memory);
    const Groups g = groups_for(pixels);
    commands_.begin();
    commands_.pass("downsample");
    commands_.dispatch(depths ? depths_ : pipeline_, args, {photo, result}, g.x, g.y);
    commands_.submit_and_wait();
    return result;
}

namespace {

constexpr const char* kFromLoadPhotos =
    "Give RGBA of each view's size, in the order of the views, as load_photos does.";
constexpr size_t kDepthStep = 16;  // every so many pixels are looked at for the usual depth

ImageF depth_in_world(const View& view, double scale) {
    ImageF depth = load_depth(view);
    for (float& d : depth.data) d = static_cast<float>(d * scale);
    return depth;
}

}  // namespace

TrainingPhotos::TrainingPhotos(Device& device, const Dataset& dataset,
                               const std::vector<ImageU8>& photos, const glm::dvec3& origin,
                               bool stream, bool depths)
    : device_(&device),
      origin_(origin),
      nearest_(nearest_points(dataset)),
      exposure_of_(exposure_numbers(dataset.views)),
      exposures_(exposure_count(dataset.views)),
      memory_(stream ? Memory::waiting : Memory::device) {
    if (photos.size() != dataset.views.size())
        throw Error("training photos",
                    fmt::format("{} for {} views", photos.size(), dataset.views.size()),
                    kFromLoadPhotos);
    std::vector<double> sample;
    for (size_t i = 0; i < dataset.views.size(); ++i) {
        const View& view = dataset.views[i];
        view_cameras_.push_back(view.camera);
        names_.push_back(view.name);
        width_ = std::max(width_, view.camera.width);
        height_ = std::max(height_, view.camera.height);
        whole_.data.push_back(camera_data(view.camera, origin_));
        whole_.photos.emplace_back();
        measured_.push_back(depths && !view.is_test && !view.depth.empty());
        if (view.is_test) continue;
        views_.push_back(static_cast<int>(i));
        const std::uint64_t count = std::uint64_t(view.camera.width) * view.camera.height;
        if (photos[i].channels != 4 || photos[i].data.size() != count * 4)
            throw Error(
                view.name,
                fmt::format("is {}x{}x{} for a camera of {}x{}", photos[i].width, photos[i].height,
                            photos[i].channels, view.camera.width, view.camera.height),
                kFromLoadPhotos);
        const ImageF depth =
            measured_.back() ? depth_in_world(view, dataset.depth_scale) : ImageF();
        upload(view, photos[i], depth);
        for (size_t p = i % kDepthStep; p < depth.data.size(); p += kDepthStep)
            if (depth.data[p] > 0) sample.push_back(depth.data[p]);
        pixels_ = std::max(pixels_, count);
    }
    longest_side_ = std::max(width_, height_);
    if (views_.empty())
        throw Error(dataset.root.string(), "no photo is left to train on",
                    "Every view is held out: add photos, or leave out --eval of darb train.");
    if (!sample.empty()) usual_depth_ = nearest_rank(sample, 0.5);
    whole_.cameras = upload_cameras(device, whole_.data);
    if (!stream) return;
    const bool any = std::find(measured_.begin(), measured_.end(), true) != measured_.end();
    for (Place& place : places_)
        place.pixels = Buffer(device, "photo of a step", pixels_ * (any ? 8 : 4));
}

void TrainingPhotos::upload(const View& view, const ImageU8& photo, const ImageF& depth) {
    const std::uint64_t colours = photo.data.size(), more = depth.data.size() * sizeof(float);
    Buffer& buffer = whole_.photos.back();
    buffer = Buffer(*device_, "photo " + view.name, colours + more, memory_);
    buffer.upload(std::as_bytes(std::span(photo.data)));
    if (more > 0) buffer.upload(std::as_bytes(std::span(depth.data)), colours);
}

TrainingView TrainingPhotos::view(int view, int sh_degree, const glm::vec3& background) const {
    const Size& size = divisor_ > 1 ? small_ : whole_;
    const auto photo = std::lower_bound(views_.begin(), views_.end(), view) - views_.begin();
    return {
        {size.data[view], &size.cameras, static_cast<std::uint32_t>(view), sh_degree, background},
        static_cast<std::uint32_t>(photo),
        &size.photos[view],
        measured_[static_cast<size_t>(view)],
        exposure_of_[static_cast<size_t>(photo)]};
}

void TrainingPhotos::fill(Commands& commands, Place& place, int view) {
    const Buffer& photo = (divisor_ > 1 ? small_ : whole_).photos[view];
    commands.copy(photo, place.pixels, photo.bytes());
    place.view = view;
}

const Buffer& TrainingPhotos::place(Commands& commands, const TrainingView& view, int next) {
    if (!stream()) return *view.pixels;
    if (std::exchange(pending_, true))
        for (Place& place : places_) place.view = -1;
    const int wanted = static_cast<int>(view.frame.index);
    commands.pass("photo");
    const bool second = places_[1].view == wanted ||
                        (places_[0].view != wanted && next >= 0 && places_[0].view == next);
    Place &own = places_[second ? 1 : 0], &other = places_[second ? 0 : 1];
    if (own.view != wanted) fill(commands, own, wanted);
    if (next >= 0 && next != wanted && other.view != next) fill(commands, other, next);
    return own.pixels;
}

std::vector<gpu::CameraData> TrainingPhotos::training_cameras() const {
    std::vector<gpu::CameraData> cameras;
    for (const int view : views_) cameras.push_back(whole_.data[view]);
    return cameras;
}

glm::vec3 TrainingPhotos::mean_centre() const {
    glm::vec3 centre(0);
    for (const int view : views_)
        centre += whole_.data[view].centre / static_cast<float>(views_.size());
    return centre;
}

void TrainingPhotos::set_divisor(int divisor) {
    const auto make_whole = [this] {
        divisor_ = 1;
        small_ = {};
        for (Place& place : places_) place.view = -1;
    };
    make_whole();
    if (divisor == 1) return;
    ResolutionRamp ramp(*device_);
    try {
        make_smaller(ramp, divisor);
    } catch (const NoRoom&) {
        make_whole();
        room_for_smaller_ = false;
    }
}

void TrainingPhotos::make_smaller(ResolutionRamp& ramp, int divisor) {
    divisor_ = divisor;
    for (size_t v = 0; v < view_cameras_.size(); ++v) {
        const Camera& camera = view_cameras_[v];
        const Camera smaller = divided(camera, divisor);
        small_.data.push_back(camera_data(smaller, origin_));
        small_.photos.emplace_back();
        if (whole_.photos[v])
            small_.photos.back() = ramp.downsample(whole_.photos[v], camera, smaller, memory_);
    }
    small_.cameras = upload_cameras(*device_, small_.data);
}

void TrainingPhotos::set_cameras(const std::vector<Camera>& cameras) {
    DARB_CHECK(cameras.size() == view_cameras_.size());
    view_cameras_ = cameras;
    const auto place = [&](Size& size, int divisor) {
        for (std::size_t v = 0; v < cameras.size(); ++v)
            size.data[v] =
                camera_data(divisor > 1 ? divided(cameras[v], divisor) : cameras[v], origin_);
        size.cameras.upload(size.data);
    };
    place(whole_, 1);
    if (divisor_ > 1) place(small_, divisor_);
}

std::uint64_t TrainingPhotos::small_pixels() const {
    std::uint64_t pixels = 0;
    for (const Buffer& photo : small_.photos) pixels += photo.bytes() / 4;
    return pixels;
}

}  // namespace darb
