// SPDX-License-Identifier: MIT
#include "engine/ranks/ranks.h"

#include <algorithm>
#include <cstdlib>
#include <cstring>

#include "engine/core/error.h"

namespace darb {

Bytes OneRank::exchange(int partner, std::span<const std::byte>) {
    DARB_CHECK(false, "rank {} of one", partner);
    return {};
}

std::vector<Bytes> OneRank::gather(std::span<const std::byte> bytes) {
    return {Bytes(bytes.begin(), bytes.end())};
}

void OneRank::fail(const std::string& what, int exit_code) {
    DARB_CHECK(false, "{}, {}: one rank throws", what, exit_code);
    std::abort();
}

// Open MPI, MPICH and Intel MPI, Slurm with PMIx or PMI2. A Slurm job need not be an MPI job: only
// the variables of srun's plugin tell.
int launched_ranks() {
    for (const char* name : {"OMPI_COMM_WORLD_SIZE", "PMI_SIZE", "MV2_COMM_WORLD_SIZE"})
        if (const char* const value = std::getenv(name)) return std::max(1, std::atoi(value));
    if (std::getenv("PMIX_RANK") || std::getenv("PMI_RANK"))
        if (const char* const value = std::getenv("SLURM_NTASKS"))
            return std::max(1, std::atoi(value));
    return 1;
}

Bytes from_first(Ranks& ranks, std::span<const std::byte> bytes) {
    return ranks.gather(ranks.is_first() ? bytes : std::span<const std::byte>{}).front();
}

std::uint32_t least(Ranks& ranks, std::uint32_t value) {
    for (const Bytes& other : ranks.gather(bytes_of(value))) {
        std::uint32_t its = 0;
        DARB_CHECK(other.size() == sizeof its, "{} bytes", other.size());
        std::memcpy(&its, other.data(), sizeof its);
        value = std::min(value, its);
    }
    return value;
}

}  // namespace darb
