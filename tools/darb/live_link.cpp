// SPDX-License-Identifier: MIT
#include "tools/darb/live_link.h"

#include <algorithm>
#include <utility>

#include "engine/data/camera_list.h"
#include "engine/data/point_cloud_ply.h"
#include "viewer/seconds.h"

namespace darb {

namespace {

using Clock = std::chrono::steady_clock;

constexpr auto kPausedNap = std::chrono::milliseconds(20);
constexpr double kRedraw_s = 0.2;  // time between two redraws for the curves alone

}  // namespace

LiveLink::LiveLink(Device& device, const Dataset& dataset, const std::atomic<bool>& stop,
                   const std::function<void()>& wake)
    : bounds_(bounds_of(dataset)),
      stop_(&stop),
      wake_(wake),
      picture_(wake),
      drawer_(device, dataset.views, bounds_) {}

LiveAnswer LiveLink::show(const LiveStep& step) {
    std::unique_lock lock(mutex_);
    curves_.add(step, training_);
    scene_ = live_scene(step.splats);
    ++version_;
    const LiveChange change = training_.paused ? LiveChange::at_once : LiveChange::seldom;
    lock.unlock();
    drawer_.draw(step.splats, change, picture_);
    return take_wishes(wait_while_paused(step));
}

LiveAnswer LiveLink::take_wishes(double paused_s) {
    LiveAnswer answer(paused_s);
    const RunSettings now = [&] {
        const std::lock_guard lock(mutex_);
        return training_.settings;
    }();
    for (const RunWish& wish : wishes_.take()) {
        if (wish.change) answer.changes.push_back(change_of(*wish.change, now));
        answer.measures |= wish.measures;
        answer.saves |= wish.saves;
        answer.stops |= wish.stops;
        publishes_ |= wish.stops && wish.publishes;
        answer.again = true;
    }
    const std::lock_guard lock(mutex_);
    answer.again &= training_.paused && training_.steps_to_go == 0;
    return answer;
}

// Pictures go on while paused, because the user may look around.
double LiveLink::wait_while_paused(const LiveStep& step) {
    const auto start = Clock::now();
    for (bool waited = false;; waited = true) {
        std::unique_lock lock(mutex_);
        const bool steps = training_.steps_to_go > 0;
        if (closed_ || *stop_ || !training_.paused || steps || !wishes_.empty()) {
            if (steps) --training_.steps_to_go;
            return waited ? seconds_since(start) : 0;
        }
        lock.unlock();
        const bool drew = drawer_.draw(step.splats, LiveChange::none, picture_);
        lock.lock();
        if (!drew) changed_.wait_for(lock, kPausedNap);
    }
}

void LiveLink::finish(const std::filesystem::path& model, const std::string& said) {
    {
        const std::lock_guard lock(mutex_);
        finished_ = true;
        model_ = model;
        last_words_ = said;
    }
    wake_();
}

void LiveLink::close() {
    const std::lock_guard lock(mutex_);
    closed_ = true;
    changed_.notify_all();
}

bool LiveLink::closed() const {
    const std::lock_guard lock(mutex_);
    return closed_;
}

void LiveLink::wait_until_let_go() {
    std::unique_lock lock(mutex_);
    changed_.wait(lock, [this] { return closed_; });
}

void LiveLink::follow(ViewerWindow& shown) {
    Viewer& viewer = shown.viewer();
    TrainingCurves& seen = viewer.session().training;
    std::unique_lock lock(mutex_);
    if (scene_ && !begun_) viewer.show_live(picture_, bounds_, *scene_);
    begun_ |= scene_.has_value();
    if (seen.paused != training_.paused || seen.steps_to_go > 0) {
        training_.paused = seen.paused;
        training_.steps_to_go += std::exchange(seen.steps_to_go, 0);
        changed_.notify_all();
    }
    std::vector<RunWish>& asked = viewer.session().run_desk.wishes;
    if (!asked.empty()) {
        wishes_.ask(std::exchange(asked, {}));
        changed_.notify_all();
    }
    if (version_ != followed_ && seconds_since(redrawn_) >= kRedraw_s) {
        const bool live = seen.live, was_finished = seen.finished;
        for (std::size_t i = seen.said.size(); i < training_.said.size(); ++i)
            viewer.session().tell(training_.said[i]);
        followed_ = version_;
        seen = training_;
        seen.live = live;
        seen.finished = was_finished;
        seen.steps_to_go = 0;
        redrawn_ = Clock::now();
        shown.redraw();
    }
    if (!finished_ || ended_) return;
    ended_ = true;
    const std::filesystem::path scene_file = model_;
    const std::string said = last_words_;
    lock.unlock();
    viewer.end_live();
    if (!said.empty()) viewer.session().tell(said);
    if (!scene_file.empty()) viewer.open(scene_file);
}

namespace {

constexpr double kMiB = 1024.0 * 1024.0;
constexpr size_t kLongestCurve = 1000;
constexpr std::size_t kPointsLookedAt = 20'000;
constexpr float kSmoothing = 0.05f;  // for loss and PSNR, which jump from photo to photo

void thin(std::vector<float>& values) {
    for (size_t i = 0; 2 * i < values.size(); ++i) values[i] = values[2 * i];
    values.resize((values.size() + 1) / 2);
}

}  // namespace

Bounds bounds_of(const Dataset& dataset) {
    const std::size_t step = dataset.points.size() / kPointsLookedAt + 1;
    PointCloud few;
    for (std::size_t i = 0; i < dataset.points.size(); i += step)
        for (std::size_t c = 3 * i; c < 3 * i + 3; ++c) {
            few.position.push_back(dataset.points.position[c]);
            few.colour.push_back(dataset.points.colour[c]);
        }
    if (few.size() > 0) return subject_of(points_as_splats(few), cameras_of(dataset.views));
    Bounds bounds;
    for (const View& view : dataset.views)
        bounds.centre += view.camera.centre() / double(dataset.views.size());
    bounds.radius = std::max(scene_extent(dataset), 1e-3);
    return bounds;
}

void LiveCurves::add(const LiveStep& step, TrainingCurves& t) {
    t.iteration = step.iteration;
    t.last_iteration = step.last_iteration;
    t.seconds_left = step.seconds_left;
    t.memory_bytes = step.memory_bytes;
    t.settings = settings_of(step.options);
    t.said = step.said;
    for (size_t e = t.held_out_psnr_db.size(); e < step.evaluations.size(); ++e) {
        t.held_out_psnr_db.push_back(static_cast<float>(step.evaluations[e].psnr_db));
        t.held_out_at.push_back(step.evaluations[e].iteration);
    }
    const IterationResult& r = step.result;
    if (r.iteration == last) return;
    last = r.iteration;
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
}

RunSettings settings_of(const TrainOptions& o) {
    return {o.iterations, o.max_splats.value_or(0), double(o.max_memory_bytes.value_or(0)) / kMiB};
}

RunChange change_of(const RunSettings& wanted, const RunSettings& now) {
    RunChange change;
    if (wanted.iterations > 0 && wanted.iterations != now.iterations)
        change.iterations = wanted.iterations;
    if (wanted.max_splats > 0 && wanted.max_splats != now.max_splats)
        change.max_splats = wanted.max_splats;
    if (wanted.max_memory_mib >= 0 && wanted.max_memory_mib != now.max_memory_mib)
        change.max_memory_bytes = static_cast<std::uint64_t>(wanted.max_memory_mib * kMiB);
    return change;
}

}  // namespace darb
