// RadixSort: stable sort of (uint32 key, uint32 value) pairs on the device, least significant digit
// first, up to 8 bits a pass, each pass histogram -> offsets -> scatter. No forward progress
// between workgroups and no subgroup size is assumed; the result is the one stable order, so it
// repeats.
#pragma once

#include <cstdint>
#include <optional>

#include "engine/gpu/buffer_list.h"
#include "engine/gpu/commands.h"
#include "engine/gpu/device.h"
#include "engine/gpu/pipeline.h"
#include "shaders/shared/radix_args.h"

namespace darb {

class RadixSort {
  public:
    /// capacity: the most pairs, > 0. Owns 8 bytes of scratch a pair and a kilobyte a block.
    /// scatter: same result, other cost; absent: as the device is tuned. subgroup_size: 0 = the
    /// device's own.
    RadixSort(Device& device, std::uint32_t capacity, std::optional<SortScatter> scatter = {},
              std::uint32_t subgroup_size = 0);

    std::uint32_t capacity() const { return capacity_; }
    /// What the device's groups of workgroups allow an automatic sort; more is an Error.
    static std::uint64_t max_capacity(const Device& device);
    /// Device memory of an automatic sort of this capacity.
    static std::uint64_t device_bytes(const Device& device, std::uint32_t capacity);
    SortScatter scatter() const { return scatter_; }
    /// Pairs of one workgroup.
    std::uint32_t block() const { return shape_.block(); }

    /// Sorts the first n pairs by the lowest key_bits (1..32) bits of their keys, in place; higher
    /// bits ride along and pairs from n on are not touched. n is the word of count_buffer at
    /// count_offset (bytes, a multiple of 4), cut to the capacity; n = 0 is legal. keys and values
    /// hold [capacity] words. iota_values: values need not be filled, value i is i.
    /// Cheapest where key_bits make an even number of digits (9..16, 25..32); else the pairs are
    /// copied once more. Everything belongs to the current pass() of commands.
    void record(Commands& commands, const Buffer& keys, const Buffer& values,
                const Buffer& count_buffer, std::uint64_t count_offset, int key_bits,
                bool iota_values = false);

  private:
    struct Shape {
        std::uint32_t threads = 0;
        std::uint32_t items = 0;      // keys of one thread
        std::uint32_t subgroups = 0;  // of one workgroup, where each ranks by itself
        std::uint32_t block() const { return threads * items; }
    };
    static BufferList<RadixSort> buffers(std::uint32_t capacity, const Shape& shape);
    static Shape choose_shape(const Device& device, SortScatter scatter,
                              std::uint32_t subgroup_size);
    struct KeyValues {
        const Buffer *keys, *values;
    };
    void record_pass(Commands& commands, const gpu::RadixPassArgs& args, bool iota,
                     const KeyValues& from, const KeyValues& to);

    std::uint32_t capacity_;
    SortScatter scatter_;
    Shape shape_;
    std::uint32_t rows_per_group_ = 1;  // of the offsets
    Pipeline prepare_, histogram_, offsets_, rank_, rank_iota_;
    Buffer plan_, histograms_, totals_, keys_temp_, values_temp_;
};

}  // namespace darb
