// The tuner: measures the choices of a device's tuning (tuning_names.h) on a small made-up
// scene, and keeps what it found in a file beside the pipeline cache, once for each device, driver,
// subgroup size and set of shaders.
#pragma once

#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "engine/gpu/commands.h"
#include "engine/plan/tuning_names.h"
#include "engine/raster/blend_backward.h"
#include "engine/raster/forward.h"
#include "engine/raster/frame_buffers.h"
#include "engine/raster/loss.h"

namespace darb {

struct TuningTime {
    std::string group, choice;
    double ms = 0;  // of the group's passes, the median of some frames
};

struct TuningRecord {
    TuningNames choice;             // of every group that is measured
    std::vector<TuningTime> times;  // of all
};

/// One frame of the tuner's scene, forward, loss and backward blend, with the device's tuning at
/// construction. The same splats at every call; more of them where the device is no CPU.
class TuningFrame {
  public:
    explicit TuningFrame(Device& device);

    /// Of each group the milliseconds of its passes together; of the whole frame where the device
    /// has no timestamps. The first call compiles.
    std::vector<double> run(const std::vector<TuningGroup>& groups);

  private:
    GpuSplats splats_;
    FrameBuffers buffers_;
    Forward forward_;
    BlendBackward backward_;
    FrameView view_;
    Loss loss_;
    Buffer cameras_, photo_, d_image_, loss_result_;
    Commands commands_;
    bool has_timestamps_;
};

/// All but buckets, which hold 17 to 34 million intersections a frame in the 4 GiB that Vulkan
/// binds at most, the other way 134 million: how many a run will need is not known here, so they
/// are for who asks for them.
bool may_be_chosen(std::string_view choice);

/// How far w by the driver's own exp strays from the truth, for the kernels of is_exponential: the
/// largest difference, of values of at most 1.
double exp_error(Device& device);

constexpr double kExpTolerance = 3e-6;

/// Each group with all others at their usual choice, and the best of each as choose_form finds it
/// (form_times.h). One that a driver refuses is left out, and so is the driver's exp where
/// exp_error is above the tolerance. The device's tuning and its peak of memory are afterwards as
/// before. group: that one alone; empty: all.
TuningRecord measure_tuning(Device& device, std::string_view group = {},
                            double exp_tolerance = kExpTolerance);

/// The record of this device in the folder of the pipeline cache; nothing where there is none, or
/// it cannot be read, or it is of another device, driver, subgroup size or set of shaders.
std::optional<TuningRecord> read_tuning(const DeviceInfo& info,
                                        const std::filesystem::path& folder);
/// Atomically. A folder that cannot be written is no error: the next process measures again.
void write_tuning(const DeviceInfo& info, const std::filesystem::path& folder,
                  const TuningRecord& record);

struct TuneRequest {
    std::string forced;                            // as parse_tuning; of --tune
    std::string environment;                       // the same, of DARB_TUNE
    bool retune = false;                           // measure anew, known devices too
    std::function<void(const std::string&)> note;  // may be empty
};

/// Sets the tuning of a device: what is forced, then the environment's, then the record, then the
/// usual.
/// Without a record a device that is not known is measured. Throws Error for unknown names.
void tune(Device& device, const TuneRequest& request);

/// The same with the environment's DARB_TUNE, and its lines on stderr. Before anything is made for
/// the device.
void settle_tuning(Device& device, const std::string& forced = {}, bool retune = false);

/// The choice in a line, with the milliseconds of all.
std::string tuning_text(const TuningRecord& record);

}  // namespace darb
