// SPDX-License-Identifier: MIT
// A device as Python holds it. It has one lock, under which a single call uses its queue, and it
// keeps the renderers that calls with arrays make for the next call of the same kind.
#pragma once

#include <chrono>
#include <functional>
#include <list>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "engine/gpu/device.h"
#include "engine/render/render_gradients.h"
#include "tools/python/arguments.h"

namespace darb::python {

/// What a renderer is compiled for.
struct RendererKey {
    int kernel = 0;
    Footprint footprint = Footprint::psi;
    bool antialias = false, direct_colour = false, linear = false, camera = false;
    int preset = 0;  // accuracy preset

    bool operator==(const RendererKey&) const = default;
};

struct KeptRenderer {
    RendererKey key;
    GradientRenderer renderer;
    std::uint64_t picture = 0;  // number of the picture that it drew last; 0: none
};

/// The renderers of one owner, the latest used first; there are only a few.
class Renderers {
  public:
    /// nullptr where there is no such renderer.
    KeptRenderer* find(const RendererKey& key);
    /// Makes a new renderer, which begins with the model.
    KeptRenderer& make(Device& device, const RendererKey& key, const SplatModel& model);
    void clear() { kept_.clear(); }
    /// Abandons the renderers without freeing them, in a child process.
    void leak() { static_cast<void>(new std::list<KeptRenderer>(std::move(kept_))); }

  private:
    static constexpr std::size_t kMost = 3;
    std::list<KeptRenderer> kept_;
};

class PyDevice {
  public:
    explicit PyDevice(const std::string& select);
    ~PyDevice();
    PyDevice(const PyDevice&) = delete;
    PyDevice& operator=(const PyDevice&) = delete;

    /// Takes the lock, which must be held while the device is used, without holding the GIL. It
    /// listens to signals while it waits. Throws Error in a child process, which does not have the
    /// device.
    std::unique_lock<std::recursive_timed_mutex> lock();

    /// For destructors: calls free_it under the lock, whatever signals say, or leave_it in a child
    /// process, which may not touch the device. The GIL must not be held. Never throws.
    void let_go(const std::function<void()>& free_it,
                const std::function<void()>& leave_it) noexcept;

    Device& device() { return *device_; }
    const DeviceInfo& info() const { return device_->info(); }
    Renderers& renderers() { return renderers_; }
    std::uint64_t next_picture() { return ++pictures_; }
    /// Whether a trainer's step is under way; its callback must not train.
    bool training = false;

  private:
    std::recursive_timed_mutex mutex_;
    int process_;
    std::unique_ptr<Device> device_;
    Renderers renderers_;
    std::uint64_t pictures_ = 0;
};

void bind_device(py::module_& module);

}  // namespace darb::python
