// SPDX-License-Identifier: MIT
// TrainingStep: one training view forward, its loss, and back into the splats. Steps overlap: run()
// submits one while the one before still runs, and the host reads a step's result after the next
// is on its way. A step whose intersections did not fit changes nothing, nor do those behind it:
// the buffers grow and all of them are done again, in order.
#pragma once

#include <array>
#include <functional>
#include <glm/vec3.hpp>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "engine/core/image.h"
#include "engine/gpu/commands.h"
#include "engine/gpu/pipeline.h"
#include "engine/raster/adam.h"
#include "engine/raster/backward.h"
#include "engine/raster/camera_sums.h"
#include "engine/raster/forward.h"
#include "engine/raster/frame_buffers.h"
#include "engine/raster/loss.h"
#include "engine/raster/profile_sums.h"
#include "engine/render/render_gradients.h"
#include "trainer/growth/density_strategy.h"
#include "trainer/step/exposure.h"
#include "trainer/step/photos.h"
#include "trainer/step/trainer_state.h"

namespace darb {

// DepthLoss: what the loss says of the depths of a picture: measured depths, and the distortion.

/// What a DepthLoss reads and writes, of one view.
struct DepthLossBuffers {
    const Buffer& image;  // float [4 or 6][H W] of ForwardOptions::depth_sum or depth_spread
    const Buffer& transmittance;  // float [H W]
    const Buffer& photo;          // uint [H W] R G B A and, where it is measured, float [H W]
    const Buffer& d_image;        // float [5 or 7][H W]: what is behind the colours is written
    bool measured = false;
};

struct DepthLossOptions {
    bool use_alpha = true;  // as in LossOptions
    // The plane of dL/d(1 - transmittance) holds what Exposure::record_backward left, which is
    // added to.
    bool exposure = false;
    bool measured = true;  // photos have measured depths
    bool spread = false;   // ForwardOptions::depth_spread: the distortion counts
};

struct DepthLossWeights {
    float measured = 0;
    double usual = 1;  // world units: what makes the difference free of the scene's units
    float distortion = 0;
};

class DepthLoss {
  public:
    DepthLoss(Device& device, const DepthLossOptions& options);

    /// The gradient of weights.measured times the mean over all pixels of |depth - measured| /
    /// usual, a pixel without a measured depth having none, and of weights.distortion times the
    /// mean of p / (p + DISTORTION_WIDTH^2), p being the sum over pairs of splats of w_i w_j ((z_i
    /// - z_j) / depth)^2, in which the pixel's depth is a constant. Belongs to the pass "depth
    /// loss".
    void record(Commands& commands, const DepthLossBuffers& buffers, std::uint32_t pixels,
                const DepthLossWeights& weights);

  private:
    Pipeline pipeline_;
};

/// The frames that training takes.
ForwardOptions forward_options(const TrainOptions& options);
/// Whether the gradients of views go to buffers, of which a step is made, and are not a step at
/// once: in batches, and where they are of cameras, too.
bool steps_by_views(const TrainOptions& options);
/// Whether the measured depth of this view is compared.
bool compares_depth(const TrainOptions& options, const View& view);
/// How its loss reads photos.
LossOptions loss_options(const TrainOptions& options, const Dataset& dataset);

/// All that a step depends on beside the splats. The caller decides on each of it: the step knows
/// no schedule.
struct StepInput {
    int iteration = 0;  // from 1
    TrainingView view;
    int next_view = -1;  // the next step's view, where that is known
    AdamStep adam;
    float exposure_rate = 0;
    float distortion_weight = 0;          // of DepthLossWeights
    int exposure_visits = 1;              // visits of its exposure, including this step
    DensityStrategy* strategy = nullptr;  // that records into the step
    bool samples_profile = false;         // its sums for the gradient of a learned kernel are taken
    // In a batch: where the view's gradients go instead of a step, and which view of it this is.
    GradientBuffers* gradients = nullptr;
    int place = 0;
};

/// What one finished step tells.
struct StepOutcome {
    int iteration = 0;
    gpu::FrameStatus status;
    double loss = 0, mse = 0;  // mse: mean squared error of the picture
    std::uint32_t pixels = 0;  // the photo's
    std::vector<PassTime> passes;
    std::uint32_t redone = 0, overflows = 0;  // how often this step was done again, and why
    CameraTotals camera{};                    // dL/d(camera), where cameras are refined
    bool ends_step = true;                    // false: other views of its batch follow
};

class TrainingStep {
  public:
    /// splats: trained by run(); the object must outlive the step, its buffers may change between
    /// two steps. photos: of the largest sizes that steps will have.
    TrainingStep(Device& device, GpuSplats& splats, TrainingPhotos& photos, const LossOptions& loss,
                 const TrainOptions& options);

    /// A view of a batch, with input.gradients: these, and those of its exposure; nothing is
    /// updated and nobody told. Drains, and waits for it.
    StepOutcome run_view(const StepInput& input);
    /// The step of a batch of which these are all views, in order, from the sum of their gradients;
    /// rates and regularisers are those of the last. Waits for it; its passes.
    std::vector<PassTime> run_update(std::span<const StepInput> views, const GradientBuffers& sum);
    /// Other work between the views of a batch. Waits for it; its passes.
    std::vector<PassTime> work(const std::function<void(Commands&)>& record);

    /// Submits the step, then waits for the one before. The outcomes of finished steps go to
    /// on_finished, in order.
    void run(const StepInput& input);
    /// Waits for what is under way.
    void drain();

    /// Called with the outcome of each step. What it throws comes out of run() and drain().
    std::function<void(const StepOutcome&)> on_finished;
    /// Called when a step's buffers have the size that it takes.
    std::function<void()> on_reserved;
    /// A loss of the caller's in place of the built-in one, which is still measured: from the
    /// picture [H][W][3] as it is compared, not clamped, to dL/d(picture) of the same size. Steps
    /// are then done one at a time. Where it throws, or returns what is no gradient, run() throws
    /// and the step has changed nothing.
    std::function<ImageF(const ImageF& picture, const StepInput& input)> picture_gradient;

    // The queue must be idle for all below.

    /// Buffers for pictures of this size, px.
    void reserve(int width, int height);
    /// A picture, RGB not clamped.
    ImageF render(const Camera& camera, int sh_degree, const glm::vec3& background);
    /// Mean squared error of a photo's picture as the loss sees it; nothing is updated.
    double photo_mse(const TrainingView& view);

    /// [N][2] of Backward: on the device, on the host, from there, and back to zeros.
    const Buffer& gradient_sum() { return backward_.gradient_sum(); }
    std::vector<float> gradient_sum_values();
    void restore_gradient_sum(const std::vector<float>& values);
    void clear_gradient_sum();

    /// The steps that follow are of another kernel.
    void set_kernel(int kernel);
    /// The steps that follow are with or without ProjectionEffects::shutter. Where that changes,
    /// the gradient sum is to be restored.
    void set_shutter(bool rolls);
    /// Of the frames that took part since they were cleared; only with options.learn_kernel.
    ProfileSums& profile() { return profile_.value(); }

    std::optional<Exposure>& exposure() { return exposure_; }
    /// What the buffers of a frame are made for now.
    const FrameSize& frame_size() const { return buffers_.size(); }
    /// What pictures are projected with now.
    const ProjectionEffects& effects() const { return forward_.options().effects; }

  private:
    struct Flight {
        explicit Flight(Device& device);
        Buffer loss;    // gpu::LossResult, host
        Buffer status;  // gpu::FrameStatus, host
        StepInput input;
        bool busy = false;
        Commands commands;  // last: they are waited for before anything that they use goes
    };
    void reserve_backward();
    void launch(Flight& flight, const StepInput& input);
    ExposedPicture exposed(const TrainingView& view);
    StepInput with_photo(Commands& commands, const StepInput& input);
    void record_picture(Commands& commands, const StepInput& input);
    void record_loss(Commands& commands, const StepInput& input, const Buffer& loss);
    void record_back(Commands& commands, const StepInput& input);
    void record_update(Commands& commands, std::span<const StepInput> views,
                       const GradientBuffers& sum);
    StepFrame step_frame(Commands& commands, const StepInput& input);
    void ask_for_gradient(Flight& flight);
    gpu::FrameStatus read(Flight& flight, StepOutcome& outcome);
    gpu::FrameStatus finish(Flight& flight, StepOutcome& outcome);
    void complete(Flight& flight);
    gpu::FrameStatus redo(const StepInput& input, gpu::FrameStatus status);
    bool make_room(const gpu::FrameStatus& status);

    Device* device_;
    GpuSplats* splats_;
    TrainingPhotos* photos_;
    FrameBuffers buffers_;
    Forward forward_;
    Backward backward_;
    Loss loss_;
    float lambda_dssim_;
    std::optional<Exposure> exposure_;  // options.exposure
    std::optional<DepthLoss> depth_;    // options.depth or a distortion
    float depth_weight_;
    std::optional<AdamUpdate> adam_;      // used for batches
    std::optional<CameraSums> cameras_;   // options.refine_cameras, of batches
    std::optional<ProfileSums> profile_;  // options.learn_kernel
    Buffer d_image_;
    Buffer given_d_image_;  // [3][H][W] of picture_gradient
    std::array<Flight, 2> flights_;
};

// RunTotals: what a run counts over its iterations.

/// Milliseconds of a pass, summed over `iterations`.
struct PassTotal {
    std::string name;
    double ms = 0;
};

struct RunTotals {
    TrainCounters counters;
    std::vector<PassTotal> passes;
    std::uint64_t timed_iterations = 0;

    /// Its counters.
    void count(const StepOutcome& outcome);
    /// The times of its passes.
    void add_times(const StepOutcome& outcome);
};

/// Throws Error where so many gradients of these splats are not finite that something is broken.
void check_gradients(const StepOutcome& outcome, std::uint32_t splat_count);

}  // namespace darb
