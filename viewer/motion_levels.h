// MotionLevels: the levels of merged splats that are drawn in motion, made one after another by a
// thread of low priority while the viewer goes on with the most important splats. First all of them
// quickly, then again as near to the scene as they can be.
#pragma once

#include <atomic>
#include <cstdint>
#include <deque>
#include <functional>
#include <mutex>
#include <optional>
#include <thread>
#include <vector>

#include "engine/scene/splat_model.h"

namespace darb {

class MotionLevels {
  public:
    /// removed: splats that were deleted (1), empty or [N]; the model is copied. counts: falling.
    /// wake: called from the thread whenever there is something to take.
    MotionLevels(const SplatModel& model, const std::vector<std::uint8_t>& removed,
                 std::vector<std::size_t> counts, std::function<void()> wake);
    ~MotionLevels();  // cancels and waits
    MotionLevels(const MotionLevels&) = delete;
    MotionLevels& operator=(const MotionLevels&) = delete;

    void cancel() { cancelled_ = true; }
    /// The next level where it is ready: in the order of the counts, twice; of one count the later
    /// is the better one.
    std::optional<SplatModel> take();
    /// No more will come. Memory that does not suffice ends them early.
    bool done() const { return done_; }

  private:
    void run();
    void make_levels(bool quick);
    SplatModel model_;
    std::vector<std::size_t> counts_;
    std::function<void()> wake_;
    std::atomic<bool> cancelled_{false}, done_{false};
    std::mutex mutex_;  // of ready_
    std::deque<SplatModel> ready_;
    std::thread thread_;
};

}  // namespace darb
