// What the strategies ask of the trainer: their rounds of density control, the noise of mcmc, the
// error score of budget, and the resolution ramp.
#include <algorithm>
#include <cfloat>

#include "engine/core/error.h"
#include "engine/core/rng.h"
#include "trainer/strategy.h"
#include "trainer/trainer.h"

namespace darb {

namespace {

constexpr int kScoresPerRound = 10;  // photos of a round that are scored

// The published noise is 5e5 lr Sigma in units of the scene, where the rate lr goes with the
// scene's extent and Sigma with its square: one scene in other units is another training. Here it
// is as published where the extent is 5, near which the scenes lie that it was published on (NeRF's
// synthetic cameras are 4 units from the centre), and follows the units.
constexpr double kNoiseExtent = 5;

}  // namespace

void Trainer::make_strategy(const Dataset& dataset) {
    if (options_.strategy == Strategy::mcmc)
        mcmc_.emplace(*device_, options_.kernel, options_.footprint);
    if (options_.strategy == Strategy::budget) {
        score_.emplace(*device_, LossOptions{.use_alpha = options_.alpha,
                                             .use_mask = options_.alpha && dataset.alpha_is_mask});
        score_->reset(splats_.count());
    }
    if (!options_.resolution_ramp) return;
    ramp_.emplace(*device_);
    for (const View& view : dataset.views) {
        photo_cameras_.push_back(view.camera);
        longest_side_ = std::max({longest_side_, view.camera.width, view.camera.height});
    }
    settle_resolution(1);
}

DensityResult Trainer::refine(int iteration, gpu::DensifyArgs args, std::uint32_t limit) {
    if (options_.strategy == Strategy::adc)
        return density_.run(splats_, backward_.gradient_sum(), args, limit);
    const std::uint32_t target =
        growth_target(options_, schedule_, iteration, splats_.count(), limit);
    if (options_.strategy == Strategy::mcmc)
        return mcmc_->run(splats_, density_, args.prune_opacity, target - splats_.count(),
                          args.seed);
    args.gradient_threshold = FLT_MIN;  // whatever has a share may grow, the largest shares first
    const DensityResult result = density_.run(splats_, score_->shares(), args, target);
    if (schedule_.opacity_decay > 0)
        density_.decay_opacity(splats_, 1.0f - schedule_.opacity_decay);
    score_->reset(splats_.count());
    return result;
}

// Evenly over the iterations between two rounds; with few, in each.
bool Trainer::scores(int iteration) const {
    return score_ && probe_views_.empty() && iteration < schedule_.rounds.end &&
           iteration % std::max(1, schedule_.rounds.interval / kScoresPerRound) == 0;
}

void Trainer::record_noise(Commands& commands, int iteration) {
    const double rate = options_.noise_lr * schedule_.position_rate(iteration) * kNoiseExtent *
                        kNoiseExtent / extent_;
    Pcg32 random(options_.seed, 0x6E6F697Eull << 32 | static_cast<std::uint32_t>(iteration));
    mcmc_->record_noise(commands, splats_, buffers_.frame().counters.status,
                        static_cast<float>(rate), schedule_.prune_opacity, random.next());
}

const gpu::CameraData& Trainer::camera_data_of(int view) const {
    return divisor_ > 1 ? small_data_[view] : camera_data_[view];
}

const Buffer& Trainer::cameras_now() const {
    return divisor_ > 1 ? small_cameras_ : cameras_;
}

const Buffer& Trainer::pixels_of_photo(int view) const {
    return divisor_ > 1 ? small_photos_[view] : photos_[view];
}

// Both iterations under way end with the photos that they began with. Where there is no room for
// smaller ones beside the whole ones the run goes on with these.
void Trainer::settle_resolution(int iteration) {
    const int divisor = ramp_ ? schedule_.resolution_divisor(iteration, longest_side_) : 1;
    if (divisor == divisor_) return;
    drain();
    use_whole_photos();
    if (divisor > 1) try {
            use_smaller_photos(divisor);
        } catch (const Error&) {
            use_whole_photos();
            ramp_.reset();
        }
}

void Trainer::use_whole_photos() {
    divisor_ = 1;
    small_data_.clear();
    small_photos_.clear();
    small_cameras_ = Buffer();
}

void Trainer::use_smaller_photos(int divisor) {
    divisor_ = divisor;
    for (size_t v = 0; v < photo_cameras_.size(); ++v) {
        const Camera& camera = photo_cameras_[v];
        const Camera smaller = divided(camera, divisor);
        small_data_.push_back(camera_data(smaller, splats_.origin()));
        small_photos_.emplace_back();
        if (photos_[v]) small_photos_.back() = ramp_->downsample(photos_[v], camera, smaller);
    }
    small_cameras_ = upload_cameras(*device_, small_data_);
}

}  // namespace darb
