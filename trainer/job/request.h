// SPDX-License-Identifier: MIT
// TrainRequest: everything that was asked of a training run, with nothing resolved. The command
// line, Python, `darb compare`, `darb cost` and programs that use the library make one, by its
// members or by the names of options (request_options.h); resolve() in trainer/job/job.h turns it
// into a run. A run keeps its request in OUT/request.json, from which
// `--resume` goes on.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "engine/data/dataset.h"
#include "trainer/options/options.h"

namespace darb {

/// Name of the file with the request in the folder of a run.
inline constexpr const char* kRequestFile = "request.json";

struct TrainRequest {
    // What the run trains on.
    std::string dataset;  // a folder, a .json file or a video, as load_training_data() takes it
    DatasetOptions data{.original_where_wide = true};
    std::filesystem::path points;    // in place of the data set's: PLY or LAS; empty: its own
    bool sequential = false;         // photos without cameras: match neighbours in name order only
    std::string panoramas = "auto";  // photos without cameras show all directions: on, off, or
                                     // auto, by what the files say
    int frames = 0;                  // pictures of a video; 0: by its length

    // What it trains. Kernel, footprint, accuracy and strategy are members of `train`.
    TrainOptions train;
    std::string preset;  // name in trainer/options/presets.h; the other members have its values;
                         // empty: none was named
    std::string schedule = "darb";        // or 3dgs, whose values use_schedule() puts into `train`
    std::string effects = "auto";         // as parse_effects() reads them
    std::string refine_cameras = "auto";  // auto: as the plan of effects says; on; off
    bool antialiasing = false;            // as 3DGS spells +antialias
    std::string blocks;  // "auto" or "COLUMNSxROWS": train in parts; empty: the scene as a whole

    // What part of the scene it is about, and what of it goes before it is saved.
    std::string region;         // as region_from() reads it; empty: all of it
    bool drop_outside = false;  // with a region: splats outside go
    std::optional<double> clean_isolated, clean_free_space;  // CleaningRules; absent: off
    std::string clean_haze;                                  // OPACITY,SIZE; empty: off

    // Where it trains, and what it leaves.
    std::filesystem::path output;
    std::string device;        // number or part of a name; empty: the best that is there
    std::string tune;          // forms of passes, as parse_tuning() reads them; empty: the device's
    bool allow_mixed = false;  // ranks may have different devices
    std::vector<int> test_iterations, save_iterations, checkpoint_iterations;
    int checkpoint_interval = 1'000;  // iterations; 0: checkpoint only at the end and on Ctrl-C
    bool report = true;               // OUT/report.html at the end
    bool page = false;                // OUT/scene.html at the end; the command writes it

    // Where it goes on.
    bool resume = false;  // from OUT/checkpoint.darb
    std::filesystem::path start_checkpoint;

    // Not saved in request.json.
    std::filesystem::path depths;    // as 3DGS spells +depth: complete_request() takes it apart
    std::vector<std::string> given;  // options that were set by name, as "--iterations"
    std::vector<std::string> notes;  // what readers of kernels say of them
};

/// Puts the values of the schedule "3dgs" into the options and the effects; options that are set
/// afterwards count. Throws Error for a name that is neither "darb" nor "3dgs".
void use_schedule(TrainRequest& request, std::string_view schedule);

/// The changes of `first` with those of `given` behind them, of which the last word counts; `all`
/// and `none` say everything.
std::string effects_beside(const std::string& first, std::string given);

/// Fills in what follows from the rest, before the data set is loaded: measured depths and what
/// leaving out lenses means for the photos, and OUT, output/NAME of the data set where none was
/// named. A second call changes nothing. Throws Error as check_request() does, and where --depths
/// names a folder that is not read.
void complete_request(TrainRequest& request);

/// Throws Error where no data set or no output folder is named. request: complete.
void require_places(const TrainRequest& request);

/// The checkpoint to go on from; empty: the run starts afresh.
std::filesystem::path checkpoint_to_resume(const TrainRequest& request);

/// Throws Error where two things that were asked for contradict each other.
void check_request(const TrainRequest& request);

/// What was asked for but changes nothing in this run, and why, one line of text each.
std::vector<std::string> unused_options(const TrainRequest& request);

/// The request as JSON, for OUT/request.json. Paths are as seen from the output folder, so that
/// folder and photos can move together. `resume` and `output` are left out.
std::string request_text(const TrainRequest& request);

/// Reads OUT/request.json back, with `resume` set. Throws Error that names the file and the entry.
TrainRequest read_request(const std::filesystem::path& output);

}  // namespace darb
