#include "tools/darb/palette_device.h"

#include "tools/darb/device_options.h"

namespace darb {

AssignRows PaletteDevice::assign_rows() {
    return
        [this](const std::vector<float>& rows, std::size_t dims, const std::vector<float>& centres,
               const std::vector<ClusterBatch>& batches, std::vector<std::uint32_t>& labels) {
            if (!clusters_) {
                device_ = std::make_unique<Device>(command_device(select_));
                clusters_ = std::make_unique<DeviceClusters>(*device_);
            }
            clusters_->assign(rows, dims, centres, batches, labels);
        };
}

}  // namespace darb
