// SPDX-License-Identifier: MIT
// The cases of `darb bench`, with their names and what they need.
#pragma once

#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "engine/core/image.h"
#include "engine/data/dataset.h"
#include "engine/gpu/device.h"
#include "engine/scene/splat_model.h"
#include "tools/bench/measure.h"
#include "trainer/options/options.h"

namespace darb {

struct BenchOptions {
    Sampling sampling;
    bool full = false;                          // long form: fox_800 after 7,000 iterations
    std::optional<std::filesystem::path> data;  // bench_data_folder()
    std::string device;                         // the value of --device, for processes that are
                                                // started
    std::filesystem::path program;              // the darb command, for the same purpose
    /// Applies to a data set and its options what darb train does before it starts.
    std::function<void(Dataset&, const std::vector<ImageU8>&, TrainOptions&)> plan_training;
    std::function<void(const std::string&)> progress;
};

struct BenchCase {
    std::string name;            // group/scene/size
    std::filesystem::path file;  // below the data folder; empty: the case needs none
    std::function<BenchResult(Device&, const DeviceRates&, const BenchOptions&)> run;
};

/// Frames of random and trained scenes.
std::vector<BenchCase> render_cases();
/// Training steps; --full names other cases.
std::vector<BenchCase> train_cases(bool full);
/// Steps of training with Adam within the backward pass and in a pass of its own.
std::vector<BenchCase> step_cases();
/// Radix sort and scan.
std::vector<BenchCase> sort_cases();
/// One row for each choice of the passes that have several (engine/plan/tuner.h).
std::vector<BenchCase> tuning_cases();
/// The first picture of a new process, with shaders compiled or from the driver's cache.
std::vector<BenchCase> start_cases();

/// All of them, in this order.
std::vector<BenchCase> bench_cases(bool full);

/// Cases on the user's own scene: frames in two sizes, or of the data set's cameras; with a data
/// set, also training steps that continue from the scene.
std::vector<BenchCase> own_cases(const std::filesystem::path& scene,
                                 const std::filesystem::path& dataset);

/// Measures a frame, with figures on blending, as the cases of render_cases() do.
BenchResult measure_picture(Device& device, const SplatModel& model, const Camera& camera,
                            const DeviceRates& rates, const BenchOptions& options);
/// Frame times of a model at one camera, as `darb render` draws it, without blend figures.
BenchResult measure_frames(Device& device, const SplatModel& model, const Camera& camera,
                           const DeviceRates& rates, const Sampling& sampling);
/// Measures steps of a trainer that has been set up; without figures on blending.
class Trainer;
BenchResult measure_steps(Trainer& trainer, int steps_a_sample, const Sampling& sampling);

// The scenes that `darb bench` measures on.

/// Splats uniform in the unit sphere, log-scales N(log 0.01, 0.4), opacity logits N(0, 1.5), higher
/// coefficients N(0, 0.05), coloured by position; identical at every call.
SplatModel random_scene(std::size_t splats, int sh_degree = 3);

/// Splats of degree 3 that fill the picture of bench_camera({0, 0, 4}, true, 1000, 1000), at
/// distances between 3 and 5, with six tiles each; most of them faint, as in a trained scene.
SplatModel filled_scene(std::size_t splats);

/// Splats of degree 3 of the sizes and opacities that a trained scene has, a thousand of them large
/// whatever their number, about bench_camera({0, 0, 4}, true, 1595, 1064), which sees a third.
SplatModel trained_scene(std::size_t splats);

/// A camera at `centre` that looks along -z, with y up where `upright`, else turned 180 degrees
/// about z, for scenes with y down. Its horizontal field of view is 45 degrees.
Camera bench_camera(const glm::dvec3& centre, bool upright, int width, int height);

/// A view without a photo, with the camera's pinhole as its lens.
View bench_view(const Camera& camera, const std::string& name);

/// The folder of photos and trained scenes: `named`, or else the usual one; nothing where that does
/// not exist. Throws Error where the named one is missing.
std::optional<std::filesystem::path> bench_data_folder(const std::filesystem::path& named,
                                                       const std::filesystem::path& usual);

}  // namespace darb
