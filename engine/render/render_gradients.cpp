#include "engine/render/render_gradients.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

#include "engine/core/error.h"
#include "engine/raster/backward.h"
#include "engine/raster/forward.h"
#include "engine/raster/frame_buffers.h"
#include "engine/render/frame_exchange.h"
#include "engine/render/renderer.h"
#include "engine/scene/splat_shapes.h"

namespace darb {

namespace {

const SplatModel& checked(const Device& device, const SplatModel& model) {
    check_splat_shapes(model);
    const std::uint32_t most = GpuSplats::max_count(device, model.sh_degree, false);
    if (model.size() > most)
        throw Error("splat model",
                    fmt::format("{} splats, this device holds {}", model.size(), most),
                    "Leave some out, or lower the degree of harmonics.");
    return model;
}

void check_camera(const Camera& camera, const glm::vec3& background) {
    bool finite = true;
    for (const double value : {camera.fx, camera.fy, camera.cx, camera.cy})
        finite = finite && std::isfinite(value);
    for (int i = 0; i < 3; ++i) {
        finite = finite && std::isfinite(camera.translation[i]) && std::isfinite(background[i]);
        for (int k = 0; k < 3; ++k) finite = finite && std::isfinite(camera.rotation[i][k]);
    }
    if (!finite)
        throw Error("camera", "a number of it or of the background is not finite",
                    "Check pose, focal lengths and principal point.");
    if (camera.width < 1 || camera.height < 1 || !(camera.fx > 0) || !(camera.fy > 0))
        throw Error("camera",
                    fmt::format("{} x {} px, focal lengths {} and {}", camera.width, camera.height,
                                camera.fx, camera.fy),
                    "A picture has pixels and positive focal lengths.");
}

std::vector<float> planes_of(const ImageF& d_image, const ImageF& image) {
    if (d_image.width != image.width || d_image.height != image.height || d_image.channels != 3 ||
        d_image.data.size() != size_t(image.width) * image.height * 3)
        throw Error(
            "dL/d(image)",
            fmt::format("is {} x {} px of {} channels, the picture {} x {} of 3", d_image.width,
                        d_image.height, d_image.channels, image.width, image.height),
            "Give a value for each channel of each pixel.");
    const size_t pixels = d_image.data.size() / 3;
    std::vector<float> planes(d_image.data.size());
    for (size_t i = 0; i < planes.size(); ++i) {
        if (!std::isfinite(d_image.data[i]))
            throw Error("dL/d(image)",
                        fmt::format("is {} at pixel ({}, {}), channel {}", d_image.data[i],
                                    i / 3 % static_cast<size_t>(image.width),
                                    i / 3 / static_cast<size_t>(image.width), i % 3),
                        "Check the loss.");
        planes[i % 3 * pixels + i / 3] = d_image.data[i];
    }
    return planes;
}

ForwardOptions options_of(const SplatModel& model, bool lens) {
    ForwardOptions options;
    options.kernel = model.kernel;
    options.footprint = model.footprint;
    options.store_for_backward = true;
    options.effects.antialias = model.antialias;
    options.effects.lens = lens;
    return options;
}

}  // namespace

struct GradientRenderer::State {
    Device& device;
    SplatModel header;  // of no splats
    GradientOptions options;
    GpuSplats splats;
    FrameExchange exchange;
    Commands commands;
    GradientBuffers gradients;
    std::optional<ForwardOptions> drawn_with;  // with a lens or without, as the last camera
    std::optional<FrameBuffers> buffers;
    std::optional<Forward> forward;
    std::optional<Backward> backward;
    Buffer d_image;
    FrameView view{};
    ImageF image;  // the last picture; no pixels before it

    State(Device& on, const SplatModel& model, const GradientOptions& asked)
        : device(on),
          options(asked),
          splats(on, checked(on, model), false),
          exchange(on),
          commands(on),
          gradients(on, splats) {
        header.sh_degree = model.sh_degree;
        header.kernel = model.kernel;
        header.footprint = model.footprint;
        header.antialias = model.antialias;
        header.origin = model.origin;
    }
    int degree() const {
        const int asked = options.sh_degree;
        return asked < 0 ? header.sh_degree : std::min(asked, header.sh_degree);
    }
};

GradientRenderer::GradientRenderer(Device& device, const SplatModel& model,
                                   const GradientOptions& options)
    : state_(std::make_unique<State>(device, model, options)) {}
GradientRenderer::~GradientRenderer() = default;
GradientRenderer::GradientRenderer(GradientRenderer&&) noexcept = default;
GradientRenderer& GradientRenderer::operator=(GradientRenderer&&) noexcept = default;

void GradientRenderer::update(const SplatModel& model) {
    State& s = *state_;
    check_splat_shapes(model);
    if (model.size() != s.splats.count() || model.sh_degree != s.header.sh_degree ||
        model.kernel != s.header.kernel || model.footprint != s.header.footprint ||
        model.antialias != s.header.antialias || model.origin != s.header.origin)
        throw Error("splat model", "is of other splats than the one on the device",
                    "Make another GradientRenderer for it.");
    for (int a = 0; a < kAttributeCount; ++a) {
        const std::vector<float>& values = attribute_values(model, a);
        if (values.size() != size_t{s.splats.count()} * s.splats.stride(a))
            throw Error("splat model", fmt::format("{} came or went", attribute_name(a)),
                        "Make another GradientRenderer for it.");
        if (!values.empty()) s.splats.parameters(a).upload(values);
    }
    s.image = {};
}

ImageF GradientRenderer::render(const Camera& camera, const glm::vec3& background) {
    State& s = *state_;
    check_camera(camera, background);
    s.image = {};
    if (!s.drawn_with || s.drawn_with->effects.lens != camera.lens.active) {
        s.drawn_with = options_of(s.header, camera.lens.active);
        s.buffers.emplace(s.device, *s.drawn_with);
        s.forward.emplace(s.device, *s.drawn_with);
        s.backward.emplace(s.device, *s.drawn_with);
    }
    s.view = {camera_data(camera, s.header.origin, s.options.near_plane), &s.exchange.cameras(), 0,
              s.degree(), background};
    Frame& frame = s.buffers->frame();
    s.buffers->reserve(s.splats.count(), std::max(frame.size.intersections, s.splats.count() * 4),
                       camera.width, camera.height);
    do {
        s.commands.begin();
        s.exchange.send(s.commands, s.view.camera);
        s.forward->record(s.commands, s.splats, s.view, frame);
        s.exchange.fetch(s.commands, frame.counters.status);
        s.commands.submit_and_wait();
    } while (s.buffers->make_room(s.exchange.status()));
    const size_t floats = size_t(camera.width) * camera.height * 3;
    s.image =
        planes_to_image(frame.images.image.download<float>(floats), camera.width, camera.height);
    return s.image;
}

ViewGradients GradientRenderer::backward(const ImageF& d_image) {
    State& s = *state_;
    if (s.image.width == 0)
        throw Error("gradients", "no picture was rendered of these splats", "Call render() first.");
    const std::vector<float> planes = planes_of(d_image, s.image);
    const std::uint64_t bytes = planes.size() * sizeof(float);
    if (s.d_image.bytes() < bytes) s.d_image = Buffer(s.device, "d_image", bytes);
    s.d_image.upload(planes);
    const Frame& frame = s.buffers->frame();
    s.backward->reserve(s.splats.count(), frame.size.intersections, frame.checkpoint_records());
    s.commands.begin();
    s.backward->record_gradients(s.commands, s.view, frame, s.splats, s.d_image, s.gradients,
                                 false);
    s.exchange.fetch(s.commands, frame.counters.status);
    s.commands.submit_and_wait();
    ViewGradients view;
    view.image = std::exchange(s.image, {});  // long lists are walked back in the frame's buffers
    view.status = s.exchange.status();
    for (int a = 0; a < kAttributeCount; ++a) attribute_values(view.d, a) = s.gradients.download(a);
    const size_t n = s.splats.count();
    const auto shown = n > 0 ? s.gradients.views().download<float>(2 * n) : std::vector<float>{};
    for (size_t i = 0; i < n; ++i) {
        view.mean_gradient_ndc.push_back(shown[2 * i]);
        view.shown.push_back(shown[2 * i + 1] != 0 ? 1 : 0);
    }
    return view;
}

ViewGradients render_with_gradients(Device& device, const SplatModel& model, const Camera& camera,
                                    const glm::vec3& background, const ImageGradient& d_image,
                                    const GradientOptions& options) {
    GradientRenderer renderer(device, model, options);
    return renderer.backward(d_image(renderer.render(camera, background)));
}

}  // namespace darb
