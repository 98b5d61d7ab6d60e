#include "tools/darb/live_view.h"

#include <algorithm>
#include <chrono>

#include "viewer/window.h"

namespace darb {

namespace {

using Clock = std::chrono::steady_clock;

constexpr double kShare = 0.1;       // of the time that pictures may take from training
constexpr double kShortest_s = 0.2;  // between two pictures
constexpr double kPausedNap_s = 0.1;
constexpr size_t kLongestCurve = 1000;
constexpr float kSmoothing = 0.05f;  // of loss and PSNR, which jump from photo to photo

// Where the sparse points are; the cameras where there are none.
Bounds bounds_of(const Dataset& dataset) {
    SplatModel points;
    const std::vector<double>& p = dataset.points.position;
    points.resize(p.size() / 3);
    std::transform(p.begin(), p.end(), points.position.begin(),
                   [](double v) { return static_cast<float>(v); });
    if (points.size() > 0) return scene_bounds(points);
    Bounds bounds;
    for (const View& view : dataset.views)
        bounds.centre += view.camera.centre() / double(dataset.views.size());
    bounds.radius = std::max(scene_extent(dataset), 1e-3);
    return bounds;
}

void thin(std::vector<float>& values) {
    for (size_t i = 0; 2 * i < values.size(); ++i) values[i] = values[2 * i];
    values.resize((values.size() + 1) / 2);
}

}  // namespace

struct LiveSystem::System {
    WindowSystem windows;
};

struct LiveView::State {
    State(Device& device, ViewerOptions options, const Dataset& dataset,
          const std::atomic<bool>& stop_)
        : window(std::make_unique<ViewerWindow>(device, std::move(options), 1280, 720)),
          bounds(bounds_of(dataset)),
          stop(stop_) {
        window->set_title("training - darb");
        if (!dataset.views.empty()) window->viewer().choose_camera(0);
    }

    void add_to_curves(const LiveStep& step);
    Session& session() { return window->viewer().session(); }

    std::unique_ptr<ViewerWindow> window;  // null once closed
    Bounds bounds;
    const std::atomic<bool>& stop;
    Clock::time_point next_picture{};
    float loss = 0, psnr_db = 0;  // smoothed
    int stride = 1;               // iterations of one value of a curve
};

LiveView::LiveView(std::unique_ptr<State> state) : state_(std::move(state)) {}
LiveView::~LiveView() = default;

void LiveView::State::add_to_curves(const LiveStep& step) {
    TrainingCurves& t = session().training;
    t.iteration = step.iteration;
    t.last_iteration = step.last_iteration;
    const IterationResult& r = step.result;
    if (r.iteration == 0) return;
    const float share = t.loss.empty() ? 1 : kSmoothing;
    loss += share * (static_cast<float>(r.loss) - loss);
    psnr_db += share * (static_cast<float>(r.psnr_db) - psnr_db);
    if (r.iteration % stride != 0 && !t.loss.empty()) return;
    t.loss.push_back(loss);
    t.psnr_db.push_back(psnr_db);
    t.splats.push_back(static_cast<float>(r.splats));
    if (t.loss.size() > kLongestCurve) {
        for (std::vector<float>* curve : {&t.loss, &t.psnr_db, &t.splats}) thin(*curve);
        stride *= 2;
    }
    for (size_t e = t.held_out_psnr_db.size(); e < step.evaluations.size(); ++e)
        t.held_out_psnr_db.push_back(static_cast<float>(step.evaluations[e].psnr_db));
}

void LiveView::show(const LiveStep& step) {
    State& s = *state_;
    if (!s.window) return;
    s.add_to_curves(step);
    TrainingCurves& training = s.session().training;
    const auto now = Clock::now();
    if (now >= s.next_picture || training.paused) {
        s.window->viewer().show_live(step.splats, s.bounds);
        s.window->redraw();
        const double cost_s = s.session().times.frame_ms / 1000;
        s.next_picture =
            now + std::chrono::duration_cast<Clock::duration>(
                      std::chrono::duration<double>(std::max(kShortest_s, cost_s / kShare)));
    }
    bool open = s.window->pump(0);
    training.steps_to_go = std::max(0, training.steps_to_go - 1);
    while (open && training.paused && training.steps_to_go == 0 && !s.stop)
        open = s.window->pump(kPausedNap_s);
    if (!open) s.window.reset();
}

void LiveView::finish(const std::filesystem::path& model) {
    State& s = *state_;
    if (!s.window) return;
    s.window->viewer().end_live();
    if (!model.empty()) s.window->viewer().open(model);
    while (!s.stop && s.window->pump(kPausedNap_s)) {
    }
    s.window.reset();
}

LiveSystem::LiveSystem(bool on, DeviceOptions& options) {
    if (!on) return;
    system_ = std::make_unique<System>();
    system_->windows.require(options);
}

LiveSystem::~LiveSystem() = default;

std::unique_ptr<LiveView> LiveSystem::open(Device& device, const Dataset& dataset,
                                           const std::atomic<bool>& stop) const {
    if (!system_) return nullptr;
    ViewerOptions options;
    options.views = dataset.views;
    return std::make_unique<LiveView>(
        std::make_unique<LiveView::State>(device, std::move(options), dataset, stop));
}

}  // namespace darb
