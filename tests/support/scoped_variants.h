// The ways of a device for the length of a block.
#pragma once

#include <string>
#include <utility>

#include "engine/primitives/tuning.h"

namespace darb::test {

class ScopedVariants {
  public:
    /// text: as parse_variants reads it.
    ScopedVariants(Device& device, const std::string& text)
        : device_(&device), before_(device.variants()) {
        device.set_variants(parse_variants(device.info(), text, "test"));
    }
    ~ScopedVariants() { device_->set_variants(before_); }
    ScopedVariants(const ScopedVariants&) = delete;
    ScopedVariants& operator=(const ScopedVariants&) = delete;

  private:
    Device* device_;
    Variants before_;
};

}  // namespace darb::test
