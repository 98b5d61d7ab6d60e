// SPDX-License-Identifier: MIT
// Checkpoints: everything a run needs to go on bit-equal. One file: "DARBCKPT", version, a
// CRC-32 of the rest, a JSON header with the sizes and the settings, float32 arrays. Written
// atomically.
#pragma once

#include <filesystem>
#include <nlohmann/json_fwd.hpp>
#include <string>

#include "engine/data/dataset.h"
#include "trainer/options/schedule.h"
#include "trainer/step/held_out_gain.h"
#include "trainer/step/trainer_state.h"

namespace darb {

struct Checkpoint {
    TrainerState state;
    std::string settings;                      // settings_text() of the run that wrote it
    std::string dataset;                       // dataset_fingerprint() of it
    double seconds = 0;                        // training time until then
    std::string tuning = "backward=subgroup";  // result_tuning(): the only ones of older files
    GainState gain = {};                       // for a run with end_without_gain
};

/// What a file holds.
std::vector<std::byte> checkpoint_bytes(const Checkpoint& checkpoint);
/// Throws Error naming the file where it cannot be written; an older file is then intact.
void write_checkpoint(const std::filesystem::path& path, const Checkpoint& checkpoint);

/// Throws Error naming the file and the place: not a checkpoint, truncated, damaged (CRC), of
/// another version, or with sizes that do not fit together.
Checkpoint read_checkpoint(const std::filesystem::path& path);
Checkpoint parse_checkpoint(std::span<const std::byte> file, const std::string& where);

/// Every option that changes the result, as one JSON object in text.
std::string settings_text(const Schedule& schedule);
/// Each setting that differs between two objects of settings, with both values; "": none does.
std::string settings_differences(const nlohmann::json& before, const nlohmann::json& now);
/// Names, sizes, cameras and points of a data set and the pixels of its photos (or none), hashed;
/// about a second for a gigabyte of pixels.
std::string dataset_fingerprint(const Dataset& dataset, const std::vector<ImageU8>& photos);

/// Throws Error naming each difference when the checkpoint is of other settings or another data
/// set. fingerprint: that of the data set now.
void check_resumable(const Checkpoint& checkpoint, const std::filesystem::path& path,
                     const Schedule& schedule, const Dataset& dataset,
                     const std::string& fingerprint);

}  // namespace darb
