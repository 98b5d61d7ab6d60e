// SPDX-License-Identifier: MIT
// Buffer: a move-only owner of device memory, usable as storage, indirect and transfer buffer.
#pragma once

#include <vulkan/vulkan.h>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "engine/gpu/device.h"

namespace darb {

enum class Memory {
    device,   // fastest for shaders; host access through staging (or directly on unified memory)
    host,     // host-visible, coherent, cached where there is such: results that the CPU reads
    waiting,  // as host, but for data that waits there to be copied: no part of the device's budget
};

struct MemoryPiece;  // private to engine/gpu

class Buffer {
  public:
    Buffer();
    /// Throws NoRoom naming the buffer, its size and the pass that it is for, where one is given,
    /// when memory or the device's limits do not allow it. A size of 0 is made 16 bytes, so that
    /// every binding is valid. Content is undefined.
    Buffer(Device& device, std::string name, std::uint64_t bytes, Memory memory = Memory::device,
           std::string_view pass = {});
    ~Buffer();
    Buffer(Buffer&&) noexcept;
    Buffer& operator=(Buffer&&) noexcept;

    /// What a buffer of so many bytes adds to Device::allocated_bytes: whole words, 16 bytes for 0;
    /// nothing where it is Memory::waiting.
    static constexpr std::uint64_t charged_bytes(std::uint64_t bytes) {
        return bytes == 0 ? 16 : (bytes + 3) / 4 * 4;
    }

    VkBuffer handle() const { return buffer_; }
    std::uint64_t bytes() const { return bytes_; }
    const std::string& name() const { return name_; }
    explicit operator bool() const { return buffer_ != VK_NULL_HANDLE; }

    /// The mapped memory of a Memory::host or waiting buffer. The caller orders access with fences.
    void* mapped() const { return mapped_; }

    /// Blocking copies through staging; the queue is idle afterwards. offset and size in bytes.
    void upload(std::span<const std::byte> bytes, std::uint64_t offset = 0);
    void download(std::span<std::byte> bytes, std::uint64_t offset = 0) const;
    /// An upload of the first `size` bytes, which write(to) puts there: into the buffer itself
    /// where the host may, else into memory that is copied then. It may throw: these bytes are
    /// undefined then.
    void upload_by(std::uint64_t size, const std::function<void(std::byte* to)>& write);

    template <class T>
    void upload(const std::vector<T>& values, std::uint64_t offset = 0) {
        upload(std::as_bytes(std::span(values)), offset);
    }
    template <class T>
    std::vector<T> download(std::size_t count, std::uint64_t offset = 0) const {
        std::vector<T> values(count);
        download(std::as_writable_bytes(std::span(values)), offset);
        return values;
    }

  private:
    Device* device_ = nullptr;
    std::string name_;
    VkBuffer buffer_ = VK_NULL_HANDLE;
    std::unique_ptr<MemoryPiece> memory_;
    void* mapped_ = nullptr;  // set for all kinds but Memory::device
    void* direct_ = nullptr;  // set where the host may copy without staging, whatever the kind
    std::uint64_t bytes_ = 0;
    std::uint64_t allocated_ = 0;  // bytes charged to the device

    void release() noexcept;
};

/// A range of a buffer, as bound to a shader. size 0 = to the end.
struct BufferRange {
    BufferRange(const Buffer& buffer_) : buffer(&buffer_) {}
    BufferRange(const Buffer& buffer_, std::uint64_t offset_, std::uint64_t size_ = 0)
        : buffer(&buffer_), offset(offset_), size(size_) {}
    const Buffer* buffer;
    std::uint64_t offset = 0;  // bytes; a multiple of 256
    std::uint64_t size = 0;    // bytes
};

// Lists of buffers: which members of an object are buffers, how they are called and how many bytes
// each takes. The object makes its buffers from the list and a plan of memory adds the same list
// up, so that the two cannot differ.

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
