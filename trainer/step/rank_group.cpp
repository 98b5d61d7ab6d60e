// SPDX-License-Identifier: MIT
#include "trainer/step/rank_group.h"

#include <fmt/format.h>
#include <zlib.h>

#include <algorithm>
#include <cstring>
#include <nlohmann/json.hpp>

#include "engine/core/error.h"
#include "engine/core/files.h"
#include "engine/core/system.h"
#include "engine/plan/tuner.h"

namespace darb {

namespace {

std::string text_of(const Bytes& bytes) {
    return std::string(reinterpret_cast<const char*>(bytes.data()), bytes.size());
}

// Parameters alone: what else there is follows from the same gradients.
std::uint32_t checksum(const GpuSplats& splats) {
    uLong crc = crc32(0, nullptr, 0);
    for (int a = 0; a < kAttributeCount; ++a) {
        const Buffer& buffer = splats.parameters(a);
        if (splats.stride(a) == 0) continue;
        const auto words = buffer.download<std::uint32_t>(buffer.bytes() / 4);
        crc = crc32_z(crc, reinterpret_cast<const Bytef*>(words.data()), 4 * words.size());
    }
    return static_cast<std::uint32_t>(crc);
}

// Where both are JSON objects, the entries of `text` that `other` lacks or has otherwise; else
// `text`.
std::string what_differs(const std::string& text, const std::string& other) {
    const auto own = nlohmann::json::parse(text, nullptr, false);
    const auto its = nlohmann::json::parse(other, nullptr, false);
    if (!own.is_object() || !its.is_object()) return text;
    nlohmann::json left = nlohmann::json::object();
    for (const auto& [name, value] : own.items())
        if (!its.contains(name) || its[name] != value) left[name] = value;
    return left.dump();
}

}  // namespace

RankFacts rank_facts() {  // hashes the program, as one version has many builds
    return {{"program", fmt::format("{} ({})", DARB_VERSION, fact_of(read_file(program_file())))}};
}

RankFacts rank_facts(const Device& device) {
    RankFacts facts = rank_facts();
    facts.emplace_back("device", device.info().name);
    facts.emplace_back("driver", device.info().driver);
    facts.emplace_back("tuning", names_text(tuning_names(device.tuning())));
    return facts;
}

std::string fact_of(std::span<const std::byte> bytes) {
    const auto* data = reinterpret_cast<const Bytef*>(bytes.data());
    return fmt::format("{:08x}", crc32_z(crc32(0, nullptr, 0), data, bytes.size()));
}

void check_batch(const Ranks& ranks, int batch) {
    if (batch % ranks.count() == 0) return;
    throw Error(fmt::format("--batch {}", batch),
                fmt::format("has no equal parts for {} ranks", ranks.count()),
                "Start 1, 2, 4, 8 ... ranks, and give a batch of at least as many views.");
}

void check_same(Ranks& ranks, const RankFacts& facts) {
    const std::string own =
        nlohmann::json(facts).dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
    const std::vector<Bytes> all = ranks.gather(std::as_bytes(std::span(own)));
    const auto first = nlohmann::json::parse(text_of(all.front())).get<RankFacts>();
    std::string differences;
    for (std::size_t r = 1; r < all.size(); ++r) {
        const auto its = nlohmann::json::parse(text_of(all[r])).get<RankFacts>();
        for (std::size_t f = 0; f < std::min(first.size(), its.size()); ++f)
            if (its[f] != first[f])
                differences += fmt::format("{}rank {} has the {} {}, rank 0 {}",
                                           differences.empty() ? "" : "; ", r, its[f].first,
                                           what_differs(its[f].second, first[f].second),
                                           what_differs(first[f].second, its[f].second));
    }
    if (!differences.empty())
        throw Error("the ranks", differences,
                    "Give all the same program, data set and options. Devices and drivers may "
                    "differ with --allow-mixed, without the promise of equal bits.");
}

bool any_stops(Ranks& ranks, bool stop) {
    const std::uint32_t goes_on = stop ? 0 : 1;
    return least(ranks, goes_on) == 0;
}

void check_equal_splats(Ranks& ranks, const GpuSplats& splats, int iteration) {
    const std::uint32_t own = checksum(splats);
    const std::vector<Bytes> all = ranks.gather(bytes_of(own));
    std::string others;
    for (std::size_t r = 1; r < all.size(); ++r)
        if (all[r] != all.front()) others += fmt::format("{}{}", others.empty() ? "" : ", ", r);
    if (!others.empty())
        throw Error(fmt::format("iteration {}", iteration),
                    fmt::format("the splats of rank {} differ from those of rank 0", others),
                    "Memory or a device fails there, or rounds differently (--allow-mixed). The "
                    "last checkpoint is intact.");
}

}  // namespace darb
