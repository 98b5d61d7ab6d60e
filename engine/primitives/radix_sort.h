// SPDX-License-Identifier: MIT
// RadixSort: stable sort of (uint32 key, uint32 value) pairs on the device, least significant digit
// first, with up to 8 bits per pass, or 9; each pass is histogram -> offsets -> scatter. It assumes
// no forward progress between workgroups and no subgroup size. A stable sort has only one result,
// so every run gives the same.
#pragma once

#include <cstdint>
#include <optional>

#include "engine/gpu/buffer.h"
#include "engine/gpu/commands.h"
#include "engine/gpu/device.h"
#include "engine/gpu/pipeline.h"
#include "shaders/shared/radix_args.h"

namespace darb {

class RadixSort {
  public:
    /// capacity: the largest number of pairs, > 0. Allocates 8 bytes of scratch memory per pair and
    /// a kilobyte per block. scatter: the method, which affects the cost but not the result;
    /// absent: as the device is tuned. subgroup_size: 0 = the device's own. digit_bits: the most
    /// bits of a pass, 8 or 9.
    RadixSort(Device& device, std::uint32_t capacity, std::optional<SortScatter> scatter = {},
              std::uint32_t subgroup_size = 0, int digit_bits = kDigitBits);
    static constexpr int kDigitBits = 8, kWideDigitBits = 9;

    std::uint32_t capacity() const { return capacity_; }
    /// The largest capacity of an automatic sort that the device's limits on workgroups allow; more
    /// is an Error.
    static std::uint64_t max_capacity(const Device& device);
    /// Device memory taken by an automatic sort of this capacity, bytes.
    static std::uint64_t device_bytes(const Device& device, std::uint32_t capacity,
                                      int digit_bits = kDigitBits);
    SortScatter scatter() const { return scatter_; }
    /// Number of pairs that one workgroup sorts.
    std::uint32_t block() const { return shape_.block(); }

    /// Sorts the first n pairs by the lowest key_bits (1..32) bits of their keys, in place; higher
    /// bits are carried along, and pairs from n on are not touched. n is the word of count_buffer
    /// at count_offset (bytes, a multiple of 4), limited to the capacity; n = 0 is allowed. keys
    /// and values hold [capacity] words. iota_values: values need not be filled; value i is i.
    /// Cheapest where key_bits give an even number of digits (with 8 bits 9..16, 25..32); otherwise
    /// the pairs are copied once more. Records into the current pass() of commands.
    void record(Commands& commands, const Buffer& keys, const Buffer& values,
                const Buffer& count_buffer, std::uint64_t count_offset, int key_bits,
                bool iota_values = false);

    /// Whether so many bits take an odd number of passes. Then a caller can spare the copy: it
    /// leaves the pairs in scratch_keys() and scratch_values(), and the sorted ones come to keys
    /// and values of record_from_scratch().
    bool is_odd(int key_bits) const { return passes(key_bits) % 2 == 1; }
    const Buffer& scratch_keys() const { return keys_temp_; }
    const Buffer& scratch_values() const { return values_temp_; }
    void record_from_scratch(Commands& commands, const Buffer& keys, const Buffer& values,
                             const Buffer& count_buffer, std::uint64_t count_offset, int key_bits);

  private:
    struct Shape {
        std::uint32_t threads = 0;
        std::uint32_t items = 0;      // keys per thread
        std::uint32_t subgroups = 0;  // in one workgroup, where each ranks by itself
        int digit_bits = kDigitBits;
        std::uint32_t digits() const { return 1u << digit_bits; }
        std::uint32_t block() const { return threads * items; }
    };
    static BufferList<RadixSort> buffers(std::uint32_t capacity, const Shape& shape);
    static Shape choose_shape(const Device& device, SortScatter scatter,
                              std::uint32_t subgroup_size, int digit_bits);
    struct KeyValues {
        const Buffer *keys, *values;
    };
    int passes(int key_bits) const {
        return (key_bits + shape_.digit_bits - 1) / shape_.digit_bits;
    }
    void check(const Buffer& keys, const Buffer& values, int key_bits) const;
    void prepare(Commands& commands, const Buffer& count_buffer, std::uint64_t count_offset);
    void record_passes(Commands& commands, int key_bits, bool iota, KeyValues from, KeyValues to);
    void record_pass(Commands& commands, const gpu::RadixPassArgs& args, bool iota,
                     const KeyValues& from, const KeyValues& to);

    std::uint32_t capacity_;
    SortScatter scatter_;
    Shape shape_;
    std::uint32_t rows_per_group_ = 1;  // rows of the offsets per group
    Pipeline prepare_, histogram_, offsets_, rank_, rank_iota_;
    Buffer plan_, histograms_, totals_, keys_temp_, values_temp_;
};

}  // namespace darb
