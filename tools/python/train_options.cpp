#include "tools/python/train_options.h"

#include <fmt/format.h>

#include <algorithm>

#include "tools/darb/numbers.h"
#include "tools/darb/train_flags.h"
#include "tools/python/kernel.h"

namespace darb::python {

namespace {

struct OfCommand {
    const char* name;
    const char* instead;
};

constexpr OfCommand kOfCommand[] = {
    {"output", "Call scene().write(path) when you want a file."},
    {"model_path", "Call scene().write(path) when you want a file."},
    {"source_path", "Give the data set as the first argument."},
    {"dataset", "Give the data set as the first argument."},
    {"device", "Give device= to Trainer itself."},
    {"view", "Render with scene().render(...) between two steps."},
    {"quiet", "Nothing is printed in any case."},
    {"resume", "Give start_checkpoint=path."},
    {"sequential", "Photos without cameras go through `darb train` first."},
    {"report", "The command writes reports."},
    {"test_iterations", "Call evaluate() when you want it."},
    {"save_iterations", "Call scene().write(path) when you want it."},
    {"checkpoint_iterations", "Call checkpoint(path) when you want it."},
    {"checkpoint_interval", "Call checkpoint(path) when you want it."},
};

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

std::vector<std::string> words_of(const py::dict& options) {
    std::vector<std::string> words;
    for (const auto& [key, handle] : options) {
        const std::string name = take_text(py::reinterpret_borrow<py::object>(key), "option");
        const auto value = py::reinterpret_borrow<py::object>(handle);
        if (name == "kernel" && kernel_of_object(value)) continue;
        for (const OfCommand& one : kOfCommand)
            if (name == one.name)
                throw Error(name, "is an option of the command alone", one.instead);
        std::string flag = name;
        std::replace(flag.begin(), flag.end(), '_', '-');
        if (flag.empty() || flag.find('=') != std::string::npos || flag[0] == '-')
            throw Error("option " + name, "is no name", "Use those of `darb train --help-all`.");
        const std::string dashes = flag.size() == 1 ? "-" : "--";
        if (PyBool_Check(value.ptr()) != 0)
            words.push_back((value.ptr() == Py_True ? dashes : "--no-") + flag);
        else if (!value.is_none()) {
            words.push_back(dashes + flag + (flag.size() == 1 ? "" : "=") +
                            value_text(value, name));
        }
    }
    return words;
}

}  // namespace

TrainRequest take_train_options(const py::dict& options) {
    std::vector<std::string> words = words_of(options);
    refuse_empty_values(words);
    TrainFlags flags;
    CLI::App app;
    add_train_flags(*app.add_subcommand("train"), flags);
    words.insert(words.begin(), "train");
    words.insert(words.end(), {"-q", "-o", "."});
    try {
        app.parse(std::vector<std::string>(words.rbegin(), words.rend()));
        refuse_no_numbers(app);
    } catch (const CLI::ParseError& e) {
        throw Error("darb.Trainer", e.what(),
                    "`darb train --help-all` lists the options; here they have underscores.");
    }
    finish_train_flags(flags);
    TrainRequest& request = flags.request;
    if (!options.contains("kernel")) return request;
    const auto own = kernel_of_object(options["kernel"]);
    if (!own) return request;
    if (flags.pulses != 1)
        throw Error("pulses", "means nothing with a kernel of one's own", "Leave it out.");
    if (request.train.footprint == Footprint::exact && !has_exact_footprint(*own))
        throw Error("footprint exact", "is not there for this kernel", "Use psi.");
    request.train.kernel = *own;
    return request;
}

}  // namespace darb::python
