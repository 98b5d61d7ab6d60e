// SPDX-License-Identifier: MIT
// Finds the nearest centres for cluster_rows (engine/scene/cluster_rows.h) on a device.
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <vector>

#include "engine/gpu/commands.h"
#include "engine/gpu/device.h"
#include "engine/gpu/pipeline.h"
#include "engine/scene/cluster_rows.h"

namespace darb {

class DeviceClusters {
  public:
    /// The device must outlive this object.
    explicit DeviceClusters(Device& device) : device_(device), commands_(device) {}

    /// See AssignRows; rows are sent to the device in parts. A device always gives the same labels;
    /// another device, or the host, may decide differently between centres at nearly equal
    /// distances.
    void assign(const std::vector<float>& rows, std::size_t dims, const std::vector<float>& centres,
                const std::vector<ClusterBatch>& batches, std::vector<std::uint32_t>& labels);

    /// For EncodeOptions. This object must outlive the result.
    AssignRows assign_rows() { return std::bind_front(&DeviceClusters::assign, this); }

  private:
    std::uint32_t rows_of_thread() const;
    const Pipeline& pipeline_for(std::size_t quads);

    Device& device_;
    Commands commands_;
    std::map<std::size_t, Pipeline> pipelines_;  // by the number of quads in a row
};

}  // namespace darb
