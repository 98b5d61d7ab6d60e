// SPDX-License-Identifier: MIT
// darb.Scene: a splat file in memory, its attributes as arrays, and its splats on the device for as
// long as they do not change.
#pragma once

#include <memory>

#include "tools/python/device.h"

namespace darb::python {

class PyScene {
  public:
    explicit PyScene(SplatModel model);
    PyScene(PyScene&&) = default;
    ~PyScene();
    PyScene(const PyScene&) = delete;

    const SplatModel& model() const { return model_; }
    /// Other values for an attribute, of the same count.
    void set_values(int attribute, const Floats& values);
    void set_drawing(int kernel, Footprint footprint, bool antialias);

    /// Called before the first renderer(), with the GIL. From then on changes wait for whatever
    /// draws.
    void lie_on(const std::shared_ptr<PyDevice>& device);
    /// A renderer with the current splats. The caller holds the device's lock.
    KeptRenderer& renderer(const RendererKey& key);

  private:
    void change(const std::function<void()>& change);

    // Its arrays never move, because numpy looks at them; only that of shapes grows once, from
    // none.
    SplatModel model_;
    Renderers renderers_;
    std::shared_ptr<PyDevice> device_;  // the renderers' device
    std::uint64_t changes_ = 1;
    std::vector<std::pair<RendererKey, std::uint64_t>> uploaded_;  // changes_ when it was uploaded
};

void bind_scene(py::module_& module);

}  // namespace darb::python
