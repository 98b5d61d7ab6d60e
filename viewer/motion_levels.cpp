#include "viewer/motion_levels.h"

#include <sys/resource.h>

#include <new>
#include <utility>

#include "engine/scene/edit_splats.h"
#include "engine/scene/merge_splats.h"

namespace darb {

namespace {

struct LevelsCancelled {};

constexpr int kQuickNice = 5, kNice = 15;  // pictures come first

SplatModel without(const SplatModel& model, const std::vector<std::uint8_t>& removed) {
    SplatModel kept = model;
    if (!removed.empty()) keep_splats([&](std::size_t i) { return removed[i] == 0; }, kept);
    return kept;
}

}  // namespace

MotionLevels::MotionLevels(const SplatModel& model, const std::vector<std::uint8_t>& removed,
                           std::vector<std::size_t> counts, std::function<void()> wake)
    : model_(without(model, removed)),
      counts_(std::move(counts)),
      wake_(std::move(wake)),
      thread_([this] { run(); }) {}

MotionLevels::~MotionLevels() {
    cancel();
    thread_.join();
}

void MotionLevels::run() {
    try {
        make_levels(true);
        make_levels(false);
    } catch (const LevelsCancelled&) {
    } catch (const std::bad_alloc&) {  // the important splats do without them
    }
    model_ = SplatModel();
    done_ = true;
    if (wake_) wake_();
}

void MotionLevels::make_levels(bool quick) {
    setpriority(PRIO_PROCESS, 0, quick ? kQuickNice : kNice);  // of this thread, on Linux
    const MergeOptions options{.threads = 1, .quick = quick, .progress = [this](double) {
                                   if (cancelled_) throw LevelsCancelled();
                               }};
    SplatModel last;
    for (std::size_t i = 0; i < counts_.size(); ++i) {
        if (cancelled_) throw LevelsCancelled();
        last = merge_splats(i == 0 ? model_ : last, counts_[i], options);
        if (!quick && i == 0) model_ = SplatModel();
        {
            const std::lock_guard lock(mutex_);
            ready_.push_back(last);
        }
        if (wake_) wake_();
    }
}

std::optional<SplatModel> MotionLevels::take() {
    const std::lock_guard lock(mutex_);
    if (ready_.empty()) return {};
    SplatModel level = std::move(ready_.front());
    ready_.pop_front();
    return level;
}

}  // namespace darb
