// SPDX-License-Identifier: MIT
// Lists of buffers: which members of an object are buffers, how they are called and how many bytes
// each takes. The object makes its buffers from the list and a plan of memory adds the same list
// up, so that the two cannot differ.
#pragma once

#include <cstdint>
#include <vector>

#include "engine/gpu/buffer.h"

namespace darb {

template <class Owner>
struct BufferRow {
    Buffer Owner::*buffer;
    const char* name;
    std::uint64_t bytes;
};

template <class Owner>
using BufferList = std::vector<BufferRow<Owner>>;

/// What the buffers of a list are charged with, as Device::allocated_bytes counts.
template <class Owner>
std::uint64_t charged_bytes(const BufferList<Owner>& list) {
    std::uint64_t bytes = 0;
    for (const BufferRow<Owner>& row : list) bytes += Buffer::charged_bytes(row.bytes);
    return bytes;
}

/// Makes the buffers of a list, content undefined. All that they replace goes first: there is never
/// an old and a new one at a time. Where one cannot be had those behind it are empty, and the error
/// names the pass: the first that needs them.
template <class Owner>
void make_buffers(Device& device, Owner& owner, const BufferList<Owner>& list, const char* pass) {
    for (const BufferRow<Owner>& row : list) owner.*row.buffer = Buffer();
    for (const BufferRow<Owner>& row : list)
        owner.*row.buffer = Buffer(device, row.name, row.bytes, Memory::device, pass);
}

}  // namespace darb
