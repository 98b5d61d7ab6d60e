// SPDX-License-Identifier: MIT
#include "trainer/blocks/manifest.h"

#include <fmt/format.h>

#include <array>
#include <cmath>
#include <nlohmann/json.hpp>

#include "engine/core/error.h"
#include "engine/core/files.h"
#include "engine/core/json_text.h"
#include "trainer/blocks/partition.h"
#include "trainer/step/checkpoint.h"

namespace darb {

namespace {

using ManifestJson = nlohmann::ordered_json;

constexpr int kManifestVersion = 1;
constexpr int kMostCells = 4096;
constexpr std::array<const char*, 4> kPartStates{"waiting", "training", "done", "failed"};

ManifestJson manifest_json(const glm::dvec3& p) {
    return {p.x, p.y, p.z};
}
// JSON knows no infinity: null.
ManifestJson manifest_json(const glm::dvec2& p) {
    ManifestJson pair = ManifestJson::array();
    for (int a = 0; a < 2; ++a)
        pair.push_back(std::isfinite(p[a]) ? ManifestJson(p[a]) : ManifestJson());
    return pair;
}

ManifestJson manifest_json(const PartRecord& part) {
    ManifestJson json{{"state", kPartStates[std::size_t(part.state)]},
                      {"frozen", part.frozen},
                      {"splats", part.splats},
                      {"kept", part.kept},
                      {"peak_device_bytes", part.peak_bytes},
                      {"seconds", part.seconds}};
    if (!part.error.empty()) json["error"] = part.error;
    return json;
}

PartRecord part_from(const ManifestJson& json) {
    PartRecord part;
    const std::string state = json.at("state");
    std::size_t s = 0;
    while (s < kPartStates.size() && state != kPartStates[s]) ++s;
    if (s == kPartStates.size()) throw std::runtime_error("'state' is '" + state + "'");
    part.state = static_cast<PartState>(s);
    part.error = json.value("error", "");
    part.frozen = json.at("frozen");
    part.splats = json.at("splats");
    part.kept = json.at("kept");
    part.peak_bytes = json.at("peak_device_bytes");
    part.seconds = json.at("seconds");
    return part;
}

}  // namespace

std::string block_name(const Partition& cells, std::size_t cell) {
    const auto rows = static_cast<std::size_t>(cells.rows);
    return fmt::format("{}x{}", cell / rows, cell % rows);
}

void write_manifest(const std::filesystem::path& path, const BlocksManifest& m) {
    const Partition& cells = m.cells;
    ManifestJson json{
        {"version", kManifestVersion},
        {"settings", ManifestJson::parse(m.settings)},
        {"dataset", m.dataset},
        {"max_memory_bytes", m.max_memory},
        {"coarse_scale", m.coarse_scale},
        {"columns", cells.columns},
        {"rows", cells.rows},
        {"least_share", kLeastShare},
        {"margin_share", kMarginShare},
        {"up", manifest_json(cells.plane.up)},
        {"u", manifest_json(cells.plane.u)},
        {"v", manifest_json(cells.plane.v)},
        {"coarse", manifest_json(m.coarse)},
        {"blocks", ManifestJson::array()},
        {"joined_splats", m.joined},
        {"held_out", {{"views", m.held_out}, {"psnr_db", m.psnr_db}, {"ssim", m.ssim}}}};
    for (std::size_t c = 0; c < m.blocks.size(); ++c) {
        const BlockRecord& block = m.blocks[c];
        const Cell& cell = cells.cells[c];
        ManifestJson row{{"name", block.name},
                         {"low", manifest_json(cell.low)},
                         {"high", manifest_json(cell.high)},
                         {"margin", manifest_json(cell.margin)},
                         {"points", block.points},
                         {"views", block.views}};
        row.update(manifest_json(block.part));
        json["blocks"].push_back(std::move(row));
    }
    write_file_atomic(path,
                      json.dump(1, ' ', false, ManifestJson::error_handler_t::replace) + "\n");
}

BlocksManifest read_manifest(const std::filesystem::path& path) {
    constexpr const char* kRemedy = "Start without --resume: what is there is kept.";
    const ManifestJson json = ManifestJson::parse(read_text_file(path), nullptr, false);
    if (!json.is_object()) throw Error(path.string(), "is no JSON object", kRemedy);
    BlocksManifest m;
    try {
        if (json.at("version") != kManifestVersion)
            throw std::runtime_error("of version " + json["version"].dump());
        m.settings = nlohmann::json::parse(json.at("settings").dump()).dump();
        m.dataset = json.at("dataset");
        m.max_memory = json.at("max_memory_bytes");
        m.coarse_scale = json.at("coarse_scale");
        m.cells.columns = json.at("columns");
        m.cells.rows = json.at("rows");
        m.coarse = part_from(json.at("coarse"));
        m.joined = json.at("joined_splats");
        for (const ManifestJson& row : json.at("blocks"))
            m.blocks.push_back({row.at("name"), row.at("points"), row.at("views"), part_from(row)});
    } catch (const nlohmann::json::exception& e) {
        throw Error(path.string(), "is no manifest of blocks: " + json_reason(e), kRemedy);
    } catch (const std::exception& e) {
        throw Error(path.string(), std::string("is no manifest of blocks: ") + e.what(), kRemedy);
    }
    if (!(m.coarse_scale > 0 && m.coarse_scale <= 1))
        throw Error(path.string(), fmt::format("'coarse_scale' is {}", m.coarse_scale), kRemedy);
    if (m.cells.columns < 1 || m.cells.rows < 1 || m.cells.columns > kMostCells ||
        m.cells.rows > kMostCells ||
        m.blocks.size() != std::size_t(m.cells.columns) * std::size_t(m.cells.rows))
        throw Error(
            path.string(),
            fmt::format("{} blocks of {}x{} cells", m.blocks.size(), m.cells.columns, m.cells.rows),
            kRemedy);
    return m;
}

void check_manifest(const BlocksManifest& manifest, const std::filesystem::path& path,
                    const BlocksManifest& now, const Grid& asked) {
    std::string differences = settings_differences(nlohmann::json::parse(manifest.settings),
                                                   nlohmann::json::parse(now.settings));
    if (asked.columns > 0 &&
        (asked.columns != manifest.cells.columns || asked.rows != manifest.cells.rows))
        differences += fmt::format(" blocks: {}x{} then, {}x{} now;", manifest.cells.columns,
                                   manifest.cells.rows, asked.columns, asked.rows);
    if (manifest.dataset != now.dataset)
        differences += " the data set: its cameras, points, photo sizes or held-out views differ;";
    if (!differences.empty())
        throw Error(path.string(), "is of a run that was asked for something else:" + differences,
                    "Repeat the options and the data of that run, or start without --resume.");
}

}  // namespace darb
