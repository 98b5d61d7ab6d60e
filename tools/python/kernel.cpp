// SPDX-License-Identifier: MIT
#include "tools/python/kernel.h"

#include <fmt/format.h>

#include <cmath>
#include <limits>

#include "engine/kernels/kernel_definition.h"
#include "engine/kernels/kernel_expression.h"
#include "engine/kernels/kernel_registry.h"
#include "engine/kernels/shaped_kernel.h"

namespace darb::python {

namespace {

// The name of a row of the registry, which lives as long as the process.
struct PyKernel {
    int id = 0;

    const KernelDefinition& definition() const { return *kernel_definition(id); }
};

// Kernels with shapes are not rows of the list.
std::vector<int> named_kernels() {
    std::vector<int> kernels = known_kernels();
    const std::vector<int> shaped = shaped_kernels();
    kernels.insert(kernels.begin() + KERNEL_COUNT, shaped.begin(), shaped.end());
    return kernels;
}

std::string names() {
    std::string text;
    for (const int k : named_kernels())
        text += fmt::format("{}{}", text.empty() ? "" : ", ", kernel_name(k));
    return text;
}

// w(q) as a Python function computes it; its exceptions are passed on.
KernelDefinition defined(const py::object& profile, double support, const std::string& name) {
    if (py::isinstance<py::str>(profile))
        return kernel_from_expression(take_text(profile, "profile"), support, name, "darb.Kernel");
    if (PyCallable_Check(profile.ptr()) == 0)
        throw Error("profile", type_text(profile) + ", nothing to call",
                    "Give a function of q = d^2, or an expression in q and d.");
    return define_kernel(
        name, support,
        [&](double q) {
            const py::object w = profile(q);
            return take_number(w, "profile", -std::numeric_limits<double>::infinity(),
                               std::numeric_limits<double>::infinity());
        },
        "a function");
}

PyKernel make_kernel(const py::object& profile, const py::object& support, const py::object& name) {
    const double r2 = take_number(support, "support", 0, std::numeric_limits<double>::infinity());
    return {register_kernel(defined(profile, r2, take_text(name, "name")))};
}

}  // namespace

std::optional<int> kernel_of_object(const py::object& value) {
    if (!py::isinstance<PyKernel>(value)) return std::nullopt;
    return value.cast<const PyKernel&>().id;
}

int take_kernel(const py::object& value, const char* name) {
    if (const auto own = kernel_of_object(value)) return *own;
    const std::string text = take_text(value, name);
    if (const auto kernel = kernel_from_name(text)) return *kernel;
    throw Error(fmt::format("{} {}", name, text), "no such kernel",
                "Use one of: " + names() + "; or a darb.Kernel.");
}

Footprint take_footprint(const py::object& value) {
    const std::string text = take_text(value, "footprint");
    if (const auto footprint = footprint_from_name(text)) return *footprint;
    throw Error("footprint " + text, "no such footprint", "Use psi or exact.");
}

void bind_kernel(py::module_& module) {
    py::class_<PyKernel>(module, "Kernel", "A kernel of one's own; see darb.Kernel.")
        .def(py::init(&make_kernel), py::arg("profile"), py::arg("support"), py::arg("name") = "")
        .def_property_readonly(
            "name", [](const PyKernel& k) { return k.definition().name; },
            "By which rasterize, Scene and Trainer know it, too.")
        .def_property_readonly(
            "support", [](const PyKernel& k) { return k.definition().support; },
            "The q, squared Mahalanobis distance, from which on it is 0.")
        .def_property_readonly(
            "psi", [](const PyKernel& k) { return kernel_psi(k.id); },
            "The projected second moment over the 2x2 block of the covariance.")
        .def_property_readonly(
            "error", [](const PyKernel& k) { return k.definition().error; },
            "The largest distance of the fit from the profile, where w(0) = 1.")
        .def_property_readonly(
            "notes", [](const PyKernel& k) { return k.definition().notes; },
            "What was changed of the profile: a list of str.")
        .def("__call__",
             [](const PyKernel& k, const py::object& q) {
                 return kernel_value(k.id, Footprint::psi, take_number(q, "q", 0, 1e300));
             })
        .def("__repr__", [](const PyKernel& k) {
            return fmt::format("<darb.Kernel {}, support {}>", k.definition().name,
                               k.definition().support);
        });
    module.def("kernel_names", [] {
        py::list list;
        for (const int k : named_kernels()) list.append(std::string(kernel_name(k)));
        return list;
    });
}

}  // namespace darb::python
