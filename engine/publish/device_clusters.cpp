// SPDX-License-Identifier: MIT
#include "engine/publish/device_clusters.h"

#include <algorithm>

#include "engine/gpu/buffer.h"
#include "engine/primitives/groups.h"
#include "shaders/shared/cluster_args.h"

namespace darb {

namespace {

constexpr std::uint32_t kThreads = 64;
// Rows per thread on lavapipe, where loads of centres are expensive: as many as Mesa 22.3 unrolls,
// with some margin. With 5 it is a tenth faster, with 6 three times slower.
constexpr std::uint32_t kLavapipeRows = 4;
constexpr std::uint64_t kPartBytes = 32 << 20;  // rows on the device at a time

/// Padded with zeros to [count][quads * 4].
std::vector<float> padded(const float* from, std::size_t count, std::size_t dims,
                          std::size_t quads) {
    std::vector<float> to(count * quads * 4, 0);
    for (std::size_t i = 0; i < count; ++i) std::copy_n(from + i * dims, dims, &to[i * quads * 4]);
    return to;
}

std::vector<float> squares_of(const std::vector<float>& centres, std::size_t dims) {
    std::vector<float> squares(centres.size() / dims, 0);
    for (std::size_t c = 0; c < squares.size(); ++c)
        for (std::size_t d = 0; d < dims; ++d)
            squares[c] += centres[c * dims + d] * centres[c * dims + d];
    return squares;
}

/// Batches that go to the device together; each is whole. Rows [first, first + rows).
struct DevicePart {
    std::uint32_t first = 0, rows = 0;
    std::vector<gpu::ClusterGroup> groups;  // rows relative to the part's first
};

std::vector<DevicePart> parts_of(const std::vector<ClusterBatch>& batches, std::size_t row_bytes,
                                 std::uint32_t group_rows) {
    std::vector<DevicePart> parts;
    for (const ClusterBatch& batch : batches) {
        if (parts.empty() || (parts.back().rows + batch.rows) * row_bytes > kPartBytes)
            parts.push_back({batch.first_row, 0, {}});
        DevicePart& part = parts.back();
        for (std::uint32_t at = 0; at < batch.rows; at += group_rows)
            part.groups.push_back({part.rows + at, std::min(group_rows, batch.rows - at),
                                   batch.first_centre, batch.centres});
        part.rows += batch.rows;
    }
    return parts;
}

template <class T>
Buffer filled(Device& device, const char* name, const std::vector<T>& values) {
    Buffer buffer(device, name, values.size() * sizeof(T));
    buffer.upload(values);
    return buffer;
}

}  // namespace

std::uint32_t DeviceClusters::rows_of_thread() const {
    return device_.is_lavapipe() ? kLavapipeRows : 1;
}

const Pipeline& DeviceClusters::pipeline_for(std::size_t quads) {
    Pipeline& pipeline = pipelines_[quads];
    if (!pipeline)
        pipeline = Pipeline(device_, "nearest_centre",
                            {{"THREADS", static_cast<std::int32_t>(kThreads)},
                             {"QUADS", static_cast<std::int32_t>(quads)},
                             {"ROWS", static_cast<std::int32_t>(rows_of_thread())}});
    return pipeline;
}

void DeviceClusters::assign(const std::vector<float>& rows, std::size_t dims,
                            const std::vector<float>& centres,
                            const std::vector<ClusterBatch>& batches,
                            std::vector<std::uint32_t>& labels) {
    const std::size_t quads = (dims + 3) / 4;
    const Pipeline& pipeline = pipeline_for(quads);
    labels.resize(rows.size() / dims);
    const Buffer centre = filled(device_, "cluster centres",
                                 padded(centres.data(), centres.size() / dims, dims, quads));
    const Buffer square = filled(device_, "squares of cluster centres", squares_of(centres, dims));
    for (const DevicePart& part : parts_of(batches, 16 * quads, kThreads * rows_of_thread())) {
        const Buffer row = filled(device_, "rows to cluster",
                                  padded(&rows[part.first * dims], part.rows, dims, quads));
        const Buffer group = filled(device_, "cluster groups", part.groups);
        const Buffer label(device_, "cluster labels", 4 * std::uint64_t{part.rows});
        const auto count = static_cast<std::uint32_t>(part.groups.size());
        const Groups groups = groups_for(count, 1);
        commands_.begin();
        commands_.pass("nearest centre");
        commands_.dispatch(pipeline, gpu::NearestCentreArgs{count},
                           {group, row, centre, square, label}, groups.x, groups.y);
        commands_.submit_and_wait();
        const auto got = label.download<std::uint32_t>(part.rows);
        std::copy(got.begin(), got.end(), labels.begin() + part.first);
    }
}

}  // namespace darb
