#include "tools/paper/kernel_fits.h"

#include <fmt/format.h>

#include <cmath>
#include <limits>

#include "engine/core/text.h"
#include "engine/kernels/kernel_coefficients.h"
#include "engine/kernels/kernel_registry.h"
#include "engine/kernels/shaped_kernel.h"
#include "engine/report/html.h"

namespace darb {

namespace {

std::string form_of(const KernelCoefficients& k) {
    if (k.form == KERNEL_FORM_GAUSSIAN || k.form == KERNEL_FORM_GES)
        return fmt::format("2^n P{}(f)", k.degree);
    if (k.form == KERNEL_FORM_BETA) return fmt::format("(1 - t)^e, 2^n P{}(f)", k.degree);
    if (k.form == KERNEL_FORM_EXPONENTIAL) return fmt::format("of q^(e/2), 2^n P{}(f)", k.degree);
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

namespace {

struct ShapeRow {
    int kernel;
    double exponent, psi, width;  // standard deviation in the picture, in that of the splat
};

std::vector<ShapeRow> shape_rows(const std::vector<int>& kernels) {
    std::vector<ShapeRow> rows;
    for (const int kernel : kernels) {
        if (!kernel_has_shape(kernel)) continue;
        const ShapedKernel& shaped = shaped_kernel(kernel);
        for (const double e : shaped.exponents_to_check())
            rows.push_back({kernel, e, shaped.covariance_scale(Footprint::psi, e),
                            std::sqrt(shaped.second_moment(Footprint::psi, e))});
    }
    return rows;
}

}  // namespace

std::string shapes_table(const std::vector<int>& kernels) {
    const std::vector<ShapeRow> rows = shape_rows(kernels);
    if (rows.empty()) return "";
    std::string text =
        fmt::format("\n{:<24} {:>8} {:>10} {:>10}\n", "each splat's exponent", "", "psi", "width");
    for (const ShapeRow& row : rows)
        text += fmt::format("{:<24} {:>8.3g} {:>10.5f} {:>10.5f}\n", kernel_name(row.kernel),
                            row.exponent, row.psi, row.width);
    return text;
}

nlohmann::json shapes_json(const std::vector<int>& kernels) {
    nlohmann::json rows = nlohmann::json::array();
    for (const ShapeRow& row : shape_rows(kernels))
        rows.push_back({{"kernel", kernel_name(row.kernel)},
                        {"exponent", row.exponent},
                        {"psi", row.psi},
                        {"width", row.width}});
    return rows;
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
