// SPDX-License-Identifier: MIT
#include "trainer/growth/density_control.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "engine/core/error.h"
#include "engine/kernels/shaped_kernel.h"
#include "engine/primitives/groups.h"
#include "engine/primitives/radix_sort.h"
#include "engine/primitives/scan.h"
#include "engine/raster/gpu_splats.h"
#include "shaders/shared/kernel_forms.h"
#include "shaders/shared/order_args.h"
#include "shaders/shared/strategy_args.h"

namespace darb {

namespace {
constexpr int kQuantiles = 256;

// Takes growth back, smallest mean gradients first, until `room` splats grow. gradient_sum: (sum,
// frames) of each; action and grow: as densify_decide wrote them.
void limit_growth(const std::vector<glm::vec2>& gradient_sum, std::uint32_t room,
                  std::vector<std::uint32_t>& action, std::vector<std::uint32_t>& grow) {
    std::vector<std::uint32_t> growing;
    for (std::uint32_t i = 0; i < grow.size(); ++i)
        if (grow[i] != 0) growing.push_back(i);
    const auto mean = [&](std::uint32_t i) { return gradient_sum[i].x / gradient_sum[i].y; };
    if (room >= growing.size()) return;
    std::nth_element(growing.begin(), growing.begin() + room, growing.end(),
                     [&](std::uint32_t a, std::uint32_t b) {
                         return mean(a) != mean(b) ? mean(a) > mean(b) : a < b;
                     });
    for (size_t k = room; k < growing.size(); ++k) {
        action[growing[k]] = DENSIFY_KEEP;
        grow[growing[k]] = 0;
    }
}

// [rows][kQuantiles]: a row for each of SHAPE_ROWS shapes, where the kernel has them.
std::vector<float> radius_quantiles(int kernel, Footprint footprint) {
    std::vector<float> quantiles;
    for (int row = 0; row < SHAPE_ROWS && kernel_has_shape(kernel); ++row) {
        const ShapedKernel& shaped = shaped_kernel(kernel);
        const double exponent = shaped.exponent(footprint, shaped.shape_of_row(row));
        for (const double radius : shaped.radius_quantiles(footprint, exponent, kQuantiles))
            quantiles.push_back(static_cast<float>(radius));
    }
    for (int k = 0; k < kQuantiles && !kernel_has_shape(kernel); ++k)
        quantiles.push_back(
            static_cast<float>(kernel_radius_quantile(kernel, (k + 0.5) / kQuantiles)));
    return quantiles;
}
}  // namespace

void keep_frozen(Commands& commands, std::uint32_t frozen,
                 std::initializer_list<FrozenWord> words) {
    for (const auto& [values, word] : words)
        if (frozen > 0) commands.fill({*values, 0, std::uint64_t{frozen} * 4}, word);
}

void clear_words(std::span<const std::uint8_t> splats, Buffer& words) {
    std::vector<std::uint32_t> values = words.download<std::uint32_t>(splats.size());
    for (std::size_t i = 0; i < values.size(); ++i)
        if (splats[i] != 0) values[i] = 0;
    words.upload(values);
}

namespace {

// What density control decided on these splats, but for those that go: they stay as they are.
void stop_growth(std::span<const std::uint8_t> fixed, Buffer& grow, Buffer& action) {
    std::vector<std::uint32_t> actions = action.download<std::uint32_t>(fixed.size());
    for (std::size_t i = 0; i < actions.size(); ++i)
        if (fixed[i] != 0 && actions[i] != DENSIFY_PRUNE) actions[i] = DENSIFY_KEEP;
    action.upload(actions);
    clear_words(fixed, grow);
}

}  // namespace

DensityControl::DensityControl(Device& device, int kernel, Footprint footprint)
    : device_(&device), commands_(device) {
    const SpecConstants threads{{"THREADS", SPLAT_GROUP}};
    decide_ = Pipeline(device, "densify_decide", threads);
    sources_ = Pipeline(device, "densify_sources", threads);
    gather_ = Pipeline(device, "gather_attribute", threads);
    gather_columns_ =
        Pipeline(device, "gather_attribute", {{"THREADS", SPLAT_GROUP}, {"COLUMNS", 1}});
    SpecConstants split = shape_row_constants(kernel);
    split["THREADS"] = SPLAT_GROUP;
    split["QUANTILES"] = kQuantiles;
    split_ = Pipeline(device, "densify_split", split);
    reset_ = Pipeline(device, "reset_opacity", threads);
    quantile_ = Buffer(device, "radius quantiles", fixed_bytes(kernel));
    quantile_.upload(radius_quantiles(kernel, footprint));
}

std::uint64_t DensityControl::fixed_bytes(int kernel) {
    const std::uint64_t row = kQuantiles * sizeof(float);
    return kernel_has_shape(kernel) ? SHAPE_ROWS * row : row;
}

void DensityControl::set_kernel(int kernel, Footprint footprint) {
    quantile_.upload(radius_quantiles(kernel, footprint));
}

DensityResult DensityControl::run(GpuSplats& splats, const Buffer& gradient_sum,
                                  gpu::DensifyArgs args, std::uint32_t max_splats,
                                  std::span<const std::uint8_t> fixed) {
    const std::uint32_t n = args.splat_count = splats.count();
    DensityResult result{n, n, 0, 0};
    if (n == 0) return result;
    RoundBuffers buffers;
    make_buffers(*device_, buffers, RoundBuffers::list(n), "densify");
    auto& [keep, grow, action, keep_offset, grow_offset, count, keep_total, grow_total, sources] =
        buffers;
    Scan scan(*device_, n);
    const Groups g = groups_for(n);
    commands_.begin();
    commands_.pass("densify");
    commands_.fill(count, n);
    commands_.dispatch(decide_, args,
                       {splats.parameters(kLogScale), splats.parameters(kOpacityLogit),
                        gradient_sum, keep, grow, action},
                       g.x, g.y);
    keep_frozen(commands_, splats.frozen(), {{&keep, 1}, {&grow, 0}, {&action, DENSIFY_KEEP}});
    if (!fixed.empty()) {
        commands_.submit_and_wait();
        stop_growth(fixed, grow, action);
        commands_.begin();
        commands_.pass("densify");
    }
    scan.record(commands_, keep, keep_offset, count, 0, keep_total);
    scan.record(commands_, grow, grow_offset, count, 0, grow_total);
    commands_.submit_and_wait();

    const std::uint32_t kept = keep_total.download<std::uint32_t>(1)[0];
    const std::uint32_t room = max_splats - std::min(max_splats, kept);
    result.grown = grow_total.download<std::uint32_t>(1)[0];
    result.pruned = n - kept;
    result.after = kept + std::min(result.grown, room);
    const bool too_many = result.grown > room;
    result.grown = result.after - kept;
    if (result.after == n && result.pruned == 0) return result;

    commands_.begin();
    commands_.pass("densify");
    if (too_many) {
        auto actions = action.download<std::uint32_t>(n), grows = grow.download<std::uint32_t>(n);
        limit_growth(gradient_sum.download<glm::vec2>(n), room, actions, grows);
        action.upload(actions);
        grow.upload(grows);
        scan.record(commands_, grow, grow_offset, count, 0, grow_total);
    }
    commands_.dispatch(sources_, args, {action, keep_offset, grow_offset, keep_total, sources}, g.x,
                       g.y);
    commands_.submit_and_wait();

    move(splats, sources, result.after);
    args.splat_count = result.after;
    const Groups after = groups_for(result.after);
    commands_.begin();
    commands_.pass("split");
    commands_.dispatch(split_, args,
                       {sources, splats.parameters(kPosition), splats.parameters(kLogScale),
                        splats.parameters(kRotation), quantile_, splats.parameters(kShape)},
                       after.x, after.y);
    commands_.submit_and_wait();
    return result;
}

void DensityControl::move(GpuSplats& splats, const Buffer& sources, std::uint32_t count) {
    const Move all{sources, splats.count(), count};
    for (int a = 0; a < kAttributeCount; ++a) {
        if (splats.stride(a) == 0) continue;
        const bool copied = kSplatAttributes[static_cast<std::size_t>(a)].copied_to_new;
        gather(all, splats.rows(a), !copied, splats.parameters(a));
        if (splats.has_moments()) gather(all, splats.rows(a, 2), true, splats.moments(a));
        if (a == kShRest && splats.has_rest_sum())
            gather(all, splats.rows(a), true, splats.rest_sum());
    }
    splats.set_count(count);
}

void DensityControl::gather(const Move& all, const AttributeRows& rows, bool clear_new,
                            Buffer& buffer) {
    Buffer next(*device_, buffer.name(), rows.bytes(all.after));
    const std::uint64_t most = device_->info().max_storage_buffer_bytes;
    const bool columns = rows.columns > 0;
    const std::uint32_t stride = columns ? rows.columns : rows.floats;
    if (all.after > 0) {
        commands_.begin();
        commands_.pass("gather");
        for (const SplatRange& to : splat_ranges(all.after, rows.floats_held(), most)) {
            const Groups g = groups_for(rows.rows_held(to.count) * stride);
            for (const SplatRange& from : splat_ranges(all.before, rows.floats_held(), most))
                commands_.dispatch(
                    columns ? gather_columns_ : gather_,
                    gpu::GatherArgs{to.first, to.count, from.first, from.count, stride,
                                    clear_new ? 1u : 0u},
                    {all.sources, range_of_rows(buffer, rows, from), range_of_rows(next, rows, to)},
                    g.x, g.y);
        }
        commands_.submit_and_wait();
    }
    buffer = std::move(next);
}

void DensityControl::reset_opacity(GpuSplats& splats, float opacity) {
    const std::uint32_t n = splats.trained_count();
    if (n == 0) return;
    const Groups g = groups_for(n);
    const auto logit = static_cast<float>(std::log(opacity / (1.0 - opacity)));
    commands_.begin();
    commands_.pass("reset opacity");
    commands_.dispatch(reset_, gpu::ResetOpacityArgs{n, logit},
                       {splats.trained(splats.parameters(kOpacityLogit), 1),
                        splats.trained(splats.moments(kOpacityLogit), 2)},
                       g.x, g.y);
    commands_.submit_and_wait();
}

BufferList<RoundBuffers> RoundBuffers::list(std::uint64_t splats) {
    const std::uint64_t bytes = splats * 4;
    using R = RoundBuffers;
    return {{&R::keep, "densify keep", bytes},          {&R::grow, "densify grow", bytes},
            {&R::action, "densify action", bytes},      {&R::keep_offset, "keep offset", bytes},
            {&R::grow_offset, "grow offset", bytes},    {&R::count, "densify count", 4},
            {&R::keep_total, "keep total", 4},          {&R::grow_total, "grow total", 4},
            {&R::sources, "densify sources", bytes * 4}};  // at most twice as many, two words each
}

std::uint64_t rest_sum_bytes(std::uint64_t splats, const SplatFloats& of) {
    const std::uint32_t floats = of.rest_sum ? attribute_floats(kShRest, of.sh_degree) : 0;
    return Buffer::charged_bytes(attribute_rows(kShRest, floats).bytes(splats));
}

std::uint64_t round_bytes(std::uint32_t before, std::uint32_t after, const SplatFloats& of) {
    std::vector<AttributeRows> replaced;  // in each buffer
    const auto strides = GpuSplats::strides(of.sh_degree, of.kernel);
    for (int a = 0; a < kAttributeCount; ++a)
        for (const std::uint32_t of_each : {1u, 2u})
            replaced.push_back(attribute_rows(a, strides[a], of_each));
    replaced.push_back(attribute_rows(kShRest, of.rest_sum ? strides[kShRest] : 0));
    const auto bytes = [](std::uint64_t splats, const AttributeRows& each) {
        return Buffer::charged_bytes(each.bytes(splats));
    };
    std::uint64_t held = 0;
    for (const AttributeRows& each : replaced) held += bytes(before, each);
    std::uint64_t most = held;
    for (const AttributeRows& each : replaced) {
        if (each.floats == 0) continue;
        held += bytes(after, each);
        most = std::max(most, held);
        held -= bytes(before, each);
    }
    return most + charged_bytes(RoundBuffers::list(before)) + Scan::device_bytes(before);
}

MortonOrder::MortonOrder(Device& device) : device_(&device), commands_(device) {
    const SpecConstants threads{{"THREADS", SPLAT_GROUP}};
    key_ = Pipeline(device, "morton_key", threads);
    sources_ = Pipeline(device, "morton_sources", threads);
}

void MortonOrder::run(GpuSplats& splats, DensityControl& density, const MortonGrid& grid) {
    const std::uint32_t n = splats.count();
    if (n < 2) return;
    const std::uint64_t bytes = std::uint64_t{n} * 4;
    Buffer key(*device_, "morton key", bytes), order(*device_, "morton order", bytes),
        sources(*device_, "morton sources", bytes * 2), count(*device_, "morton count", 4);
    RadixSort sort(*device_, n);
    constexpr float cells = 1 << MORTON_AXIS_BITS;
    const gpu::MortonArgs args{n, grid.centre - grid.half_side, cells / (2 * grid.half_side)};
    const Groups g = groups_for(n);
    commands_.begin();
    commands_.pass("order");
    commands_.fill(count, n);
    commands_.dispatch(key_, args, {splats.parameters(kPosition), key}, g.x, g.y);
    keep_frozen(commands_, splats.frozen(), {{&key, 0}});  // stable: they stay the first
    sort.record(commands_, key, order, count, 0, 3 * MORTON_AXIS_BITS, true);
    commands_.dispatch(sources_, gpu::SplatArgs{n}, {order, sources}, g.x, g.y);
    commands_.submit_and_wait();
    density.move(splats, sources, n);
}

}  // namespace darb
