// What the effects ask of the trainer beside an iteration: the smoothing filter that follows the
// splats, and the probes that decide on view-dependent colour.
#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <utility>

#include "trainer/trainer.h"

namespace darb {

namespace {

constexpr float kProbeIterations = 150;  // of each arm, over the root of the pace
constexpr std::size_t kFewestViews = 8;  // fewer photos leave none to set aside: the schedule holds
constexpr std::size_t kAsideEvery = 6, kMostAside = 12;

}  // namespace

std::uint32_t Trainer::photo_of(int view) const {
    return static_cast<std::uint32_t>(
        std::lower_bound(train_views_.begin(), train_views_.end(), view) - train_views_.begin());
}

void Trainer::update_smoothing() {
    smoothing_->update(splats_, train_cameras_, static_cast<std::uint32_t>(train_views_.size()));
    smoothing_stale_ = false;
}

void Trainer::refresh_smoothing() {
    if (!smoothing_ || !smoothing_stale_) return;
    drain();
    update_smoothing();
}

void Trainer::settle_effects(int iteration) {
    refresh_smoothing();
    if (options_.probe_sh && iteration == next_probe_ && iteration < options_.iterations &&
        splats_.sh_degree() < options_.sh_degree)
        probe_degree();
}

// Parameters and moments of the new bands are 0.
void Trainer::set_degree(State& state, int degree) {
    SplatModel& model = state.model;
    const auto before = static_cast<std::size_t>(model.rest_count());
    model.sh_degree = degree;
    const auto after = static_cast<std::size_t>(model.rest_count());
    const auto widen = [&](const std::vector<float>& from, std::size_t each) {
        std::vector<float> to(model.size() * after * each, 0.0f);
        for (std::size_t i = 0; i < model.size(); ++i)
            std::copy_n(from.begin() + static_cast<std::ptrdiff_t>(i * before * each),
                        std::min(before, after) * each,
                        to.begin() + static_cast<std::ptrdiff_t>(i * after * each));
        return to;
    };
    model.sh_rest = widen(model.sh_rest, 1);
    state.moments[kShRest] = widen(state.moments[kShRest], 2);
    if (splats_.has_rest_sum()) state.rest_sum = widen(state.rest_sum, 1);
    state.mean.clear();  // it begins anew
    state.averaged = 0;
}

// Mean PSNR over the photos set aside after some iterations on the others. All rates fall to
// nothing in its second half: what is left to tell the arms apart is not which photo came last.
double Trainer::probe_arm(const State& start, int degree, const std::vector<int>& aside) {
    State state = start;
    set_degree(state, degree);
    restore(state);
    const auto iterations = std::lround(kProbeIterations / std::sqrt(schedule_.pace));
    for (long i = 0; i < iterations; ++i) {
        probe_rate_ = std::min(1.0f, 2 * static_cast<float>(iterations - i) / float(iterations));
        launch(++iteration_);
        settle(flights_[(iteration_ + 1) & 1]);
    }
    drain();
    double sum = 0;
    for (const int view : aside) sum += photo_psnr(view);
    return sum / static_cast<double>(aside.size());
}

// The photo as the loss sees it: one frame and its loss, nothing updated.
double Trainer::photo_psnr(int view) {
    Flight& flight = flights_[0];
    const gpu::CameraData& data = camera_data_of(view);
    const int width = static_cast<int>(data.width), height = static_cast<int>(data.height);
    Frame& frame = buffers_.frame();
    buffers_.reserve(splats_.count(), std::max(frame.size.intersections, splats_.count() * 4),
                     width, height);
    do {
        flight.commands.begin();
        forward_.record(flight.commands, splats_, frame_view(view, sh_degree(), background_),
                        frame);
        if (exposure_)
            exposure_->record(flight.commands, frame.images.image, photo_of(view),
                              data.width * data.height);
        loss_.record(flight.commands,
                     {exposure_ ? exposure_->mapped() : frame.images.image, pixels_of_photo(view),
                      d_image_, flight.loss},
                     width, height, background_, options_.lambda_dssim);
        flight.commands.submit_and_wait();
    } while (buffers_.make_room(frame.read_status(), [this] { reserve_backward(); }));
    gpu::LossResult loss;
    std::memcpy(&loss, flight.loss.mapped(), sizeof loss);
    const double mse = double(loss.mse) / std::max(double(loss.weight), 1e-12);
    return -10.0 * std::log10(std::max(mse, 1e-12));
}

void Trainer::probe_degree() {
    const int degree = splats_.sh_degree();
    State before = state();
    Probe probe{iteration_, degree + 1, std::numeric_limits<double>::quiet_NaN(),
                has_room_for_degree(degree + 1)};
    if (probe.admitted && degree == 0 && train_views_.size() >= kFewestViews) {
        std::vector<int> aside, rest;
        for (std::size_t i = 0; i < train_views_.size(); ++i) {
            const bool out = i % kAsideEvery == kAsideEvery / 2 && aside.size() < kMostAside;
            (out ? aside : rest).push_back(train_views_[i]);
        }
        drain();
        const auto listener = std::exchange(on_result, nullptr);
        const std::vector<PassTotal> totals = pass_totals_;
        const std::uint64_t timed = timed_iterations_;
        probe_views_ = rest;
        const double without = probe_arm(before, degree, aside);
        probe.gain_db = probe_arm(before, degree + 1, aside) - without;
        probe.admitted = probe.gain_db > 0;
        probe_views_.clear();
        pass_totals_ = totals;
        timed_iterations_ = timed;
        on_result = listener;
    }
    if (probe.admitted) set_degree(before, degree + 1);
    const int interval = schedule_.degree_interval;
    before.next_probe =
        probe.admitted ? before.iteration + interval : 2 * std::max(before.iteration, 1);
    // Not while opacities come back from a reset.
    if (before.model.sh_degree == 0 && schedule_.resets_after(before.next_probe))
        before.next_probe += (interval + 1) / 2;
    restore(before);
    probes_.push_back(probe);
}

}  // namespace darb
