// SPDX-License-Identifier: MIT
// Replaces live_view.cpp where the viewer was not built.
#include "engine/core/error.h"
#include "tools/darb/live_view.h"

namespace darb {

struct LiveView::State {};
struct LiveSystem::System {};

LiveView::LiveView(std::unique_ptr<State> state) : state_(std::move(state)) {}
LiveView::~LiveView() = default;
LiveAnswer LiveView::show(const LiveStep&) {
    return 0;
}
bool LiveView::publishes() const {
    return false;
}
void LiveView::finish(const std::filesystem::path&, const std::string&) {}

LiveSystem::LiveSystem(bool on, const DeviceOptions&) {
    if (on)
        throw Error("--view", "this darb was built without the viewer",
                    "Install libglfw3-dev and libimgui-dev (tools/setup.sh) and build again.");
}
LiveSystem::~LiveSystem() = default;
std::unique_ptr<LiveView> LiveSystem::open(Device&, const Dataset&, const std::atomic<bool>&,
                                           bool) const {
    return nullptr;
}

}  // namespace darb
