// SPDX-License-Identifier: MIT
#include "tools/paper/compare_share.h"

// NLOHMANN_DEFINE_TYPE looks for these by the type's namespace.
namespace nlohmann {
template <class T>
struct adl_serializer<std::optional<T>> {
    static void to_json(json& j, const std::optional<T>& value) {
        j = value ? json::array({*value}) : json::array();
    }
    static void from_json(const json& j, std::optional<T>& value) {
        value = j.empty() ? std::nullopt : std::optional<T>(j.at(0).get<T>());
    }
};
}  // namespace nlohmann

namespace darb {

NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(ComparedView, name, psnr_db, ssim, lpips, picture)
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(ComparedScale, scale, psnr_db, ssim)
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(ComparedAt, iteration, seconds, psnr_db, ssim, lpips, splats,
                                   model_mb, model, views, scales, arc_db, off_path_db)
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(CurvePoint, iteration, seconds, loss, splats)
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(LearnedShapes, edges, shares, percentiles)
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(BlendStatistics, blended_per_pixel, intersections_per_splat,
                                   blend_ms, frame_ms, ns_per_splat_pixel)
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(ComparedRun, kernel, seed, folder, failure, notes, exit_code, at,
                                   curve, peak_mb, blending, shapes)

Bytes bytes_of_runs(const std::vector<ComparedRun>& runs) {
    const std::vector<std::uint8_t> cbor = nlohmann::json::to_cbor(runs);
    const auto bytes = std::as_bytes(std::span(cbor));
    return {bytes.begin(), bytes.end()};
}

std::vector<ComparedRun> runs_of_bytes(std::span<const std::byte> bytes) {
    const auto* const first = reinterpret_cast<const std::uint8_t*>(bytes.data());
    return nlohmann::json::from_cbor(first, first + bytes.size());
}

std::vector<ComparedRun> runs_of_all(Ranks& ranks, const std::vector<ComparedRun>& own,
                                     std::size_t items) {
    std::vector<std::vector<ComparedRun>> of_rank;
    for (const Bytes& bytes : ranks.gather(bytes_of_runs(own)))
        of_rank.push_back(runs_of_bytes(bytes));
    std::vector<ComparedRun> runs;
    for (std::size_t i = 0; i < items; ++i) {
        std::vector<ComparedRun>& its = of_rank[turn_of(i, of_rank.size())];
        const std::size_t at = i / of_rank.size();
        if (at >= its.size()) continue;
        runs.push_back(std::move(its[at]));
    }
    return runs;
}

}  // namespace darb
