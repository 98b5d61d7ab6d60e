// SPDX-License-Identifier: MIT
// The tuning of a device for the length of a block.
#pragma once

#include <string>

#include "engine/plan/tuner.h"

namespace darb::test {

class ScopedVariants {
  public:
    /// text: as parse_tuning reads it; what it leaves out is as it was.
    ScopedVariants(Device& device, const std::string& text)
        : device_(&device), before_(device.tuning()) {
        device.set_tuning(with_names(before_, parse_tuning(device.info(), text, "test")));
    }
    ~ScopedVariants() { device_->set_tuning(before_); }
    ScopedVariants(const ScopedVariants&) = delete;
    ScopedVariants& operator=(const ScopedVariants&) = delete;

  private:
    Device* device_;
    Tuning before_;
};

}  // namespace darb::test
