// The device that makes SOG's palettes of harmonics, opened at the first of them; the host makes
// them where there is no device.
#pragma once

#include <memory>
#include <string>

#include "engine/publish/device_clusters.h"

namespace darb {

class PaletteDevice {
  public:
    explicit PaletteDevice(std::string select) : select_(std::move(select)) {}
    /// For EncodeOptions; this has to outlive it.
    AssignRows assign_rows();

  private:
    void open();

    std::string select_;
    bool tried_ = false;
    std::unique_ptr<Device> device_;
    std::unique_ptr<DeviceClusters> clusters_;
};

}  // namespace darb
