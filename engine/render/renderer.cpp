// SPDX-License-Identifier: MIT
#include "engine/render/renderer.h"

#include <algorithm>
#include <cstring>

#include "engine/core/error.h"
#include "engine/primitives/groups.h"
#include "engine/raster/frame_view.h"
#include "shaders/shared/render_args.h"

namespace darb {

FrameExchange::FrameExchange(Device& device)
    : cameras_(device, "cameras", sizeof(gpu::CameraData)),
      camera_host_(device, "camera of the host", sizeof(gpu::CameraData), Memory::host),
      status_host_(device, "status result", sizeof(gpu::FrameStatus), Memory::host) {}

void FrameExchange::send(Commands& commands, const gpu::CameraData& camera) {
    std::memcpy(camera_host_.mapped(), &camera, sizeof camera);
    commands.copy(camera_host_, cameras_, sizeof camera);
}

void FrameExchange::fetch(Commands& commands, const Buffer& status) {
    commands.copy(status, status_host_, sizeof(gpu::FrameStatus));
}

gpu::FrameStatus FrameExchange::status() const {
    gpu::FrameStatus result{};
    std::memcpy(&result, status_host_.mapped(), sizeof result);
    return result;
}

Camera resized(const Camera& camera, int width, int height) {
    const double sx = double(width) / camera.width, sy = double(height) / camera.height;
    Camera c = camera;
    c.fx *= sx;
    c.cx *= sx;
    c.fy *= sy;
    c.cy *= sy;
    c.width = width;
    c.height = height;
    return c;
}

Camera halved(const Camera& camera) {
    return resized(camera, (camera.width + 1) / 2, (camera.height + 1) / 2);
}

Upsample::Upsample(Device& device)
    : device_(&device), pipeline_(device, "upsample", {{"THREADS", SPLAT_GROUP}}) {}

const Buffer& Upsample::record(Commands& commands, const Buffer& image, const Camera& rendered,
                               const Camera& shown) {
    const std::uint64_t pixels = std::uint64_t(shown.width) * shown.height;
    check_frame(*device_, shown.width, shown.height);
    if (!image_ || image_.bytes() < pixels * 12)
        image_ = Buffer(*device_, "upsampled image", pixels * 12);
    const gpu::UpsampleArgs args{
        static_cast<std::uint32_t>(rendered.width), static_cast<std::uint32_t>(rendered.height),
        static_cast<std::uint32_t>(shown.width), static_cast<std::uint32_t>(shown.height)};
    const Groups g = groups_for(pixels);
    commands.pass("upsample");
    commands.dispatch(pipeline_, args, {image, image_}, g.x, g.y);
    return image_;
}

namespace {

FrameAccuracy frame_of(const SplatModel& model, const Accuracy& accuracy,
                       const ProjectionEffects& effects, HugeSplatPath huge_splat_path) {
    FrameAccuracy frame = frame_accuracy(accuracy, model);
    frame.options.effects = effects;
    frame.options.huge_splat_path = huge_splat_path;
    frame.options.effects.antialias = model.antialias;
    return frame;
}

FrameAccuracy frame_of(const SplatModel& model, ForwardOptions options) {
    FrameAccuracy frame = frame_accuracy({}, model);
    options.kernel = frame.options.kernel;
    options.footprint = frame.options.footprint;
    options.effects.antialias = model.antialias;
    frame.options = options;
    return frame;
}

}  // namespace

ImageF planes_to_image(const std::vector<float>& planes, int width, int height) {
    ImageF image(width, height, 3);
    const size_t plane = size_t(width) * height;
    for (size_t p = 0; p < plane; ++p)
        for (size_t c = 0; c < 3; ++c) image.data[p * 3 + c] = planes[c * plane + p];
    return image;
}

ImageF depth_image(const std::vector<float>& planes, int width, int height) {
    const size_t pixels = size_t(width) * height;
    ImageF result(width, height, 2);
    for (size_t p = 0; p < pixels; ++p) {
        const float weight = planes[pixels + p];
        result.data[2 * p] = weight >= 1.0f / 255 ? planes[p] / weight : 0.0f;
        result.data[2 * p + 1] = weight;
    }
    return result;
}

Renderer::Renderer(Device& device, const SplatModel& model, const Accuracy& accuracy,
                   const ProjectionEffects& effects, HugeSplatPath huge_splat_path)
    : Renderer(device, model, frame_of(model, accuracy, effects, huge_splat_path)) {}

Renderer::Renderer(Device& device, const SplatModel& model, const ForwardOptions& options)
    : Renderer(device, model, frame_of(model, options)) {}

Renderer::Renderer(Device& device, const SplatModel& model, const FrameAccuracy& accuracy)
    : device_(&device),
      accuracy_(accuracy),
      splats_(device, model, false),
      buffers_(device, accuracy_.options),
      forward_(device, accuracy_.options),
      exchange_(device),
      commands_(device) {
    if (accuracy_.halved) upsample_.emplace(device);
}

ImageF Renderer::render(const Camera& camera, const glm::vec3& background, int sh_degree,
                        float near_plane) {
    const Buffer& image = draw(camera, background, sh_degree, near_plane);
    const size_t floats = size_t(camera.width) * camera.height * 3;
    return planes_to_image(image.download<float>(floats), camera.width, camera.height);
}

const Buffer& Renderer::draw(const Camera& camera, const glm::vec3& background, int sh_degree,
                             float near_plane) {
    const Camera rendered = accuracy_.halved ? halved(camera) : camera;
    if (camera.lens.active && !forward_.options().effects.lens)
        throw Error("render", "the camera has a lens, but the effect is off",
                    "Turn ProjectionEffects::lens on, or drop the camera's lens.");
    if (camera.shutter.active && !forward_.options().effects.shutter)
        throw Error("render", "the camera's shutter rolls, but the effect is off",
                    "Turn ProjectionEffects::shutter on, or drop the camera's shutter.");
    const int degree =
        sh_degree < 0 ? accuracy_.sh_degree : std::min(sh_degree, accuracy_.sh_degree);
    const Buffer* image = nullptr;
    run_frame(rendered, background, degree, near_plane, [&](Frame& frame) {
        forward_.record(commands_, splats_, view_, frame);
        image = upsample_ ? &upsample_->record(commands_, frame.images.image, rendered, camera)
                          : &frame.images.image;
    });
    return *image;
}

void Renderer::list(const Camera& camera, float near_plane) {
    DARB_CHECK(!camera.lens.active || forward_.options().effects.lens);
    DARB_CHECK(!camera.shutter.active || forward_.options().effects.shutter);
    run_frame(camera, glm::vec3(0.0f), 0, near_plane, [&](Frame& frame) {
        forward_.record_intersections(commands_, splats_, view_, frame);
    });
}

void Renderer::run_frame(const Camera& rendered, const glm::vec3& background, int degree,
                         float near_plane, const std::function<void(Frame&)>& record) {
    view_ = {camera_data(rendered, splats_.origin(), near_plane), &exchange_.cameras(), 0, degree,
             background};
    Frame& frame = buffers_.frame();
    buffers_.reserve(splats_.count(), std::max(frame.size.intersections, splats_.count() * 4),
                     rendered.width, rendered.height);
    for (;;) {
        commands_.begin();
        exchange_.send(commands_, view_.camera);
        record(frame);
        exchange_.fetch(commands_, frame.counters.status);
        commands_.submit_and_wait();
        status_ = exchange_.status();
        if (!buffers_.make_room(status_)) break;
    }
    pass_times_ = commands_.pass_times();
}

ImageF Renderer::render_depth() {
    if (view_.camera.width == 0)
        throw Error("render", "there is no picture to take depths from", "Call render() first.");
    const int width = static_cast<int>(view_.camera.width);
    const int height = static_cast<int>(view_.camera.height);
    commands_.begin();
    forward_.record_depth(commands_, splats_.count(), view_, buffers_.frame());
    commands_.submit_and_wait();
    pass_times_ = commands_.pass_times();
    const size_t floats = 2 * size_t(width) * size_t(height);
    return depth_image(buffers_.frame().images.image.download<float>(floats), width, height);
}

ImageF Renderer::render_depth(DepthReading reading, float level) {
    if (reading == DepthReading::expected) return render_depth();
    if (view_.camera.width == 0)
        throw Error("render", "there is no picture to take depths from", "Call render() first.");
    std::optional<MedianDepth>& median = median_[static_cast<std::size_t>(reading)];
    if (!median) median.emplace(*device_, forward_.options(), reading);
    commands_.begin();
    median->record(commands_, splats_, view_, buffers_.frame(), status_.longest_list, level);
    commands_.submit_and_wait();
    pass_times_ = commands_.pass_times();
    ImageF image(static_cast<int>(view_.camera.width), static_cast<int>(view_.camera.height), 2);
    image.data = median->depth().download<float>(image.data.size());
    return image;
}

std::vector<float> Renderer::light_at(std::span<const ViewPoint> points, DepthReading reading) {
    if (view_.camera.width == 0)
        throw Error("render", "there is no camera to take the light of", "Call list() first.");
    std::optional<PointLight>& light = point_light_[static_cast<std::size_t>(reading)];
    if (!light) light.emplace(*device_, forward_.options(), reading);
    return light->find(commands_, splats_, view_, buffers_.frame(), status_.longest_list, points);
}

}  // namespace darb
