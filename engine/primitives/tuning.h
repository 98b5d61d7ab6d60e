// Tuning: passes that can be done in several equal ways, because the fastest one differs between
// devices. Which one runs is a property of the device (Device::variants), read by whatever is made
// for it; engine/plan/tuner.h measures which is the fastest.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "engine/gpu/device.h"
#include "engine/primitives/radix_sort.h"

namespace darb {

enum class BackwardBlend {
    subgroup,  // a subgroup walks a tile's list, reductions over its pixels: blend_backward.comp
    buckets,   // a thread owns a pair, from checkpoints: blend_backward_buckets.comp
};

/// The ways of a device, each a specialization constant or a shader.
struct Tuning {
    bool scan_by_thread = false;      // Scan::Strategy::team_is_thread
    RadixSort::Strategy scatter{};    // ballot or columns
    std::uint32_t blend_threads = 0;  // of the forward blend's workgroup, which has a tile
    BackwardBlend backward{};
};

/// One choice and its ways on a device.
struct TuningGroup {
    std::string name;
    std::vector<std::string> ways;    // the default first
    std::vector<std::string> passes;  // whose time the way decides, as Commands::pass names them
    bool changes_bits = false;        // results differ by the order of sums of floats
};

/// scan, scatter, blend and backward, with what the device allows.
std::vector<TuningGroup> tuning_groups(const DeviceInfo& info);

/// Whether the ways of this device are known without measuring: lavapipe, whose best ones were
/// measured by hand at each of its vector widths, and where measuring would take longer than most
/// pictures.
bool is_known_device(const DeviceInfo& info);

Variants default_variants(const DeviceInfo& info);

/// "scatter=ballot,backward=buckets"; "" names none. Throws Error{where, ...} that lists the known
/// names.
Variants parse_variants(const DeviceInfo& info, std::string_view text, const std::string& where);
/// In the same form, in the order of the groups.
std::string variants_text(const Variants& variants);

/// One way for every group: what is set for the device, else what DARB_TUNE says, else the
/// default. Throws Error where DARB_TUNE or the device's names are not known.
Variants all_variants(const Device& device);
Tuning tuning_of(const Device& device);

/// Those of all_variants() that change bits, as text: what a run must keep to repeat.
std::string result_variants(const Device& device);

}  // namespace darb
