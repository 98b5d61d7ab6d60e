// SPDX-License-Identifier: MIT
// darb.psi, darb.sim1d and darb.plan: the JSON that the commands of these names write.
#include "tools/python/study.h"

#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include "tools/cost/effect_prices.h"
#include "tools/cost/plan_subject.h"
#include "tools/paper/psi_report.h"
#include "tools/paper/study1d.h"
#include "tools/python/arguments.h"
#include "tools/python/kernel.h"
#include "trainer/job/scene_file.h"

namespace darb::python {

namespace {

py::object loaded(const nlohmann::json& json) {
    const std::string text = json.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
    return py::module_::import("json").attr("loads")(text);
}

// Takes one item or several as a sequence.
std::vector<py::object> several(const py::object& value) {
    std::vector<py::object> list;
    if (py::isinstance<py::list>(value) || py::isinstance<py::tuple>(value))
        for (const py::handle one : value) list.push_back(py::reinterpret_borrow<py::object>(one));
    else
        list.push_back(value);
    return list;
}

std::vector<int> take_kernels(const py::object& value) {
    std::vector<int> kernels;
    if (value.is_none())
        for (int k = 0; k < KERNEL_COUNT; ++k) kernels.push_back(k);
    else
        for (const py::object& one : several(value)) kernels.push_back(take_kernel(one, "kernels"));
    if (kernels.empty())
        throw Error("kernels", "names none", "Name some, or leave it out for all.");
    return kernels;
}

py::object psi(const py::object& kernels, const py::object& samples, const py::object& cells,
               const py::object& seed) {
    PsiGridOptions grid;
    grid.samples = static_cast<int>(take_integer(samples, "samples", 1, 100'000));
    grid.cells = static_cast<int>(take_integer(cells, "cells", 8, 1024));
    grid.seed = static_cast<std::uint64_t>(take_integer(seed, "seed", 0, 1LL << 62));
    const std::vector<int> ids = take_kernels(kernels);
    std::vector<PsiResult> results;
    {
        const py::gil_scoped_release free;
        for (const int k : ids) {
            check_signals();
            results.push_back(measure_psi(derived_kernel(k), grid));
        }
    }
    return loaded(psi_json(results, grid));
}

int take_kernel_1d(const py::object& value) {
    const bool generalised = py::isinstance<py::str>(value) &&
                             take_text(value, "kernels") == kernel_1d_name(kGeneralisedExponential);
    return generalised ? kGeneralisedExponential : take_kernel(value, "kernels");
}

std::vector<int> take_signals(const py::object& value) {
    std::vector<int> signals;
    std::string known;
    for (std::size_t s = 0; s < signals_1d().size(); ++s) {
        known += fmt::format("{}{}", s == 0 ? "" : ", ", signals_1d()[s].name);
        if (value.is_none()) signals.push_back(static_cast<int>(s));
    }
    if (value.is_none()) return signals;
    for (const py::object& one : several(value)) {
        const std::string name = take_text(one, "signals");
        const std::size_t before = signals.size();
        for (std::size_t s = 0; s < signals_1d().size(); ++s)
            if (name == signals_1d()[s].name) signals.push_back(static_cast<int>(s));
        if (signals.size() == before)
            throw Error("signals " + name, "no such signal", "There are " + known + ".");
    }
    if (signals.empty()) throw Error("signals", "names none", "Name some of " + known + ".");
    return signals;
}

// Runs one signal, kernel and number of terms at a time, so that Ctrl-C ends it soon.
py::object sim1d(const py::dict& given) {
    Study1dOptions study;
    const std::vector<int> signals = take_signals(given["signals"]);
    std::vector<int> kernels;
    if (given["kernels"].is_none())
        kernels = kernels_1d();
    else
        for (const py::object& one : several(given["kernels"]))
            kernels.push_back(take_kernel_1d(one));
    std::vector<int> primitives;
    for (const py::object& one : several(given["primitives"]))
        primitives.push_back(static_cast<int>(take_integer(one, "primitives", 1, 1000)));
    if (kernels.empty() || primitives.empty())
        throw Error("sim1d", "no kernel, or no number of primitives", "Name at least one of each.");
    study.seeds = static_cast<int>(take_integer(given["seeds"], "seeds", 1, 10'000));
    study.fit.steps = static_cast<int>(take_integer(given["steps"], "steps", 1, 10'000'000));
    study.fit.samples = static_cast<int>(take_integer(given["samples"], "samples", 16, 1'000'000));
    study.fit.learning_rate = take_number(given["lr"], "lr", 1e-12, 1e6);
    nlohmann::json all;
    {
        const py::gil_scoped_release free;
        for (const int signal : signals)
            for (const int kernel : kernels)
                for (const int count : primitives) {
                    check_signals();
                    study.signals = {signal};
                    study.kernels = {kernel};
                    study.primitives = {count};
                    nlohmann::json one = study_1d_json(study_1d(study, [](auto, auto) {}));
                    if (all.is_null())
                        all = std::move(one);
                    else
                        all["rows"].push_back(one["rows"][0]);
                }
        all.erase("seconds");
    }
    return loaded(all);
}

py::object plan(const py::dict& given) {
    PlanRequest request;
    request.what = take_path(given["what"], "what");
    if (!given["cameras"].is_none()) request.cameras = take_path(given["cameras"], "cameras");
    request.effects = take_text(given["effects"], "effects");
    request.device = take_text(given["device"], "device");
    request.depth = take_flag(given["depth"], "depth");
    request.data.resolution =
        static_cast<int>(take_integer(given["resolution"], "resolution", -1, 1 << 20));
    request.data.original_where_wide = true;
    if (!given["sh_degree"].is_none())
        request.sh_degree = static_cast<int>(take_integer(given["sh_degree"], "sh_degree", 0, 3));
    if (!given["kernel"].is_none()) request.kernel = take_kernel(given["kernel"], "kernel");
    const bool price = take_flag(given["price"], "price");
    nlohmann::json result;
    {
        const py::gil_scoped_release free;
        const bool scene = is_scene(request.what);
        const EffectChoice choice = choose_effects(
            request.effects, scene ? EffectUse::pictures : EffectUse::training, request.data);
        const PlanSubject subject = open_subject(request);
        EffectPlan plan = plan_of(subject, request, choice);
        EffectPrices prices;
        if (price && (subject.training || subject.model.size() > 0)) {
            check_signals();
            const Measured base = measure_subject(subject, request, plan);
            plan.note_frame(base.huge_splats, base.longest_list);
            prices = price_effects(plan, base, switchable_effects(subject, request),
                                   degree_of(subject, request), [&](const EffectPlan& p) {
                                       check_signals();
                                       return measure_subject(subject, request, p);
                                   });
        }
        result = priced_json(plan, prices);
    }
    return loaded(result);
}

}  // namespace

void bind_study(py::module_& module) {
    module.def("psi", &psi);
    module.def("sim1d", &sim1d);
    module.def("plan", &plan);
}

}  // namespace darb::python
