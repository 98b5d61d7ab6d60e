// SPDX-License-Identifier: MIT
#include "tools/python/device.h"

#include "engine/core/system.h"
#include "engine/gpu/device.h"
#include "engine/plan/tuner.h"

namespace darb::python {

namespace {

py::dict info_dict(const DeviceInfo& info) {
    py::dict d;
    d["index"] = info.index;
    d["name"] = info.name;
    d["driver"] = info.driver;
    d["type"] = info.type;
    d["memory_bytes"] = info.heap_bytes;
    d["subgroup_size"] = info.subgroup_size;
    d["usable"] = info.usable;
    d["reason"] = info.reason;
    return d;
}

}  // namespace

KeptRenderer* Renderers::find(const RendererKey& key) {
    for (auto it = kept_.begin(); it != kept_.end(); ++it) {
        if (it->key != key) continue;
        kept_.splice(kept_.begin(), kept_, it);
        return &kept_.front();
    }
    return nullptr;
}

KeptRenderer& Renderers::make(Device& device, const RendererKey& key, const SplatModel& model) {
    if (kept_.size() >= kMost) kept_.pop_back();
    GradientOptions options;
    options.accuracy = preset_accuracy(key.preset);
    options.linear_values = key.linear;
    options.direct_colour = key.direct_colour;
    options.camera = key.camera;
    kept_.push_front(KeptRenderer{key, GradientRenderer(device, model, options), 0});
    return kept_.front();
}

PyDevice::PyDevice(const std::string& select) : process_(process_id()) {
    DeviceOptions options = command_device(select);
    device_ = std::make_unique<Device>(options);
    settle_tuning(*device_);
}

std::unique_lock<std::recursive_timed_mutex> PyDevice::lock() {
    if (process_id() != process_)
        throw Error(info().name, "was opened before this process was forked",
                    "Start worker processes with multiprocessing's \"spawn\", or open the device "
                    "in each.");
    std::unique_lock guard(mutex_, std::defer_lock);
    while (!guard.try_lock_for(std::chrono::milliseconds(50))) check_signals();
    return guard;
}

void PyDevice::let_go(const std::function<void()>& free_it,
                      const std::function<void()>& leave_it) noexcept {
    if (process_id() != process_) return leave_it();
    const std::scoped_lock guard(mutex_);
    free_it();
}

PyDevice::~PyDevice() {
    if (process_id() == process_) return;
    renderers_.leak();
    static_cast<void>(device_.release());
}

void bind_device(py::module_& module) {
    py::class_<PyDevice, std::shared_ptr<PyDevice>>(
        module, "Device", "A Vulkan device. One call at a time uses it: others wait.")
        .def(py::init([](const py::object& select) {
                 const std::string text = take_text(select, "device");
                 const py::gil_scoped_release free;
                 return std::make_shared<PyDevice>(text);
             }),
             py::arg("select") = "")
        .def_property_readonly(
            "name", [](const PyDevice& d) { return d.info().name; }, "As the driver gives it.")
        .def_property_readonly(
            "info", [](const PyDevice& d) { return info_dict(d.info()); },
            "A dict, as an item of darb.devices().")
        .def_property_readonly(
            "allocated_bytes", [](PyDevice& d) { return d.device().allocated_bytes(); },
            "Bytes of device memory that buffers hold now.")
        .def("__repr__", [](const PyDevice& d) { return "<darb.Device " + d.info().name + ">"; });
    module.def("devices", [] {
        std::vector<DeviceInfo> found;
        {
            const py::gil_scoped_release free;
            found = list_devices();
        }
        py::list list;
        for (const DeviceInfo& info : found) list.append(info_dict(info));
        return list;
    });
}

}  // namespace darb::python
