// SPDX-License-Identifier: MIT
// The options of a training run, one row each. A row makes the flag of `darb train` with its help
// and its limits, the value in the schedule of 3DGS, and the place in the text of the settings,
// which checkpoints hold and a resumed run must repeat. A new option is a member of TrainOptions
// with its row, and its use.
#pragma once

#include <limits>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <span>
#include <string>
#include <variant>

#include "trainer/options/schedule.h"

namespace darb {

/// The member that a row is for; std::monostate: more than a number, with a flag of its own.
using OptionMember = std::variant<
    std::monostate, bool TrainOptions::*, int TrainOptions::*, float TrainOptions::*,
    double TrainOptions::*, std::uint64_t TrainOptions::*, std::optional<int> TrainOptions::*,
    std::optional<float> TrainOptions::*, std::optional<double> TrainOptions::*,
    std::optional<std::uint32_t> TrainOptions::*, std::optional<std::uint64_t> TrainOptions::*>;

/// Headings of the options in help.
namespace option_group {
inline constexpr const char *kRun = "Run", *kScene = "Scene", *kPhotos = "Photos in training",
                            *kRates = "Learning rates", *kDensity = "Density control",
                            *kLimits = "Regularisers and limits of splats", *kStart = "Start",
                            *kEffects = "Effects", *kRegion = "Region and cleaning",
                            *kInput = "Photos and output", *kSaving = "Saving and testing",
                            *kAccuracy = "Accuracy", *kDevice = "Device and passes";
}

/// What an option takes.
enum class OptionKind { on_off, whole, real, size, text };

struct OptionRow {
    const char* flags = "";    // with commas, dashes and all; "": presets and plans alone set it
    const char* setting = "";  // JSON pointer into the settings; "": not there, nothing to repeat
    const char* name = "";     // in a saved request, where neither flag nor setting names it
    OptionMember member = {};
    const char* group = option_group::kRun;
    const char* help = "";
    const char* unit = "";   // as help has it behind the default
    const char* usual = "";  // the default in words, where it is no constant
    double least = 0, most = std::numeric_limits<double>::max();
    std::optional<double> in_3dgs =
        {};                       // in the schedule of 3DGS, where that is another; 0 or 1: bool
    const char* strategies = "";  // those that know it; "": all
    bool is_switch = false;       // a flag without a value; after "!" the flag for false
    bool is_size = false;         // bytes, with a unit, as 1.5GB
    /// What comes of it, for the settings; nullptr: the member.
    nlohmann::json (*resolved)(const TrainOptions&, const Schedule&) = nullptr;
    /// Whether the settings have it; nullptr: always. Files from before an option lack it.
    bool (*stands)(const TrainOptions&, const Schedule&) = nullptr;
};

std::span<const OptionRow> option_rows();
/// The row with this flag. Throws Error where there is none.
const OptionRow& option_row(std::string_view flag);

/// The longest of a row's flags, without those for false.
std::string option_name(const OptionRow& row);
/// The default as text: a number with its unit, or the row's words.
std::string default_text(const OptionRow& row);
/// By the member; text where the row has none.
OptionKind option_kind(const OptionRow& row);
/// "a number from 0 to 1", "a whole number of at least 0", "on or off", for people.
std::string limits_text(const OptionRow& row, OptionKind kind);
std::string limits_text(const OptionRow& row);

/// What was typed for a row without a member, as its limits allow it. They throw as set_option().
bool option_on(const OptionRow& row, const std::string& text);
int option_whole(const OptionRow& row, const std::string& text);
double option_real(const OptionRow& row, const std::string& text);

/// Takes over a value as it was typed. Throws Error with the flag, the value, the reason and what
/// it takes: no number, one that is not finite or not whole where it must be, or out of limits.
void set_option(const OptionRow& row, const std::string& text, TrainOptions& options);

/// A row's member as it was asked for, for a saved request: null where it is absent, as where the
/// row has no member. set_member takes it back and throws Error for a value of another type or out
/// of limits.
nlohmann::json member_json(const OptionRow& row, const TrainOptions& options);
void set_member(const OptionRow& row, const nlohmann::json& value, TrainOptions& options);

/// Every option that changes the result, resolved, as one JSON object.
nlohmann::json settings_json(const Schedule& schedule);

}  // namespace darb
