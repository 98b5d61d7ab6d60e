// The cases of `darb bench`, each by name and by what it needs.
#pragma once

#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "engine/core/image.h"
#include "engine/data/dataset.h"
#include "engine/gpu/device.h"
#include "tools/bench/measure.h"
#include "trainer/options/options.h"

namespace darb {

struct BenchOptions {
    Sampling sampling;
    bool full = false;                          // the long set-up: fox_800 after 7,000 iterations
    std::optional<std::filesystem::path> data;  // bench_data_folder()
    std::string device;                         // what --device said, for processes started
    std::filesystem::path program;              // the darb command itself, likewise
    /// What darb train does to a data set and its options before it starts.
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
/// The choices of the passes that have several (engine/plan/tuning_names.h), a row each.
std::vector<BenchCase> tuning_cases();
/// The first picture of a new process, shaders compiled or from the driver's cache.
std::vector<BenchCase> start_cases();

/// All of them, in this order.
std::vector<BenchCase> bench_cases(bool full);

/// Of one's own scene: frames of two sizes, or of the data set's cameras; with a data set also
/// steps of training that go on from the scene.
std::vector<BenchCase> own_cases(const std::filesystem::path& scene,
                                 const std::filesystem::path& dataset);

/// A frame with the blend's figures, as the cases of render_cases() have it.
BenchResult measure_picture(Device& device, const SplatModel& model, const Camera& camera,
                            const DeviceRates& rates, const BenchOptions& options);
/// Frame times of a model at one camera, as `darb render` draws it, without blend figures.
BenchResult measure_frames(Device& device, const SplatModel& model, const Camera& camera,
                           const DeviceRates& rates, const Sampling& sampling);
/// Steps of a trainer that was set up; without blend figures.
class Trainer;
BenchResult measure_steps(Trainer& trainer, int steps_a_sample, const Sampling& sampling);

}  // namespace darb
