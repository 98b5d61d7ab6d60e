// SPDX-License-Identifier: MIT
// blocks/manifest.json of a run in blocks: what it was asked for, its cells, and how far each part
// has come. --resume goes on from it.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "trainer/blocks/partition.h"

namespace darb {

enum class PartState { waiting, training, done, failed };

/// State and results of the coarse model or of one block.
struct PartRecord {
    PartState state = PartState::waiting;
    std::string error;             // why the part failed
    std::uint32_t frozen = 0;      // splats of its surroundings
    std::uint32_t splats = 0;      // splats at the end, the frozen ones included
    std::uint32_t kept = 0;        // splats at the end that lie in its cell
    std::uint64_t peak_bytes = 0;  // peak of device memory
    double seconds = 0;            // time that training took
};

struct BlockRecord {
    std::string name;  // COLUMNxROW, from 0; its folder
    std::size_t points = 0;
    std::vector<std::size_t> views;  // indices among the training views
    PartRecord part;
};

struct BlocksManifest {
    std::string settings;          // settings_text()
    std::string dataset;           // dataset_fingerprint() without photos
    std::uint64_t max_memory = 0;  // bytes of device memory; 0: no bound
    double coarse_scale = 0;       // scale of the photos' sides for the coarse model
    Partition cells;
    PartRecord coarse;
    std::vector<BlockRecord> blocks;
    std::uint32_t joined = 0;  // splats of the joined scene; 0: not joined yet
    std::size_t held_out = 0;  // views that it was measured on
    double psnr_db = 0, ssim = 0;
};

std::string block_name(const Partition& cells, std::size_t cell);

void write_manifest(const std::filesystem::path& path, const BlocksManifest& manifest);

/// What a file holds. Of the cells it has columns and rows only; the data set gives the rest.
/// Throws Error naming file and key.
BlocksManifest read_manifest(const std::filesystem::path& path);

/// Throws Error naming what differs where the manifest is for other settings, another data set, or
/// other blocks than were asked for (0: whatever it has).
void check_manifest(const BlocksManifest& manifest, const std::filesystem::path& path,
                    const BlocksManifest& now, const Grid& asked);

}  // namespace darb
