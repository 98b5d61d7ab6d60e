// SPDX-License-Identifier: MIT
// One Device for all tests of a process, given back before main returns. A run under
// DARB_VALIDATION=1 fails on any message of the validation layers.
#pragma once

#include <gtest/gtest.h>

#include <memory>

#include "engine/gpu/device.h"
#include "tests/support/test_device_options.h"

namespace darb::test {

class SharedDevice : public testing::Environment {
  public:
    static std::unique_ptr<Device>& slot() {
        static std::unique_ptr<Device> device;
        return device;
    }
    void TearDown() override {
        if (!slot()) return;
        EXPECT_EQ(slot()->validation_message_count(), 0U) << "messages of the validation layers";
        slot().reset();
    }
};

inline testing::Environment* const kSharedDevice =
    testing::AddGlobalTestEnvironment(new SharedDevice);

inline Device& shared_device() {
    std::unique_ptr<Device>& slot = SharedDevice::slot();
    if (!slot) {
        DeviceOptions options = test::device_options();
        options.keep_pipelines = true;  // the cases of a process draw with the same ones
        slot = std::make_unique<Device>(options);
    }
    return *slot;
}

}  // namespace darb::test
