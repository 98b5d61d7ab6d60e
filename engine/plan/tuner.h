// SPDX-License-Identifier: MIT
// The tuner: measures the choices of a device's tuning on a small made-up
// scene, and keeps what it found in a file beside the pipeline cache, once for each device, driver,
// subgroup size and set of shaders.
#pragma once

#include <cstddef>
#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "engine/gpu/commands.h"
#include "engine/gpu/device.h"
#include "engine/raster/backward.h"
#include "engine/raster/forward.h"
#include "engine/raster/frame_buffers.h"
#include "engine/raster/loss.h"

namespace darb {

/// Name of a group -> name of its choice; what is missing is left as it is.
using TuningNames = std::map<std::string, std::string, std::less<>>;

/// A group of passes and how they can run on a device.
struct TuningGroup {
    std::string name;
    std::vector<std::string> choices;  // the usual one first
    // The passes whose time it decides, by their names in Commands::pass; none: it is never
    // measured.
    std::vector<std::string> passes;
    bool changes_bits = false;  // results differ by rounding, or by the order of sums of floats
};

/// scan, scatter, depths, emit, tiles, blend, backward, sums, loss, exp and photos, with what the
/// device allows; lanes where it has several sizes of subgroups.
std::vector<TuningGroup> tuning_groups(const DeviceInfo& info);

/// Whether the fastest choices are known without measuring: lavapipe, where measuring would take
/// longer than most pictures.
bool is_known_device(const DeviceInfo& info);

/// "scatter=ballot,backward=buckets"; "" names none. Throws Error{where, ...} that lists the known
/// names.
TuningNames parse_tuning(const DeviceInfo& info, std::string_view text, const std::string& where);
/// What a checkpoint names, less the lanes where this device has no such subgroups.
TuningNames checkpoint_tuning(const DeviceInfo& info, std::string_view text,
                              const std::string& where);
/// The names as text in the same form, in the order of the groups.
std::string names_text(const TuningNames& names);

/// The choice for every group.
TuningNames tuning_names(const Tuning& tuning);
/// names: as parse_tuning gives them.
Tuning with_names(Tuning tuning, const TuningNames& names);
/// The tuning for whoever goes on with a run that began with this text: it leads to the same bits.
/// If the text does not name them, the lanes were the device's own, exp was a polynomial, blend
/// was not by records and sums not by chunks. Throws as parse_tuning.
Tuning resumed_tuning(const DeviceInfo& info, Tuning tuning, std::string_view text,
                      const std::string& where);

/// The choices of the groups that change bits, as text: what a run must keep to be repeated, and
/// the blend where it is by records. exp is left out where it is a polynomial, as in older files,
/// and sums where each splat has a thread.
std::string result_tuning(const Device& device);

struct TuningTime {
    std::string group, choice;
    double ms = 0;  // time of the group's passes, the median of some frames
};

struct TuningRecord {
    TuningNames choice;             // for every group that is measured
    std::vector<TuningTime> times;  // one for each choice that was timed
    bool seen_in_a_run = false;     // look_again() has compared forms on the splats of a run
};

/// A frame on which forms are timed: splats on the device, drawn through a camera.
struct TimedFrame {
    const GpuSplats& splats;
    gpu::CameraData camera;
    int sh_degree = 0;  // degree of the colours, at most the splats'
    ForwardOptions options;
};

/// Forward, loss and gradients of one frame, by the device's tuning at construction.
class TuningFrame {
  public:
    /// With the tuner's own scene: the same splats at every call, and more of them where the device
    /// is no CPU.
    explicit TuningFrame(Device& device);
    /// With the caller's splats, which must outlive it.
    TuningFrame(Device& device, const TimedFrame& frame);

    /// For each group the milliseconds of its passes together; where the device has no timestamps,
    /// those of the whole frame. The first call compiles.
    std::vector<double> run(const std::vector<TuningGroup>& groups);

  private:
    TuningFrame(Device& device, std::unique_ptr<GpuSplats> made);

    std::unique_ptr<GpuSplats> made_;  // null: the caller's
    const GpuSplats& splats_;
    FrameBuffers buffers_;
    Forward forward_;
    Backward backward_;
    GradientBuffers gradients_;
    FrameView view_;
    Loss loss_;
    Buffer cameras_, photo_, d_image_, loss_result_;
    Commands commands_;
    bool has_timestamps_;
};

/// True for all but buckets: in the 4 GiB that Vulkan binds at most, they hold 17 to 34 million
/// intersections a frame, the other way 134 million. How many a run will need is not known here, so
/// only who asks for buckets gets them.
bool may_be_chosen(std::string_view choice);

/// How far w by the driver's own exp strays from the truth, for the kernels of is_exponential: the
/// largest difference, of values of at most 1.
double exp_error(Device& device);

constexpr double kExpTolerance = 3e-6;

/// Measures each group with all others at their usual choice; the best of each is as choose_form
/// finds it. One that a driver refuses is left out, and so is the driver's exp where exp_error is
/// above the tolerance. The device's tuning and its peak of memory are afterwards as before. group:
/// the only one to measure; empty: all.
TuningRecord measure_tuning(Device& device, std::string_view group = {},
                            double exp_tolerance = kExpTolerance);

/// A second look at a record, on a frame of a run: in each group the record's choice is compared
/// with the fastest other one, and the other takes its place where it wins as choose_form finds
/// it. The record that it returns is seen_in_a_run. The device's tuning and its peak of memory are
/// afterwards as before; gradients by the camera, by alpha and by depth are left out.
TuningRecord look_again(Device& device, TuningRecord record, TimedFrame frame);

/// The record of this device in the folder of the pipeline cache; nothing where there is none, or
/// it cannot be read, or it is of another device, driver, subgroup size or set of shaders.
std::optional<TuningRecord> read_tuning(const DeviceInfo& info,
                                        const std::filesystem::path& folder);
/// Writes the record atomically. A folder that cannot be written is no error: the next process
/// measures again.
void write_tuning(const DeviceInfo& info, const std::filesystem::path& folder,
                  const TuningRecord& record);

struct TuneRequest {
    std::string forced;                            // from --tune, as for parse_tuning
    std::string environment;                       // the same from DARB_TUNE
    bool retune = false;                           // measure again, known devices too
    std::function<void(const std::string&)> note;  // may be empty
};

/// Sets the tuning of a device: what is forced, else the environment's, else the record's, else the
/// usual one. An unknown device without a record is measured. Throws Error for unknown names.
void tune(Device& device, const TuneRequest& request);

/// The same with the environment's DARB_TUNE, and its notes on stderr. To be called before anything
/// is made for the device.
void settle_tuning(Device& device, const std::string& forced = {}, bool retune = false);

/// The choice on one line, with the milliseconds of all.
std::string tuning_text(const TuningRecord& record);

// How forms of a pass are timed and compared, without a device: the tuner gives it one, tests give
// it a made-up one with a clock of its own.
//
// A GPU that idles runs at a fraction of its clock and takes up to a second of work to reach it. It
// idles while pipelines compile, so whatever is timed first seems slow. Three things keep that, and
// a card that becomes hot, out of the comparison: work until times are stable, forms in turn, and
// ratios within a turn.

/// What is timed.
struct TimedForms {
    std::function<double(std::size_t form)> sample_ms;  // one frame by this form; 0: the usual one
    std::function<double()> now_s;                      // a clock that does not go back
};

struct TimingEffort {
    double warm_least_s = 0, warm_most_s = 0;  // work before the forms are timed; 0: none
    int rounds_least = 3, rounds_most = 3;     // all forms take a turn in each
    double rounds_s = 0;                       // once these are over, no more rounds than the least
};

struct FormTimes {
    std::vector<std::vector<double>> rounds_ms;  // [form][round]

    double median_ms(std::size_t form) const;
};

/// The usual form, or the one that takes least of those that are worth a change: the median of its
/// ratios to the usual one, round by round, is at most 0.97, and lies below 1 by more than twice
/// the standard error that their spread gives it. may_win: for each form; empty: all may.
std::size_t best_form(const FormTimes& times, const std::vector<bool>& may_win = {});

/// Runs the usual form until two windows of a fifth of a second agree to 2 %, within the effort's
/// bounds. Returns whether they agreed.
bool warm_up(const TimedForms& forms, const TimingEffort& effort);

/// Times these forms in rounds, every other round in the opposite order; in the order of `which`.
FormTimes time_rounds(const TimedForms& forms, std::span<const std::size_t> which,
                      const TimingEffort& effort);

struct FormChoice {
    std::size_t form = 0;
    std::vector<double> ms;  // median time of each form
};

/// Warms up, times all forms, and where another than the usual one is best, looks a second time at
/// these two: the usual one stays unless it loses again.
FormChoice choose_form(const TimedForms& forms, std::size_t count, const TimingEffort& effort,
                       const std::vector<bool>& may_win = {});

}  // namespace darb
