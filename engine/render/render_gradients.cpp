// SPDX-License-Identifier: MIT
#include "engine/render/render_gradients.h"

#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <functional>
#include <optional>
#include <span>
#include <utility>

#include "engine/core/error.h"
#include "engine/core/on_threads.h"
#include "engine/core/streaming.h"
#include "engine/raster/backward.h"
#include "engine/raster/forward.h"
#include "engine/raster/frame_buffers.h"
#include "engine/raster/frame_view.h"
#include "engine/render/renderer.h"
#include "engine/scene/splat_model.h"

namespace darb {

CameraGradient camera_gradient(const Camera& camera, std::span<const float> shares,
                               std::span<const float> d_position) {
    CameraTotals sum{};
    for (std::size_t i = 0; i < shares.size(); ++i) sum[i % CAMERA_SHARES] += double(shares[i]);
    for (std::size_t i = 0; i < d_position.size(); ++i)
        sum[CAMERA_SHARES + i % 3] += double(d_position[i]);
    return camera_gradient(camera, sum);
}

CameraGradient camera_gradient(const Camera& camera, const CameraTotals& sum) {
    const glm::dvec3 d_centre(-sum[CAMERA_SHARES], -sum[CAMERA_SHARES + 1],
                              -sum[CAMERA_SHARES + 2]);

    // The centre is -R^-1 t: d(centre) = -R^-1 (dt + dR centre).
    CameraGradient g;
    g.d_translation = -(camera.rotation * d_centre);
    const glm::dvec3 centre = camera.centre();
    for (int row = 0; row < 3; ++row)
        for (int column = 0; column < 3; ++column) {
            const int entry = 3 * row + column;
            g.d_rotation[column][row] =
                sum[static_cast<std::size_t>(entry)] + g.d_translation[row] * centre[column];
        }
    g.d_fx = sum[9];
    g.d_fy = sum[10];
    g.d_cx = sum[11];
    g.d_cy = sum[12];
    for (int c = 0; c < 3; ++c) {
        const auto at =
            static_cast<std::size_t>(CAMERA_SHARE_SHUTTER) + static_cast<std::size_t>(c);
        g.d_turn[c] = sum[at];
        g.d_move[c] = sum[at + 3];
    }
    return g;
}

namespace {

const SplatModel& checked(const Device& device, const SplatModel& model) {
    check_splat_shapes(model);
    const std::uint32_t most = GpuSplats::max_count(device, model.sh_degree, false);
    if (model.size() > most)
        throw Error(
            "splat model",
            fmt::format("has {} splats, but this device holds {} at most", model.size(), most),
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
        throw Error("camera", "one of its numbers, or of the background's, is not finite",
                    "Check pose, focal lengths and principal point.");
    if (camera.width < 1 || camera.height < 1 || !(camera.fx > 0) || !(camera.fy > 0))
        throw Error("camera",
                    fmt::format("has {} x {} px and focal lengths of {} and {} px", camera.width,
                                camera.height, camera.fx, camera.fy),
                    "A picture has pixels and positive focal lengths.");
}

ForwardOptions options_of(const SplatModel& model, const GradientOptions& asked,
                          const Camera& camera) {
    if (asked.direct_colour && model.sh_degree > 0)
        throw Error(
            "splat model",
            fmt::format("has harmonics of degree {} beside direct colours", model.sh_degree),
            "Give either harmonics or direct colours.");
    if (asked.accuracy.value(kRenderScale) < 1)
        throw Error("gradients", "do not exist for a picture that is rendered at half size",
                    "Render at full size.");
    ForwardOptions options = frame_accuracy(asked.accuracy, model).options;
    options.store_for_backward = true;
    options.effects.lens = camera.lens.active;
    options.effects.shutter = camera.shutter.active;
    options.linear_values = asked.linear_values;
    options.direct_colour = asked.direct_colour;
    options.alpha_gradient = true;
    options.camera_gradient = asked.camera;
    return options;
}

// dL/d(background): the background is in the picture times the transmittance.
glm::dvec3 background_gradient(const ImageF& d_image, const ImageF& transmittance) {
    glm::dvec3 sum(0.0);
    for (size_t i = 0; i < transmittance.data.size(); ++i)
        for (int c = 0; c < 3; ++c)
            sum[c] += double(transmittance.data[i]) *
                      double(d_image.data[3 * i + static_cast<size_t>(c)]);
    return sum;
}

}  // namespace

std::vector<float> gradient_planes(const ImageF& d_image, const ImageF& d_alpha, int width,
                                   int height) {
    if (d_image.width != width || d_image.height != height || d_image.channels != 3 ||
        d_image.data.size() != size_t(width) * height * 3)
        throw Error("dL/d(image)",
                    fmt::format("is {} x {} px of {} channels, the picture {} x {} of 3",
                                d_image.width, d_image.height, d_image.channels, width, height),
                    "Give a value for each channel of each pixel.");
    const size_t pixels = d_image.data.size() / 3;
    std::vector<float> planes(4 * pixels);
    for (size_t i = 0; i < d_image.data.size(); ++i) {
        if (!std::isfinite(d_image.data[i]))
            throw Error("dL/d(image)",
                        fmt::format("is {} at pixel ({}, {}), channel {}", d_image.data[i],
                                    i / 3 % static_cast<size_t>(width),
                                    i / 3 / static_cast<size_t>(width), i % 3),
                        "Check the loss.");
        planes[i % 3 * pixels + i / 3] = d_image.data[i];
    }
    if (d_alpha.data.empty()) return planes;
    if (d_alpha.width != width || d_alpha.height != height || d_alpha.data.size() != pixels)
        throw Error("dL/d(alpha)",
                    fmt::format("is {} x {} px of {} channels, the picture {} x {}", d_alpha.width,
                                d_alpha.height, d_alpha.channels, width, height),
                    "Give a value for each pixel.");
    for (size_t i = 0; i < pixels; ++i)
        if (!std::isfinite(planes[3 * pixels + i] = d_alpha.data[i]))
            throw Error("dL/d(alpha)",
                        fmt::format("is {} at pixel ({}, {})", d_alpha.data[i],
                                    i % static_cast<size_t>(width), i / static_cast<size_t>(width)),
                        "Check the loss.");
    return planes;
}

struct GradientRenderer::State {
    Device& device;
    SplatModel header;  // all but the splats
    GradientOptions options;
    GpuSplats splats;
    FrameExchange exchange;
    Commands commands;
    GradientBuffers gradients;
    std::optional<ForwardOptions> drawn_with;  // with lens and shutter as the last camera
    std::optional<FrameBuffers> buffers;
    std::optional<Forward> forward;
    std::optional<Backward> backward;
    Buffer d_image, camera_shares;
    Camera camera;  // camera of the last picture
    FrameView view{};
    ImageF image;  // the last picture; without pixels before the first
    ImageF alpha, transmittance;
    std::vector<PassTime> pass_times;

    State(Device& on, const SplatModel& model, const GradientOptions& asked)
        : device(on),
          options(asked),
          splats(on, checked(on, model), false),
          exchange(on),
          commands(on),
          gradients(on, splats) {
        options_of(model, asked, {});
        header.kernel = model.kernel;
        header.footprint = model.footprint;
        header.antialias = model.antialias;
        note(model);
    }
    void note(const SplatModel& model) {
        header.sh_degree = model.sh_degree;
        header.origin = model.origin;
        image = {};
    }
    int degree() const {
        const int of_frame = frame_accuracy(options.accuracy, header).sh_degree;
        return options.sh_degree < 0 ? of_frame : std::min(options.sh_degree, of_frame);
    }
    bool draws_as(const SplatModel& model) const {
        return model.kernel == header.kernel && model.footprint == header.footprint &&
               model.antialias == header.antialias;
    }
    bool holds_same(const SplatModel& model) const {
        bool same = model.size() == splats.count() && model.sh_degree == header.sh_degree &&
                    model.origin == header.origin;
        for (int a = 0; a < kAttributeCount; ++a)
            same = same && model.floats(a) == splats.stride(a);
        return same;
    }
    void upload(const SplatModel& model) {
        for (int a = 0; a < kAttributeCount; ++a)
            upload_rows(splats.parameters(a), splats.rows(a), attribute_values(model, a));
        image = {};
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
    if (!s.draws_as(model) || !s.holds_same(model))
        throw Error("splat model", "differs from the one on the device in more than its values",
                    "Make another GradientRenderer for it.");
    s.upload(model);
}

void GradientRenderer::replace(const SplatModel& model) {
    State& s = *state_;
    checked(s.device, model);
    if (!s.draws_as(model))
        throw Error("splat model",
                    "has another kernel, footprint or anti-aliasing than the one on the device",
                    "Make another GradientRenderer for it.");
    options_of(model, s.options, {});
    if (s.holds_same(model)) return s.upload(model);
    s.image = {};
    s.splats = GpuSplats(s.device, model, false);
    s.gradients = GradientBuffers(s.device, s.splats);
    s.note(model);
}

bool GradientRenderer::holds(std::size_t count, int sh_degree) const {
    return count == state_->splats.count() && sh_degree == state_->header.sh_degree &&
           state_->header.origin == glm::dvec3(0.0);
}

namespace {

// Rows of a buffer, and where the buffer begins while it is written.
struct RowsTo {
    int attribute;
    AttributeRows rows;
    const float* from;
    std::byte* to = nullptr;
};

// An array of the caller's, and its destination.
struct Source {
    int attribute;
    std::span<const float> values;
    std::size_t floats = 0;  // per splat
    std::vector<RowsTo> targets{};

    void add(const GpuSplats& splats, int target) {
        const AttributeRows rows = splats.rows(target);
        targets.push_back({target, rows, values.data() + floats});
        floats += rows.floats;
    }
};

std::vector<Source> sources_of(const GpuSplats& splats, const GivenValues& given) {
    std::vector<Source> sources;
    for (int a = 0; a < kAttributeCount; ++a) {
        const bool bands = !given.harmonics.empty() && (a == kShDc || a == kShRest);
        if (!bands || a == kShDc)
            sources.push_back(
                {a, bands ? given.harmonics : given.attributes[static_cast<std::size_t>(a)]});
        sources.back().add(splats, a);
    }
    for (const Source& source : sources)
        if (const std::size_t wanted = splats.count() * source.floats;
            source.values.size() != wanted)
            throw Error(attribute_name(source.attribute),
                        fmt::format("has {} values, but {} splats need {}", source.values.size(),
                                    splats.count(), wanted),
                        "Give the values of all splats.");
    return sources;
}

// Calls write() once the beginning of each buffer is known.
void with_buffers(GpuSplats& splats, std::span<RowsTo* const> targets,
                  const std::function<void()>& write) {
    if (targets.empty()) return write();
    RowsTo& first = *targets.front();
    splats.parameters(first.attribute)
        .upload_by(first.rows.bytes(splats.count()), [&](std::byte* to) {
            first.to = to;
            with_buffers(splats, targets.subspan(1), write);
        });
}

constexpr std::size_t kSplatsOfPiece = 256 * ROW_BLOCK;  // splats that one thread takes at a time

}  // namespace

bool GradientRenderer::set_values(const GivenValues& values,
                                  const std::function<bool(int, std::span<const float>)>& accept) {
    State& s = *state_;
    std::vector<Source> sources = sources_of(s.splats, values);
    std::vector<RowsTo*> targets;
    for (Source& source : sources)
        for (RowsTo& target : source.targets)
            if (target.rows.floats > 0) targets.push_back(&target);
    s.image = {};
    const std::size_t n = s.splats.count();
    if (n == 0) return true;
    std::atomic<bool> accepted{true};
    const auto put = [&](const Source& source, std::size_t first, std::size_t count) {
        if (source.floats == 0) return true;
        if (!accept(source.attribute,
                    source.values.subspan(first * source.floats, count * source.floats)))
            return false;
        return std::ranges::all_of(source.targets, [&](const RowsTo& target) {
            return put_rows(target.rows, target.from, source.floats, first, count, target.to);
        });
    };
    with_buffers(s.splats, targets, [&] {
        in_pieces(n, kSplatsOfPiece, [&](std::size_t first, std::size_t count) {
            for (const Source& source : sources)
                if (accepted && !put(source, first, count)) accepted = false;
            stream_fence();
        });
    });
    return accepted;
}

void GradientRenderer::set_view(int sh_degree, float near_plane) {
    state_->options.sh_degree = sh_degree;
    state_->options.near_plane = near_plane;
}

const ImageF& GradientRenderer::render(const Camera& camera, const glm::vec3& background) {
    State& s = *state_;
    check_camera(camera, background);
    check_frame(s.device, camera.width, camera.height, "camera");
    s.image = {};
    s.camera = camera;
    if (!s.drawn_with || s.drawn_with->effects.lens != camera.lens.active ||
        s.drawn_with->effects.shutter != camera.shutter.active) {
        s.drawn_with = options_of(s.header, s.options, camera);
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
    s.pass_times = s.commands.pass_times();
    const size_t pixels = size_t(camera.width) * camera.height;
    s.image = planes_to_image(frame.images.image.download<float>(3 * pixels), camera.width,
                              camera.height);
    s.transmittance = s.alpha = ImageF(camera.width, camera.height, 1);
    frame.images.final_transmittance.download(
        std::as_writable_bytes(std::span(s.transmittance.data)));
    for (size_t i = 0; i < pixels; ++i) s.alpha.data[i] = 1.0f - s.transmittance.data[i];
    return s.image;
}

const ImageF& GradientRenderer::alpha() const {
    return state_->alpha;
}
ImageF GradientRenderer::release_image() {
    ImageF& kept = state_->image;  // its size tells that there is a picture
    ImageF image = std::exchange(kept, {});
    kept.width = image.width;
    kept.height = image.height;
    kept.channels = image.channels;
    return image;
}
ImageF GradientRenderer::release_alpha() {
    return std::exchange(state_->alpha, {});
}
gpu::FrameStatus GradientRenderer::status() const {
    return state_->exchange.status();
}
const std::vector<PassTime>& GradientRenderer::pass_times() const {
    return state_->pass_times;
}
std::uint32_t GradientRenderer::count() const {
    return state_->splats.count();
}

ImageF GradientRenderer::depth() {
    State& s = *state_;
    if (s.image.width == 0)
        throw Error("depth", "no picture was rendered of these splats", "Call render() first.");
    const int width = s.image.width, height = s.image.height;
    s.image = {};
    s.commands.begin();
    s.forward->record_depth(s.commands, s.splats.count(), s.view, s.buffers->frame());
    s.commands.submit_and_wait();
    const size_t floats = 2 * size_t(width) * size_t(height);
    return depth_image(s.buffers->frame().images.image.download<float>(floats), width, height);
}

ViewGradients GradientRenderer::backward(const ImageF& d_image, const ImageF& d_alpha) {
    State& s = *state_;
    if (s.image.width == 0)
        throw Error("gradients", "no picture was rendered of these splats", "Call render() first.");
    const std::vector<float> planes =
        gradient_planes(d_image, d_alpha, s.image.width, s.image.height);
    const std::uint64_t bytes = planes.size() * sizeof(float);
    if (s.d_image.bytes() < bytes) s.d_image = Buffer(s.device, "d_image", bytes);
    s.d_image.upload(planes);
    const Frame& frame = s.buffers->frame();
    const std::uint64_t share_bytes =
        std::uint64_t{s.splats.count()} * CAMERA_SHARES * sizeof(float);
    if (s.options.camera && s.camera_shares.bytes() < std::max<std::uint64_t>(share_bytes, 4))
        s.camera_shares = Buffer(s.device, "camera shares", share_bytes);
    s.backward->reserve(s.splats.count(), frame.size.intersections, frame.checkpoint_records());
    s.commands.begin();
    s.backward->record_gradients(
        s.commands, s.view, frame, s.splats, s.d_image,
        {s.gradients, false, s.options.camera ? &s.camera_shares : nullptr});
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
    view.d_background = background_gradient(d_image, s.transmittance);
    if (!s.options.camera) return view;
    const auto shares =
        n > 0 ? s.camera_shares.download<float>(n * CAMERA_SHARES) : std::vector<float>{};
    view.d_camera = camera_gradient(s.camera, shares, view.d.position);
    view.d_mean.reserve(2 * n);  // moves with the principal point
    for (size_t i = 0; i < n; ++i)
        view.d_mean.insert(view.d_mean.end(),
                           {shares[CAMERA_SHARES * i + CAMERA_SHARE_CENTRE],
                            shares[CAMERA_SHARES * i + CAMERA_SHARE_CENTRE + 1]});
    return view;
}

ViewGradients render_with_gradients(Device& device, const SplatModel& model, const Camera& camera,
                                    const glm::vec3& background, const ImageGradient& d_image,
                                    const GradientOptions& options) {
    GradientRenderer renderer(device, model, options);
    return renderer.backward(d_image(renderer.render(camera, background)));
}

}  // namespace darb
