// SPDX-License-Identifier: MIT
// The names of a Tuning: what --tune, DARB_TUNE, checkpoints and records say, and what a device
// allows of it.
#pragma once

#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "engine/gpu/device.h"

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

/// scan, scatter, blend, backward, loss, exp and photos, with what the device allows; lanes where
/// it has several sizes of subgroups.
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
/// If the text does not name them, the lanes were the device's own, exp was a polynomial, and blend
/// was not by records. Throws as parse_tuning.
Tuning resumed_tuning(const DeviceInfo& info, Tuning tuning, std::string_view text,
                      const std::string& where);

/// The choices of the groups that change bits, as text: what a run must keep to be repeated, and
/// the blend where it is by records. exp is left out where it is a polynomial, as in older files.
std::string result_tuning(const Device& device);

}  // namespace darb
