// The device that makes SOG's palettes of harmonics, opened at the first of them.
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
    std::string select_;
    std::unique_ptr<Device> device_;
    std::unique_ptr<DeviceClusters> clusters_;
};

}  // namespace darb
