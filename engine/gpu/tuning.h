// Tuning: how the passes run that can be done in several equal forms, resolved. Which form is the
// fastest differs between devices, so the choice belongs to the Device. engine/plan/tuning_names.h
// knows the names on command lines and in files, engine/plan/tuner.h measures.
#pragma once

#include <cstdint>

namespace darb {

struct DeviceInfo;

enum class BackwardBlend {
    subgroup,  // a subgroup walks a tile's list, reductions over its pixels: blend_backward.comp
    team,      // the same by a subgroup an area of the tile: blend_backward_team.comp
    buckets,   // a thread owns an intersection, from checkpoints: blend_backward_buckets.comp
    pixels,    // as a team, sums by pixels of 8 splats at a time: blend_backward_pixels.comp
    pixels4,   // of 4 at a time, which takes less shared memory
};

/// In the order of the enum.
inline constexpr const char* kBackwardBlends[] = {"subgroup", "team", "buckets", "pixels",
                                                  "pixels4"};

constexpr bool is_by_pixels(BackwardBlend form) {
    return form == BackwardBlend::pixels || form == BackwardBlend::pixels4;
}
/// Whether it leaves the sums of every intersection, zeros included; others add to what is there.
constexpr bool writes_every_slot(BackwardBlend form) {
    return form == BackwardBlend::team || is_by_pixels(form);
}

/// How the scatter pass of the radix sort ranks keys, shaders/sort/radix_scatter_*; in the order of
/// their names.
enum class SortScatter { ballot, columns };
inline constexpr const char* kSortScatters[] = {"ballot", "columns"};

/// How the loss walks a picture: loss/loss.comp, or loss/loss_maps.comp and loss_gradient.comp; in
/// the order of their names.
enum class LossWay { strips, tiles };
inline constexpr const char* kLossWays[] = {"strips", "tiles"};

/// Where training photos lie: where the plan of memory says; on the device; on the host, from where
/// each is copied for its step. In the order of their names.
enum class PhotoPlace { automatic, resident, streamed };
inline constexpr const char* kPhotoPlaces[] = {"auto", "resident", "streamed"};

/// Each a specialization constant or a shader, but for the photos' place.
struct Tuning {
    bool scan_by_thread = false;  // Scan::Strategy::team_is_thread
    SortScatter scatter = SortScatter::ballot;
    std::uint32_t blend_threads = 0;  // of the forward blend's workgroup, which has a tile
    // The forward blend by records of splats in shared memory, a subgroup a block of the tile:
    // blend_records.comp, where it serves (Forward::blends_records).
    bool blend_records = false;
    std::uint32_t blend_lanes = 0;  // of a subgroup of both blends; 0: the device's own
    BackwardBlend backward = BackwardBlend::subgroup;
    LossWay loss = LossWay::strips;
    bool exp_builtin = false;  // by the driver's own exp where kernels may (kEvaluationOfDevice)
    PhotoPlace photos = PhotoPlace::automatic;
    bool operator==(const Tuning&) const = default;
};

/// Lanes of the subgroups of BackwardBlend::pixels, which are 32 at most: chosen where that fits,
/// else 32. 0 where the device has no such subgroups, or less than 32 KiB of shared memory.
std::uint32_t lanes_by_pixels(const DeviceInfo& info, std::uint32_t chosen);

/// What a device begins with: on lavapipe what was measured by hand at each of its vector widths.
Tuning usual_tuning(const DeviceInfo& info);

}  // namespace darb
