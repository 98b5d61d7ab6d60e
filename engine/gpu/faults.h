// SPDX-License-Identifier: MIT
// Faults injected for tests, as text a comma-separated list (the command reads it from DARB_FAULT):
//   oom:NAME   creating the buffer NAME fails as if the device were out of memory
//   lost:N     the N-th submit of the device (from 1) and all later ones report a lost device;
//              copies between host and device do not count
//   binding:N  the device says that a storage buffer binding holds at most N bytes
//   allocation:N  the device says that a buffer has at most N bytes
//   allocations:N  the driver allows N allocations of memory at once
//   buffers:N  a shader binds at most N storage buffers
//   timestamps:N  of a timestamp only the lowest N bits are right; 0: there are none
//   own_subgroups  no size of subgroups can be required, the device has its own
//   no_half    the device has no arithmetic in half precision
//   discrete   the device has memory of its own, which the host does not reach
//   memory:N   buffers beyond N bytes in all fail as if the device were out of memory
// None in normal use. A text that is none of these is an Error.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace darb {

struct Faults {
    std::vector<std::string> out_of_memory;  // buffer names
    std::uint64_t lost_at_submit = 0;        // 0 = never
    std::uint64_t binding_bytes = 0;         // 0 = what the device says
    std::uint64_t allocation_bytes = 0;      // 0 = what the device says
    std::uint64_t memory_bytes = 0;          // 0 = no limit
    std::uint64_t allocations = 0;           // 0 = what the driver allows
    std::uint64_t storage_buffers = 0;       // 0 = what the device says
    std::optional<std::uint32_t> timestamp_bits;
    bool own_subgroups = false;
    bool no_half = false;
    bool discrete = false;

    /// in_all: bytes of all buffers, including this one.
    bool fails_allocation(std::string_view buffer, std::uint64_t in_all) const;
    /// count: of all allocations, including the new one.
    bool fails_allocations(std::uint64_t count) const {
        return allocations != 0 && count > allocations;
    }
    bool fails_submit(std::uint64_t submit) const {
        return lost_at_submit != 0 && submit >= lost_at_submit;
    }
};

Faults parse_faults(std::string_view text);

}  // namespace darb
