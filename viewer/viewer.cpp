#include "viewer/viewer.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "engine/core/error.h"
#include "viewer/view_camera.h"

namespace darb {

namespace {

constexpr double kRest_s = 0.12;  // without change, before the picture is refined
constexpr double kLong_ms = 500;  // for a whole picture
constexpr double kStep_s = 1.0 / 60;
constexpr size_t kTimesKept = 60;  // frames in motion that the panel averages over
constexpr int kRehearsals = 8;     // of motion, after the one that compiles
constexpr double kLook_s = 0.1;    // between two looks whether ffmpeg has ended
constexpr double kForever = std::numeric_limits<double>::infinity();

glm::dvec3 start_up(const ViewerOptions& options) {
    if (!options.up.empty()) return up_from_name(options.up);
    glm::dvec3 sum(0.0);
    for (const View& view : options.views) sum -= glm::transpose(view.camera.rotation)[1];
    return glm::length(sum) > 1e-3 ? glm::normalize(sum) : glm::dvec3(0, -1, 0);
}

double milliseconds_since(std::chrono::steady_clock::time_point start) {
    return std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start)
        .count();
}

Camera scaled(const Camera& camera, double scale) {
    const auto px = [&](int full) {
        return std::max(1, static_cast<int>(std::lround(full * scale)));
    };
    return resized(camera, px(camera.width), px(camera.height));
}

}  // namespace

bool Viewer::PictureKey::operator==(const PictureKey& o) const {
    const Camera &a = camera, &b = o.camera;
    return a.width == b.width && a.height == b.height && a.fx == b.fx && a.fy == b.fy &&
           a.cx == b.cx && a.cy == b.cy && a.rotation == b.rotation &&
           a.translation == b.translation && display == o.display && photo == o.photo &&
           split == o.split && version == o.version;
}

Viewer::Viewer(Device& device, ViewerOptions options, GLFWwindow* window)
    : device_(&device),
      options_(std::move(options)),
      canvas_(device),
      gui_(device, canvas_.render_pass(), options_.gui_scale > 0 ? options_.gui_scale : 1, window),
      picture_(device) {
    session_.photos.views = options_.views;
    session_.navigation.set_up(start_up(options_));
    session_.device_name = device.info().name;
    session_.display.accuracy = options_.accuracy;
    // Of each scene that is opened, see show_as_meant.
    session_.display.accuracy.choice[kFootprint] = session_.display.accuracy.choice[kShDegree] = 0;
    session_.gui_scale = options_.gui_scale > 0 ? options_.gui_scale : 1;
    last_frame_ = changed_at_ = Clock::now();
}

Viewer::~Viewer() = default;

void Viewer::choose_camera(int n) {
    const int count = static_cast<int>(session_.photos.views.size());
    if (n < 0 || n >= count)
        throw Error("--camera",
                    count == 0 ? "there is no data set to take a camera from"
                               : fmt::format("{} is not one of 0 to {}", n, count - 1),
                    "Name the data set, or a cameras.json: --cameras DATASET.");
    session_.photos.current = n;
    session_.photos.failed = false;
    session_.requests.frame_all = false;  // asked for by a load before
    session_.navigation.take(session_.photos.views[static_cast<size_t>(n)].camera);
    if (!picture_.empty()) set_pivot(picture_.bounds());
}

// As far as the scene is: orbits turn around it, pans follow the hand.
void Viewer::set_pivot(const Bounds& bounds) {
    Navigation& n = session_.navigation;
    n.distance = std::max(glm::distance(n.eye, bounds.centre), bounds.radius * 0.1);
}

void Viewer::set_gui_scale(float scale) {
    session_.gui_scale = scale;
    gui_.set_scale(scale);
}

void Viewer::leave_photo() {
    session_.photos.current = -1;
    if (session_.display.mode == VIEW_ERROR) session_.display.mode = VIEW_COLOUR;
}

void Viewer::load_current_photo() {
    Photos& p = session_.photos;
    const bool wanted = p.compare || session_.display.mode == VIEW_ERROR;
    if (p.current < 0 || !wanted || p.loaded == p.current || p.failed) return;
    const View& view = p.views[static_cast<size_t>(p.current)];
    try {
        if (view.photo.empty())
            throw Error(view.name, "this camera has no photo",
                        "Name the data set with its photos: --cameras DATASET.");
        const ImageU8 photo = load_photo(view);
        std::vector<std::uint32_t> texels(photo.data.size() / 4);
        std::memcpy(texels.data(), photo.data.data(), photo.data.size());
        p.buffer = Buffer(*device_, "photo", texels.size() * 4);
        p.buffer.upload(texels);
        p.width = photo.width;
        p.height = photo.height;
        p.loaded = p.current;
        ++version_;
    } catch (const std::exception& e) {
        p.failed = true;
        p.compare = false;
        if (session_.display.mode == VIEW_ERROR) session_.display.mode = VIEW_COLOUR;
        report(e);
    }
}

void Viewer::handle_keys(const Input& input) {
    Session& s = session_;
    for (const Key key : input.pressed) switch (key) {
            case Key::frame_all:
                s.requests.frame_all = true;
                break;
            case Key::level:
                s.navigation.level();
                break;
            case Key::hide_panels:
                s.panels = !s.panels;
                break;
            case Key::full_screen:
                s.requests.full_screen = true;
                break;
            case Key::picture:
                s.requests.take_picture = true;
                break;
            case Key::next_camera:
            case Key::last_camera: {
                const int count = static_cast<int>(s.photos.views.size());
                const bool next = key == Key::next_camera;
                // From the free camera to the first or the last.
                const int from = s.photos.current >= 0 ? s.photos.current : next ? count - 1 : 0;
                if (count > 0) choose_camera((from + (next ? 1 : count - 1)) % count);
                break;
            }
            case Key::add_key:
                s.path.path.add(s.navigation, s.path.seconds_per_key);
                break;
            case Key::play:
                if (s.training.live && !s.training.finished) {
                    s.training.paused = !s.training.paused;
                    break;
                }
                s.path.playing = !s.path.playing && !s.path.path.keys.empty();
                break;
            case Key::step:
                if (!s.training.live || s.training.finished) break;
                s.training.paused = true;
                ++s.training.steps_to_go;
                break;
            case Key::remove:
                if (s.scene && s.show_region && s.edit.remove(s.scene->model, s.region, true) > 0)
                    s.requests.opacity_changed = true;
                break;
            case Key::undo:
                s.edit.undo();
                s.requests.opacity_changed = true;
                break;
            case Key::redo:
                s.edit.redo();
                s.requests.opacity_changed = true;
                break;
            case Key::save:
                s.requests.save = true;
                break;
            case Key::quit:
                s.requests.quit = true;
                break;
            case Key::escape:
                s.path.playing = false;
                s.requests.cancel_load = s.requests.cancel_export = true;
                s.requests.leave_full_screen = s.requests.stay = true;
                s.error.clear();
                break;
        }
}

void Viewer::move(const Input& in, double seconds, int width, int height) {
    Navigation& n = session_.navigation;
    const double turn = glm::pi<double>() / std::max(height, 1);  // half a turn a window's height
    const bool drags = in.dx != 0 || in.dy != 0;
    const glm::dvec3 fly(double(in.to_right) - double(in.to_left),
                         double(in.rise) - double(in.sink), double(in.ahead) - double(in.back));
    const bool flies = fly != glm::dvec3(0.0) && !in.control;
    if (!gui_.wants_mouse()) {
        const bool pans = in.middle || (in.left && in.shift);
        const bool turns = (in.left || in.right) && !pans;
        if (drags && (pans || turns)) leave_photo();
        if (drags && pans) n.pan(in.dx, in.dy, height);
        if (drags && turns && in.right) n.look(in.dx * turn, in.dy * turn);
        if (drags && turns && !in.right) n.orbit(in.dx * turn, in.dy * turn);
        if (in.wheel != 0 && (in.right || flies)) {
            session_.fly_speed *= std::pow(1.25, in.wheel);
        } else if (in.wheel != 0) {
            leave_photo();
            n.zoom(std::pow(0.9, in.wheel));
        }
        if (in.double_click && session_.scene)
            if (const auto hit = pick(session_.scene->model, session_.edit.removed(),
                                      frame_camera(width, height), in.x, in.y))
                n.set_pivot_depth(*hit);
    }
    if (flies && !gui_.wants_keys()) {
        leave_photo();
        n.fly(glm::normalize(fly) * session_.fly_speed * std::min(seconds, 0.25));
    }
}

void Viewer::play_path(double seconds) {
    PathState& p = session_.path;
    p.playing = p.playing && !p.path.keys.empty();
    if (!p.playing) return;
    p.at_s += seconds;
    leave_photo();
    apply(p.path.sample(p.at_s), session_.navigation);
    if (p.at_s < p.path.duration()) return;
    p.at_s = 0;
    p.playing = false;
}

Camera Viewer::frame_camera(int width, int height) const {
    const Photos& p = session_.photos;
    if (p.current < 0) return session_.navigation.camera(width, height);
    return fitted(p.views[static_cast<size_t>(p.current)].camera, width, height);
}

PhotoOverlay Viewer::overlay(const Camera& camera, int width, int height) const {
    PhotoOverlay o;
    const Photos& p = session_.photos;
    if (p.current < 0 || p.loaded != p.current) return o;
    const Camera& of = p.views[static_cast<size_t>(p.current)].camera;
    const double share = double(camera.width) / width;
    o.scale = fit_scale(of, width, height) * share;
    o.x = 0.5 * (camera.width - o.scale * of.width);
    o.y = 0.5 * (camera.height - o.scale * of.height);
    o.photo = &p.buffer;
    o.width = p.width;
    o.height = p.height;
    o.split = p.compare ? p.split : 0;
    return o;
}

// less: a picture that is replaced soon.
void Viewer::draw_picture(const PictureKey& key, std::optional<MotionQuality> less) {
    const auto start = Clock::now();
    const MotionQuality quality = less.value_or(MotionQuality());
    const Camera camera = scaled(key.camera, quality.scale);
    drawn_ = key;
    drawn_any_ = true;
    drawn_moving_ = less.has_value();
    drawn_preview_ = less && quality.scale == 1;
    try {
        picture_.render(camera, key.display, overlay(camera, key.camera.width, key.camera.height),
                        less ? std::optional(quality.splats) : std::nullopt);
    } catch (const std::exception& e) {
        report(e);
        drawn_moving_ = false;  // not again before something changes
        return;
    }
    FrameTimes& t = session_.times;
    t.passes = picture_.pass_times();
    t.picture_ms = milliseconds_since(start);
    if (!less) t.full_ms = t.picture_ms;
    t.quality = quality;
    t.visible = picture_.status().visible;
    t.pairs = picture_.status().pairs;
    if (session_.plan && !less)
        session_.plan->note_frame(picture_.status().huge_splats, picture_.status().longest_list);
}

// Once after what a picture needs has changed: pipelines compile at their first use, and the first
// frames in motion are drawn at a quality that was found before them.
void Viewer::rehearse_motion(const PictureKey& key) {
    const FrameTimes& t = session_.times;
    const double besides_ms = std::max(0.0, t.frame_ms - t.picture_ms);
    try {
        for (int i = 0; i <= kRehearsals; ++i) {
            const MotionQuality quality = motion_.quality();
            // The first makes the copy of the important splats, also where all are wanted now.
            const double splats =
                i == 0 ? std::min(quality.splats, picture_.most_moving()) : quality.splats;
            const auto start = Clock::now();
            const std::vector<PassTime> passes =
                picture_.rehearse(scaled(key.camera, quality.scale), key.display, splats);
            if (picture_.compiled() || splats < quality.splats) continue;
            motion_.measured(motion_cost(besides_ms + milliseconds_since(start), passes));
        }
    } catch (const std::exception& e) {
        report(e);
    }
}

// Where the whole picture takes long.
bool Viewer::preview_pays() const {
    return session_.times.full_ms > kLong_ms && picture_.most_moving() < 1 &&
           picture_.ready_to_move(session_.display);
}

bool Viewer::refined() const {
    return drawn_any_ && last_ == drawn_ && (!drawn_moving_ || drawn_preview_);
}

bool Viewer::at_rest() const {
    return !job_ && drawn_any_ && !drawn_moving_ && last_ == drawn_ &&
           picture_.ready_to_move(session_.display);
}

double Viewer::frame(const Input& input, int width, int height, bool full) {
    frame_start_ = Clock::now();
    // After a pause only a short step: nothing moved in between.
    const double seconds =
        continuous_ ? std::chrono::duration<double>(frame_start_ - last_frame_).count() : kStep_s;
    last_frame_ = frame_start_;
    poll_load();
    for (const auto& path : input.dropped) drop(path);
    canvas_.resize(width, height);
    gui_.begin(width, height);  // now it knows whether the pointer is on a panel
    if (!gui_.wants_keys()) handle_keys(input);
    move(input, seconds, width, height);
    play_path(seconds);
    draw_panels(session_);
    gui_.end();
    const bool works = act_on_requests(width, height);
    const double look_s = export_ ? kLook_s : kForever;
    load_current_photo();

    drew_moving_ = false;
    bool drew = false;
    if (picture_.empty()) return session_.path.playing ? 0 : std::min(look_s, settle_panels(false));
    PictureKey key{frame_camera(width, height), session_.display, session_.photos.current,
                   session_.photos.compare ? session_.photos.split : 0.0f, version_};
    last_.version = key.version;  // an edit or a training step is no motion
    if (!(key == last_)) changed_at_ = frame_start_;
    last_ = key;
    const double rests = std::chrono::duration<double>(frame_start_ - changed_at_).count();
    const bool refine = full || rests >= kRest_s || !drawn_any_;
    const bool whole = drawn_any_ && key == drawn_ && !drawn_moving_;
    if (works) {
        // Its pictures are shown as they come.
    } else if (!(key == drawn_) && !refine) {
        drew_moving_ = true;
        draw_picture(key, motion_.quality());
    } else if (refine && !whole && !full && !refined() && preview_pays()) {
        draw_picture(key, MotionQuality{1, picture_.most_moving()});
        drew = true;
    } else if (refine && !whole) {
        draw_picture(key);
        drew = true;
    } else if (whole && !full && session_.error.empty() &&
               !picture_.ready_to_move(session_.display)) {
        rehearse_motion(key);
    }
    const bool held =
        input.ahead || input.back || input.to_left || input.to_right || input.rise || input.sink;
    continuous_ = held || session_.path.playing || works;
    if (continuous_) return 0;
    if (drawn_moving_) return std::min(look_s, std::max(0.001, kRest_s - rests));
    return std::min(look_s, settle_panels(drew));
}

double Viewer::settle_panels(bool changed) {
    unsettled_ = changed ? kSettlingFrames : std::max(unsettled_ - 1, 0);
    return unsettled_ > 0 ? 0 : kForever;
}

void Viewer::settle(int width, int height) {
    frame({}, width, height, true);
    drawn_any_ = false;  // the times are those of a second picture: the first may have compiled
    do frame({}, width, height, true);
    while (unsettled_ > 0);
}

void Viewer::presented() {
    FrameTimes& t = session_.times;
    t.frame_ms = milliseconds_since(frame_start_);
    if (!drew_moving_ || picture_.compiled()) return;
    motion_.measured(motion_cost(t.frame_ms, t.passes));
    t.moving_ms.push_back(t.frame_ms);
    if (t.moving_ms.size() > kTimesKept) t.moving_ms.pop_front();
}

VkCommandBuffer Viewer::compose() {
    const VkCommandBuffer commands = canvas_.begin_commands();
    const glm::vec3& b = session_.display.background;
    const float clear[3] = {b.r, b.g, b.b};
    canvas_.compose(commands, picture_.empty() ? nullptr : &picture_.pixels(), picture_.width(),
                    picture_.height(), clear, [this](VkCommandBuffer c) { gui_.draw(c); });
    return commands;
}

}  // namespace darb
