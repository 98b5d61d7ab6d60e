#include "tools/darb/palette_device.h"

#include "engine/core/error.h"
#include "engine/gpu/device_environment.h"

namespace darb {

namespace {

constexpr auto* assign_rows_on_host = &darb::assign_rows;

}  // namespace

void PaletteDevice::open() {
    tried_ = true;
    try {
        device_ = std::make_unique<Device>(command_device(select_));
        clusters_ = std::make_unique<DeviceClusters>(*device_);
    } catch (const Error&) {
        if (!select_.empty()) throw;  // the host does without a device that nobody asked for
    }
}

AssignRows PaletteDevice::assign_rows() {
    return
        [this](const std::vector<float>& rows, std::size_t dims, const std::vector<float>& centres,
               const std::vector<ClusterBatch>& batches, std::vector<std::uint32_t>& labels) {
            if (!tried_) open();
            if (clusters_)
                clusters_->assign(rows, dims, centres, batches, labels);
            else
                assign_rows_on_host(rows, dims, centres, batches, labels);
        };
}

}  // namespace darb
