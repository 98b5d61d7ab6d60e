#include "tools/paper/kernel_fits.h"

#include <fmt/format.h>

#include <cmath>
#include <limits>

#include "engine/core/text.h"
#include "engine/kernels/kernel_coefficients.h"
#include "engine/kernels/kernel_registry.h"
#include "engine/report/html.h"

namespace darb {

namespace {

std::string form_of(const KernelCoefficients& k) {
    if (k.form == KERNEL_FORM_GAUSSIAN) return fmt::format("2^n P{}(f)", k.degree);
    if (k.form == KERNEL_FORM_QUADRIC) return k.half_power == 2 ? "1/(1 + q)" : "1/sqrt(1 + q)";
    const char* x = k.squared ? "t^2" : "t";
    if (k.half_power == 0) return fmt::format("P{}({})", k.degree, x);
    return fmt::format("(1 - {})^{} P{}({})", x, k.half_power / 2, k.degree, x);
}

std::string error_text(double value) {
    return std::isnan(value) ? "none" : fmt::format("{:.1e}", value);
}

}  // namespace

std::vector<KernelFit> fits_of(const std::vector<int>& kernels) {
    std::vector<KernelFit> fits;
    for (const int kernel : kernels) {
        const KernelCoefficients& k = kernel_coefficients(kernel, Footprint::psi, kFullDegree);
        KernelFit fit{kernel, form_of(k), k.value_error, std::numeric_limits<double>::quiet_NaN(),
                      "",     0};
        if (has_exact_footprint(kernel))
            fit.exact_error =
                kernel_coefficients(kernel, Footprint::exact, kFullDegree).value_error;
        if (const KernelDefinition* own = kernel_definition(kernel)) {
            fit.source = own->source;
            fit.source_error = own->error;
        }
        fits.push_back(std::move(fit));
    }
    return fits;
}

std::string fits_table(const std::vector<KernelFit>& fits) {
    std::string text = fmt::format("\n{:<22} {:>9} {:<20} {:>9} {:>9}\n", "in the shaders", "R^2",
                                   "w, t = q / R^2", "error", "exact's");
    for (const KernelFit& f : fits) {
        const double support = kernel_support(f.kernel);
        text += fmt::format("{:<22} {:>9} {:<20} {:>9} {:>9}\n", kernel_name(f.kernel),
                            std::isfinite(support) ? fmt::format("{:.6g}", support) : "none",
                            f.form, error_text(f.error), error_text(f.exact_error));
        if (!f.source.empty())
            text += fmt::format("  {}\n  drawn to {} of that\n", printable(f.source),
                                error_text(f.source_error));
    }
    return text;
}

nlohmann::json fits_json(const std::vector<KernelFit>& fits) {
    const auto finite = [](double value) {
        return std::isfinite(value) ? nlohmann::json(value) : nlohmann::json();
    };
    nlohmann::json rows = nlohmann::json::array();
    for (const KernelFit& f : fits) {
        nlohmann::json row{{"kernel", kernel_name(f.kernel)},
                           {"support_q", finite(kernel_support(f.kernel))},
                           {"form", f.form},
                           {"error", f.error},
                           {"exact_footprint_error", finite(f.exact_error)}};
        if (!f.source.empty()) {
            row["source"] = f.source;
            row["source_error"] = f.source_error;
        }
        rows.push_back(std::move(row));
    }
    return rows;
}

std::string fits_html(const std::vector<KernelFit>& fits) {
    std::string html =
        "<h2>In the shaders</h2><div class='wide'><table><tr><th>kernel</th><th>R^2</th><th>w, t = "
        "q / R^2</th><th>error</th><th>error of the exact footprint</th><th>made from</th>"
        "<th>drawn to</th></tr>\n";
    for (const KernelFit& f : fits) {
        const double support = kernel_support(f.kernel);
        html += fmt::format(
            "<tr><td>{}</td><td>{}</td><td>{}</td><td>{}</td><td>{}</td><td>{}</td><td>{}</td>"
            "</tr>\n",
            html_escape(std::string(kernel_name(f.kernel))),
            std::isfinite(support) ? fmt::format("{:.6g}", support) : "none", html_escape(f.form),
            error_text(f.error), error_text(f.exact_error), html_escape(f.source),
            f.source.empty() ? "" : error_text(f.source_error));
    }
    return html + "</table></div>\n";
}

}  // namespace darb
