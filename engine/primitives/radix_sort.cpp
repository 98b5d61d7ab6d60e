// SPDX-License-Identifier: MIT
#include "engine/primitives/radix_sort.h"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cstddef>
#include <string>
#include <utility>

#include "engine/core/error.h"
#include "shaders/shared/radix_args.h"

namespace darb {

namespace {

// With 1024 keys per thread, the 256 counters of its column are cheap; with 8 lanes, a block has
// 8192 keys.
constexpr std::uint32_t kColumnItems = 1024;
constexpr std::uint32_t kBallotThreads = 256, kBallotItems = 16;
constexpr std::uint32_t kSumBytes = 64 * 4;  // sums of the subgroups, at most
constexpr std::uint32_t kOffsetThreads = 256;

// Counters of a subgroup.
std::uint32_t row_bytes(std::uint32_t digits) {
    return digits * 4;
}

SpecConstants constants(std::uint32_t threads, std::uint32_t items, std::uint32_t subgroups,
                        std::uint32_t digits, bool iota) {
    SpecConstants result = for_several_passes(  // the histograms and the ways to scatter
        {{"SUBGROUPS", static_cast<std::int32_t>(subgroups)}, {"IOTA", iota ? 1 : 0}});
    if (digits != RADIX_MAX_DIGITS) result["DIGITS"] = static_cast<std::int32_t>(digits);
    result["THREADS"] = static_cast<std::int32_t>(threads);
    result["ITEMS"] = static_cast<std::int32_t>(items);
    return result;
}

const char* histogram_name(SortScatter scatter) {
    return scatter == SortScatter::columns ? "radix_histogram_columns" : "radix_histogram";
}

std::string scatter_name(SortScatter scatter) {
    return std::string("radix_scatter_") + kSortScatters[static_cast<std::size_t>(scatter)];
}

}  // namespace

RadixSort::Shape RadixSort::choose_shape(const Device& device, SortScatter scatter,
                                         std::uint32_t subgroup_size, int digit_bits) {
    const std::uint32_t lanes = subgroup_size != 0 ? subgroup_size : device.info().subgroup_size;
    if (scatter == SortScatter::columns) return {lanes, kColumnItems, 1, digit_bits};
    // On Intel, all threads of a subgroup share 4 KiB of registers, which keys and ranks of 16
    // would fill.
    const std::uint32_t fewest = device.info().min_subgroup_size;
    const std::uint32_t items = fewest <= 16 && fewest < lanes ? kBallotItems / 2 : kBallotItems;
    // Shared memory that a thread takes: its share of a subgroup's row, and its keys. The block's
    // row comes on top.
    const std::uint32_t row = row_bytes(1u << digit_bits);
    const std::uint32_t bytes = row / lanes + items * 4;
    const std::uint32_t room = device.info().shared_memory_bytes - row - kSumBytes;
    const std::uint32_t threads = std::clamp(std::bit_floor(room / bytes), lanes, kBallotThreads);
    return {threads, items, threads / lanes, digit_bits};
}

RadixSort::RadixSort(Device& device, std::uint32_t capacity, std::optional<SortScatter> scatter,
                     std::uint32_t subgroup_size, int digit_bits)
    : capacity_(capacity),
      scatter_(scatter.value_or(device.tuning().scatter)),
      shape_(choose_shape(device, scatter_, subgroup_size, digit_bits)) {
    if (capacity == 0) throw Error("sort", "its capacity is 0 pairs", "Make it for at least one.");
    const std::uint64_t blocks = (std::uint64_t{capacity} + block() - 1) / block();
    if (blocks > device.info().max_groups_x)
        throw NoRoom(
            "sort", fmt::format("{} pairs are more than {} allows", capacity, device.info().name),
            "Use smaller images or fewer splats, or choose another device (darb devices).");
    const std::uint32_t threads = shape_.threads, subgroups = shape_.subgroups;
    const SpecConstants plain = constants(threads, shape_.items, subgroups, shape_.digits(), false);
    const SpecConstants iota = constants(threads, shape_.items, subgroups, shape_.digits(), true);
    const bool by_thread = device.tuning().scan_by_thread;
    const std::uint32_t offset_threads = by_thread ? threads / subgroups : kOffsetThreads;
    rows_per_group_ = by_thread ? offset_threads : 1;
    prepare_ = Pipeline(device, "radix_prepare");
    offsets_ = Pipeline(device, "radix_offsets",
                        {{"THREADS", static_cast<std::int32_t>(offset_threads)},
                         {"TEAM_IS_THREAD", by_thread ? 1 : 0}},
                        true, subgroup_size);
    histogram_ = Pipeline(device, histogram_name(scatter_), plain, true, subgroup_size);
    rank_ = Pipeline(device, scatter_name(scatter_), plain, true, subgroup_size);
    rank_iota_ = Pipeline(device, scatter_name(scatter_), iota, true, subgroup_size);

    make_buffers(device, *this, buffers(capacity, shape_), "sort");
}

// One workgroup per block.
std::uint64_t RadixSort::max_capacity(const Device& device) {
    return std::uint64_t{device.info().max_groups_x} *
           choose_shape(device, device.tuning().scatter, 0, kDigitBits).block();
}

BufferList<RadixSort> RadixSort::buffers(std::uint32_t capacity, const Shape& shape) {
    const std::uint64_t pair_bytes = std::uint64_t{capacity} * 4;
    const std::uint64_t blocks = (std::uint64_t{capacity} + shape.block() - 1) / shape.block();
    return {{&RadixSort::plan_, "sort plan", sizeof(gpu::RadixPlan)},
            {&RadixSort::histograms_, "sort histograms", blocks * row_bytes(shape.digits())},
            {&RadixSort::totals_, "sort totals", RADIX_MAX_PASSES * row_bytes(shape.digits())},
            {&RadixSort::keys_temp_, "sort keys", pair_bytes},
            {&RadixSort::values_temp_, "sort values", pair_bytes}};
}

std::uint64_t RadixSort::device_bytes(const Device& device, std::uint32_t capacity,
                                      int digit_bits) {
    return charged_bytes(
        buffers(capacity, choose_shape(device, device.tuning().scatter, 0, digit_bits)));
}

void RadixSort::check(const Buffer& keys, const Buffer& values, int key_bits) const {
    const std::uint64_t bytes = std::uint64_t{capacity_} * 4;
    if (key_bits < 1 || key_bits > 32)
        throw Error("sort", fmt::format("cannot sort by {} bits of a key", key_bits),
                    "Use 1 to 32.");
    if (keys.bytes() < bytes || values.bytes() < bytes)
        throw Error("sort",
                    fmt::format("buffers of {} and {} bytes do not hold its capacity of {} pairs",
                                keys.bytes(), values.bytes(), capacity_),
                    "Give it buffers of its capacity.");
}

void RadixSort::prepare(Commands& commands, const Buffer& count_buffer,
                        std::uint64_t count_offset) {
    const gpu::RadixPrepareArgs args{capacity_, static_cast<std::uint32_t>(count_offset / 4),
                                     block(), RADIX_MAX_PASSES * shape_.digits()};
    commands.dispatch(prepare_, args, {count_buffer, plan_, totals_}, 1);
}

void RadixSort::record(Commands& commands, const Buffer& keys, const Buffer& values,
                       const Buffer& count_buffer, std::uint64_t count_offset, int key_bits,
                       bool iota_values) {
    check(keys, values, key_bits);
    prepare(commands, count_buffer, count_offset);
    KeyValues from{&keys, &values}, to{&keys_temp_, &values_temp_};
    if (is_odd(key_bits)) {  // start in the scratch buffers, so that the last pass ends in keys
        const std::uint64_t bytes = std::uint64_t{capacity_} * 4;
        commands.copy(keys, keys_temp_, bytes);
        if (!iota_values) commands.copy(values, values_temp_, bytes);
        std::swap(from, to);
    }
    record_passes(commands, key_bits, iota_values, from, to);
}

void RadixSort::record_from_scratch(Commands& commands, const Buffer& keys, const Buffer& values,
                                    const Buffer& count_buffer, std::uint64_t count_offset,
                                    int key_bits) {
    check(keys, values, key_bits);
    if (!is_odd(key_bits))
        throw Error("sort", fmt::format("{} bits end in its scratch buffers", key_bits),
                    "Use record, which begins in the caller's buffers.");
    prepare(commands, count_buffer, count_offset);
    record_passes(commands, key_bits, false, {&keys_temp_, &values_temp_}, {&keys, &values});
}

void RadixSort::record_passes(Commands& commands, int key_bits, bool iota, KeyValues from,
                              KeyValues to) {
    const int count = passes(key_bits);
    int done_bits = 0;
    for (int pass = 0; pass < count; ++pass) {
        // Equal digits: 12 bits as 6 + 6 need fewer counters than 8 + 4.
        const int bits = (key_bits - done_bits + count - pass - 1) / (count - pass);
        const gpu::RadixPassArgs pass_args{static_cast<std::uint32_t>(done_bits), 1U << bits,
                                           static_cast<std::uint32_t>(pass) * shape_.digits()};
        record_pass(commands, pass_args, iota && pass == 0, from, to);
        done_bits += bits;
        std::swap(from, to);
    }
}

void RadixSort::record_pass(Commands& commands, const gpu::RadixPassArgs& args, bool iota,
                            const KeyValues& from, const KeyValues& to) {
    commands.dispatch_indirect(histogram_, args, {plan_, *from.keys, histograms_, totals_}, plan_,
                               0);
    commands.dispatch(offsets_, args, {plan_, totals_, histograms_},
                      (args.digits + rows_per_group_ - 1) / rows_per_group_);
    commands.dispatch_indirect(iota ? rank_iota_ : rank_, args,
                               {plan_, histograms_, *from.keys, *from.values, *to.keys, *to.values},
                               plan_, 0);
}

}  // namespace darb
