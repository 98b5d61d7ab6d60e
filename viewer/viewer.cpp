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
constexpr double kStep_s = 1.0 / 60;
constexpr size_t kTimesKept = 60;  // frames in motion that the panel averages over
constexpr int kRehearsals = 8;     // of motion, after the one that compiles
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
    session_.navigation.up = start_up(options_);
    session_.device_name = device.info().name;
    session_.gui_scale = options_.gui_scale > 0 ? options_.gui_scale : 1;
    last_frame_ = changed_at_ = Clock::now();
}

Viewer::~Viewer() = default;

void Viewer::open(const std::filesystem::path& path) {
    try {
        const std::filesystem::path file = options_.resolve ? options_.resolve(path) : path;
        if (job_) {
            job_->cancel();
            cancelled_.push_back(std::move(job_));
        }
        session_.error.clear();
        job_ = std::make_unique<LoadJob>(file, options_.wake);
    } catch (const std::exception& e) {
        report(e);
    }
}

void Viewer::finish_loading() {
    if (!job_) {
        if (!session_.error.empty()) throw Error("darb view", session_.error);
        return;
    }
    job_->wait();
    std::optional<Scene> scene = std::exchange(job_, nullptr)->take();
    if (scene) adopt(std::move(*scene));
}

void Viewer::report(const std::exception& error) {
    session_.error = error.what();
}

void Viewer::poll_load() {
    std::erase_if(cancelled_, [](const auto& job) { return job->done(); });
    session_.load_share = job_ ? job_->share() : -1;
    if (!job_) return;
    session_.load_stage = fmt::format("{}: {}", job_->file().filename().string(), job_->stage());
    if (!job_->done()) return;
    session_.load_share = -1;
    const std::unique_ptr<LoadJob> job = std::move(job_);
    try {
        if (std::optional<Scene> scene = job->take()) adopt(std::move(*scene));
    } catch (const std::exception& e) {
        report(e);
    }
}

// The device's copy first: when that fails, the scene before is still there.
void Viewer::adopt(Scene loaded) {
    auto scene = std::make_unique<Scene>(std::move(loaded));
    picture_.set_scene(scene->model, scene->bounds, std::move(scene->important));
    motion_.start(picture_.splat_count(), picture_.most_moving());
    const bool first = session_.scene == nullptr;
    session_.scene = std::move(scene);
    const Scene& s = *session_.scene;
    session_.shown_sh_degree = picture_.shown_sh_degree();
    session_.edit = Edit(s.model.size());
    session_.region = {Region::Shape::box, s.bounds.centre, glm::dvec3(s.bounds.radius)};
    session_.save_file = s.file;
    session_.save_file.replace_filename(s.file.stem().string() + "_edited.ply");
    session_.fly_speed = s.bounds.radius / 2;
    DisplaySettings& d = session_.display;
    d.kernel = s.model.kernel;
    d.footprint = s.model.footprint;
    d.antialias = s.model.antialias;
    d.sh_degree = session_.shown_sh_degree;
    session_.own = d;
    session_.measured.clear();
    d.near_plane =
        std::min(static_cast<float>(NEAR_DEFAULT), static_cast<float>(s.bounds.radius * 0.1));
    session_.note = fmt::format("{}: {} splats in {:.2f} s", s.file.filename().string(),
                                s.model.size(), s.load_s);
    fmt::print("loaded {}: {} splats in {:.2f} s\n", s.file.string(), s.model.size(), s.load_s);
    std::fflush(stdout);
    ++version_;
    if (first) session_.navigation.level();
    if (session_.photos.current < 0) session_.requests.frame_all = true;
    session_.navigation.distance =
        std::max(glm::distance(session_.navigation.eye, s.bounds.centre), s.bounds.radius * 0.1);
}

void Viewer::show_live(const GpuSplats& splats, const Bounds& bounds) {
    const bool first = !session_.training.live;
    if (first) picture_.set_live(splats, bounds);
    session_.training.live = true;
    ++version_;
    if (first || session_.display.sh_degree == session_.shown_sh_degree)
        session_.display.sh_degree = splats.sh_degree();  // grows with the training
    session_.shown_sh_degree = splats.sh_degree();
    session_.own.sh_degree = splats.sh_degree();
    if (!first) return;
    motion_.start(splats.count(), 1);
    session_.display.kernel = splats.kernel();
    session_.display.footprint = splats.footprint();
    session_.display.antialias = splats.antialias();
    session_.own = session_.display;
    session_.fly_speed = bounds.radius / 2;
    session_.requests.frame_all = session_.photos.current < 0;
    session_.navigation.distance =
        std::max(glm::distance(session_.navigation.eye, bounds.centre), bounds.radius * 0.1);
}

void Viewer::end_live() {
    picture_.clear();
    session_.training.finished = true;
}

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
                const int step = key == Key::next_camera ? 1 : count - 1;
                if (count > 0) choose_camera((std::max(s.photos.current, 0) + step) % count);
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
                s.requests.leave_full_screen = true;
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
    if (!p.playing) return;
    p.at_s += seconds;
    if (p.at_s > p.path.duration()) {
        p.at_s = 0;
        p.playing = false;
    }
    leave_photo();
    apply(p.path.sample(p.at_s), session_.navigation);
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
    (void)height;
    return o;
}

void Viewer::draw_picture(const PictureKey& key, bool moving) {
    const auto start = Clock::now();
    const MotionQuality quality = moving ? motion_.quality() : MotionQuality();
    const Camera camera = scaled(key.camera, quality.scale);
    drawn_ = key;
    drawn_any_ = true;
    drawn_moving_ = moving;
    try {
        picture_.render(camera, key.display, overlay(camera, key.camera.width, key.camera.height),
                        moving ? std::optional(quality.splats) : std::nullopt);
    } catch (const std::exception& e) {
        report(e);
        drawn_moving_ = false;  // not again before something changes
        return;
    }
    FrameTimes& t = session_.times;
    t.passes = picture_.pass_times();
    t.picture_ms = milliseconds_since(start);
    if (!moving) t.full_ms = t.picture_ms;
    t.quality = quality;
    t.visible = picture_.status().visible;
    t.pairs = picture_.status().pairs;
}

// Once after what a picture needs has changed: pipelines compile at their first use, and the first
// frames in motion are drawn at a quality that was found before them.
void Viewer::rehearse_motion(const PictureKey& key) {
    const FrameTimes& t = session_.times;
    const double besides_ms = std::max(0.0, t.frame_ms - t.picture_ms);
    try {
        for (int i = 0; i <= kRehearsals; ++i) {
            const MotionQuality quality = motion_.quality();
            const auto start = Clock::now();
            const std::vector<PassTime> passes =
                picture_.rehearse(scaled(key.camera, quality.scale), key.display, quality.splats);
            if (picture_.compiled()) continue;
            motion_.measured(motion_cost(besides_ms + milliseconds_since(start), passes));
        }
    } catch (const std::exception& e) {
        report(e);
    }
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
    for (const auto& path : input.dropped) open(path);
    if (!gui_.wants_keys()) handle_keys(input);
    move(input, seconds, width, height);
    play_path(seconds);
    canvas_.resize(width, height);
    gui_.begin(width, height);
    draw_panels(session_, width, height);
    gui_.end();
    act_on_requests(width, height);
    load_current_photo();

    drew_moving_ = false;
    bool drew = false;
    if (picture_.empty()) return export_ || session_.path.playing ? 0 : kForever;
    PictureKey key{frame_camera(width, height), session_.display, session_.photos.current,
                   session_.photos.compare ? session_.photos.split : 0.0f, version_};
    last_.version = key.version;  // an edit or a training step is no motion
    if (!(key == last_)) changed_at_ = frame_start_;
    last_ = key;
    const double rests = std::chrono::duration<double>(frame_start_ - changed_at_).count();
    const bool refine = full || rests >= kRest_s || !drawn_any_;
    if (!(key == drawn_) && !refine) {
        drew_moving_ = true;
        draw_picture(key, true);
    } else if (full || (refine && (!(key == drawn_) || drawn_moving_))) {
        draw_picture(key, false);
        drew = true;
    } else if (!drawn_moving_ && session_.error.empty() &&
               !picture_.ready_to_move(session_.display)) {
        rehearse_motion(key);
    }
    const bool held =
        input.ahead || input.back || input.to_left || input.to_right || input.rise || input.sink;
    continuous_ = held || session_.path.playing || export_ || measure_;
    if (continuous_) return 0;
    if (drawn_moving_ && session_.error.empty()) return std::max(0.001, kRest_s - rests);
    return drew ? 0 : kForever;  // once more, so that the panels show this picture's times
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
    const bool fits = picture_.width() <= canvas_.width() && picture_.height() <= canvas_.height();
    const bool shown = !picture_.empty() && fits;
    canvas_.compose(commands, shown ? &picture_.pixels() : nullptr, picture_.width(),
                    picture_.height(), clear, [this](VkCommandBuffer c) { gui_.draw(c); });
    return commands;
}

}  // namespace darb
