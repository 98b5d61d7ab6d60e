// SPDX-License-Identifier: MIT
#include "tools/python/train_options.h"

#include <fmt/format.h>

#include <algorithm>
#include <nlohmann/json.hpp>
#include <utility>

#include "tools/python/kernel.h"
#include "trainer/job/request_options.h"

namespace darb::python {

namespace {

struct OfCommand {
    const char* name;
    const char* instead;
};

constexpr OfCommand kOfCommand[] = {
    {"output", "Call scene().write(path) when you want a file."},
    {"dataset", "Give the data set as the first argument."},
    {"device", "Give device= to Trainer itself."},
    {"tune", "Set DARB_TUNE in the environment before the device is opened."},
    {"allow_mixed", "A Trainer is one process."},
    {"blocks", "The command trains in parts."},
    {"html", "`darb convert` writes web pages."},
    {"frames", "Videos go through `darb train` first."},
    {"resume", "Give start_checkpoint=path."},
    {"sequential", "Photos without cameras go through `darb train` first."},
    {"panoramas", "Photos without cameras go through `darb train` first."},
    {"report", "The command writes reports."},
    {"drop_outside", "Call scene().write(path), and use `darb clean --region` on the file."},
    {"clean_isolated", "Call scene().write(path), and use `darb clean --isolated` on the file."},
    {"clean_haze", "Call scene().write(path), and use `darb clean --haze` on the file."},
    {"clean_free_space", "Call scene().write(path), and use `darb clean --free-space` on it."},
    {"end_without_gain", "Call evaluate() and stop when it gains no more."},
    {"test_iterations", "Call evaluate() when you want it."},
    {"save_iterations", "Call scene().write(path) when you want it."},
    {"checkpoint_iterations", "Call checkpoint(path) when you want it."},
    {"checkpoint_interval", "Call checkpoint(path) when you want it."},
};

// Options of how the command shows a run, which no request holds.
constexpr OfCommand kShown[] = {
    {"view", "Render with scene().render(...) between two steps."},
    {"quiet", "Nothing is printed in any case."},
};

// nullptr where a Trainer takes the option, too.
const OfCommand* row_of_command(const RequestOption& option) {
    for (const OfCommand& one : kOfCommand)
        if (&request_option(one.name) == &option) return &one;
    return nullptr;
}

void refuse_of_command(const std::string& name) {
    for (const OfCommand& one : kShown)
        if (name == one.name) throw Error(name, "is an option of the command alone", one.instead);
    if (const OfCommand* const one = row_of_command(request_option(name)))
        throw Error(name, "is an option of the command alone", one->instead);
}

std::string value_text(const py::object& value, const std::string& name) {
    if (py::isinstance<py::str>(value)) return take_text(value, name.c_str());
    if (py::hasattr(value, "__fspath__")) return take_path(value, name.c_str());
    if (PyIndex_Check(value.ptr()) != 0)
        return std::string(py::str(take_whole_number(value, name.c_str())));
    if (py::hasattr(value, "__float__"))
        return std::string(py::repr(py::float_(take_number(value, name.c_str(), -1e300, 1e300))));
    throw Error(name, type_text(value) + ", which no option takes",
                "Give a number, a text, or True for a flag.");
}

// The options that were given by name, without a kernel that is an object.
GivenOptions given_options(const py::dict& options) {
    GivenOptions given;
    for (const auto& [key, handle] : options) {
        const std::string name = take_text(py::reinterpret_borrow<py::object>(key), "option");
        const auto value = py::reinterpret_borrow<py::object>(handle);
        if (name == "kernel" && kernel_of_object(value)) continue;
        if (name.empty() || name[0] == '-' || name.find('=') != std::string::npos)
            throw Error("option " + name, "is no name", "Use those of `darb train --help-all`.");
        refuse_of_command(name);
        const RequestOption& option = request_option(name);
        if (value.is_none()) continue;
        const bool is_bool = PyBool_Check(value.ptr()) != 0;
        if (is_bool && option_kind(option) != OptionKind::on_off)
            throw Error(name, type_text(value) + ", and this option is no switch",
                        fmt::format("It takes {}.", limits_text(option.row, option_kind(option))));
        given.emplace_back(
            name, is_bool ? (value.ptr() == Py_True ? "on" : "off") : value_text(value, name));
    }
    return given;
}

}  // namespace

TrainRequest take_train_options(const py::dict& options, std::string dataset) {
    TrainRequest request;
    request.dataset = std::move(dataset);
    set_request_options(request, given_options(options));
    if (options.contains("kernel"))
        if (const auto own = kernel_of_object(options["kernel"])) {
            if (was_given(request, "pulses"))
                throw Error("pulses", "means nothing with a kernel of one's own", "Leave it out.");
            request.train.kernel = *own;
        }
    complete_request(request);
    return request;
}

py::dict asked_options(const TrainRequest& request) {
    nlohmann::json all = nlohmann::json::object();
    for (const RequestOption& option : request_options()) {
        if (option.key.empty() || *option.row.flags == '\0' || row_of_command(option) != nullptr)
            continue;
        std::string name = option_name(option.row).substr(2);
        std::replace(name.begin(), name.end(), '-', '_');
        all[name] = saved_value(option, request);
    }
    const std::string text = all.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
    return py::module_::import("json").attr("loads")(text);
}

}  // namespace darb::python
