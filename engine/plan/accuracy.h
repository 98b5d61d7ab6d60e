// SPDX-License-Identifier: MIT
// The accuracy settings: what a picture, or a training step, may trade for time. One table names
// them, their choices and the presets; flags, help, JSON and the rows of `darb cost` follow it.
#pragma once

#include <array>
#include <optional>
#include <span>
#include <string>
#include <string_view>

#include "engine/raster/forward_options.h"
#include "engine/scene/splat_model.h"

namespace darb {

enum AccuracySettingId {
    kEvaluation,
    kFootprint,
    kAlphaCutoff,
    kTransmittanceStop,
    kStorage,
    kShDegree,
    kDepthOrder,
    kRenderScale,
    kSplatProjection,
    kArithmetic,
    kAccuracyCount
};

enum Preset { kFast, kBalanced, kExact, kPresetCount };

struct AccuracyChoice {
    std::string_view name;  // on the command line and in JSON
    double value = 0;       // what the setting becomes
    bool in_training = true;
};

struct AccuracySetting {
    std::string_view name;  // lower_snake, as in JSON; with dashes and -- the flag
    std::string_view what;  // a line of help
    std::span<const AccuracyChoice> choices;  // the default first
    std::array<int, kPresetCount> preset;     // by Preset: index of the choice
    std::string_view training_remedy;         // what to use in training where a choice is not
};

/// Indexed by AccuracySettingId.
std::span<const AccuracySetting> accuracy_settings();
std::string_view preset_name(int preset);  // fast, balanced, exact
std::optional<int> preset_from_name(std::string_view name);
/// The preset that --accuracy names. Throws Error where there is none of that name.
int preset_of_option(std::string_view name);
std::string accuracy_flag(const AccuracySetting& setting);  // "--alpha-cutoff"
std::string accuracy_help(const AccuracySetting& setting);  // with the names of its choices

/// One choice per setting; all defaults at first.
struct Accuracy {
    std::array<int, kAccuracyCount> choice{};

    const AccuracyChoice& of(int setting) const;
    double value(int setting) const { return of(setting).value; }
    bool operator==(const Accuracy&) const = default;
};

/// The preset's choices; in training those that training does not know stay at their default.
Accuracy preset_accuracy(int preset, bool training = false);
/// Index of a choice. Throws Error that lists the names; in training also where the choice is
/// there for pictures only.
int find_choice(int setting, std::string_view name, bool training = false);
/// "balanced", a preset's name with what differs from it ("fast, alpha_cutoff 1/255"), or what
/// differs from the defaults.
std::string accuracy_text(const Accuracy& accuracy);

/// The settings as a frame needs them, for a model: what the file says is filled in.
struct FrameAccuracy {
    Footprint footprint = Footprint::psi;
    int sh_degree = 0;       // in use, at most the model's
    bool halved = false;     // rendered at half the size and upsampled
    ForwardOptions options;  // the kernel is the model's
};
FrameAccuracy frame_accuracy(const Accuracy& accuracy, const SplatModel& model);

/// Puts them into the options of a forward pass: all but footprint, SH degree and resolution.
void set_options(const Accuracy& accuracy, ForwardOptions& options);
/// Whether the choice `builtin` of evaluation changes anything: not of blends, of the parabolic
/// kernel and of those of one's own but in the forms that need no polynomial.
bool has_builtin_evaluation(int kernel);
/// Whether the evaluation on this device differs from the default's.
bool changes_evaluation(const Device& device, const Accuracy& accuracy, int kernel);

}  // namespace darb
