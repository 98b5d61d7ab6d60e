// SPDX-License-Identifier: MIT
// A device as Python holds it: one lock, under which a single call uses its queue, and the
// renderers that calls with arrays make, kept for the next call of the same kind.
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

/// The renderers of one owner, the latest used first; at most a few.
class Renderers {
  public:
    /// nullptr where there is none of this kind.
    KeptRenderer* find(const RendererKey& key);
    /// A new one, which begins with the model.
    KeptRenderer& make(Device& device, const RendererKey& key, const SplatModel& model);
    void clear() { kept_.clear(); }
    /// Leaves the renderers behind, in a child process.
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

    /// The lock, to be held while the device is used; the GIL must not be. Waits with an ear for
    /// signals. Throws Error in a child process, where the device is not.
    std::unique_lock<std::recursive_timed_mutex> lock();

    /// For destructors: free_it under the lock, whatever signals say; in a child process, where
    /// nothing of the device may be touched, leave_it. The GIL must not be held. Never throws.
    void let_go(const std::function<void()>& free_it,
                const std::function<void()>& leave_it) noexcept;

    Device& device() { return *device_; }
    const DeviceInfo& info() const { return device_->info(); }
    Renderers& renderers() { return renderers_; }
    std::uint64_t next_picture() { return ++pictures_; }
    /// Whether a trainer's step is under way, from whose callback nothing may train.
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
