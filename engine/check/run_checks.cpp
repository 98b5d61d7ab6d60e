#include "engine/check/run_checks.h"

#include <chrono>

#include "engine/check/hard_cases.h"
#include "engine/kernels/shaped_kernel.h"

namespace darb::check {

namespace {

struct Variant {
    int kernel;
    Footprint footprint = Footprint::psi;
    int evaluation = EVALUATION_POLYNOMIAL;
};

std::vector<Variant> variants(bool every, std::optional<int> one = std::nullopt) {
    if (one) {
        std::vector<Variant> footprints{{*one}};
        if (has_exact_footprint(*one)) footprints.push_back({*one, Footprint::exact});
        return footprints;
    }
    if (!every)  // the kernels of the paper, an exact footprint, the built-in exp, shapes
        return {{KERNEL_GAUSSIAN},
                {KERNEL_RAISED_COSINE},
                {KERNEL_HALF_COSINE_SQUARED},
                {KERNEL_SINC},
                {KERNEL_INVERSE_QUADRATIC},
                {KERNEL_RAISED_COSINE, Footprint::exact},
                {KERNEL_GAUSSIAN, Footprint::psi, EVALUATION_BUILTIN},
                {KERNEL_BETA},
                {KERNEL_GENERALIZED_EXPONENTIAL},
                {KERNEL_GES_PUBLISHED},
                {blend_of(KERNEL_GAUSSIAN, KERNEL_RAISED_COSINE)}};
    std::vector<Variant> all;
    std::vector<int> shaped = shaped_kernels();  // and blends: smooth, and with jump and kink
    shaped.push_back(blend_of(KERNEL_GAUSSIAN, KERNEL_RAISED_COSINE));
    shaped.push_back(blend_of(KERNEL_SINC, KERNEL_INVERSE_QUADRATIC));
    for (const int kernel : shaped)
        for (const Footprint f : {Footprint::psi, Footprint::exact})
            if (f == Footprint::psi || has_exact_footprint(kernel)) all.push_back({kernel, f});
    for (int kernel = 0; kernel < KERNEL_COUNT; ++kernel)
        for (const Footprint f : {Footprint::psi, Footprint::exact})
            for (const int e : {EVALUATION_POLYNOMIAL, EVALUATION_BUILTIN})
                all.push_back({kernel, f, e});
    return all;
}

class Checks {
  public:
    explicit Checks(const OnRow& on_row) : on_row_(on_row) {}

    template <class Check>
    void run(const Check& check) {
        const auto start = std::chrono::steady_clock::now();
        std::vector<Row> rows = check();
        const std::chrono::duration<double> taken = std::chrono::steady_clock::now() - start;
        for (Row& row : rows) {
            row.seconds = taken.count() / static_cast<double>(rows.size());
            if (on_row_) on_row_(row);
            rows_.push_back(std::move(row));
        }
    }
    std::vector<Row> take() { return std::move(rows_); }

  private:
    const OnRow& on_row_;
    std::vector<Row> rows_;
};

}  // namespace

std::vector<Row> run_checks(Device& device, const CheckOptions& options, const OnRow& on_row) {
    Checks checks(on_row);
    checks.run([&] { return check_kernels(device, options.kernel); });
    if (!options.kernel) {
        checks.run([&] { return check_scan_and_sort(device); });
        checks.run([&] { return check_loss(device); });
    }
    for (const Variant& v : variants(options.every_kernel, options.kernel))
        checks.run([&] {
            return check_walk(device, v.kernel, v.footprint, v.evaluation, options.every_kernel);
        });
    for (const Variant& v : options.every_kernel || options.kernel
                                ? variants(true, options.kernel)
                                : std::vector<Variant>{{KERNEL_RAISED_COSINE}}) {
        if (v.evaluation != EVALUATION_POLYNOMIAL) continue;
        const std::string group =
            fmt::format("hard cases, {} {}", kernel_name(v.kernel), footprint_name(v.footprint));
        for (const HardCase& c : hard_cases(v.kernel, v.footprint))
            checks.run([&] { return check_hard_case(device, c, group, options.every_kernel); });
        if (v.footprint == Footprint::psi)
            checks.run([&] { return check_poison(device, v.kernel, group); });
    }
    return checks.take();
}

}  // namespace darb::check
