// SPDX-License-Identifier: MIT
#include "tools/paper/psi_report.h"

#include <fmt/format.h>
#include <algorithm>
#include <cmath>
#include <glm/glm.hpp>
#include <limits>
#include <vector>

#include "engine/core/error.h"
#include "engine/core/rng.h"
#include "engine/core/text.h"
#include "engine/kernels/kernel_coefficients.h"
#include "engine/kernels/kernel_profile.h"
#include "engine/kernels/kernel_registry.h"
#include "engine/kernels/shaped_kernel.h"
#include "engine/reference/parallel.h"
#include "engine/report/html.h"
#include "tools/paper/compare_pictures.h"

namespace darb {

namespace {

constexpr double kGaussSupport = 36;  // here the Gaussian is cut at this q: e^-18
constexpr int kMaximumSamples = 4000;

double support_of(const DerivedKernel& kernel) {
    return std::min(kernel.row().support, kGaussSupport);
}

glm::dmat3 random_rotation(Pcg32& rng) {
    const double w = rng.normal(), x = rng.normal(), y = rng.normal(), z = rng.normal();
    const double s = 2 / (w * w + x * x + y * y + z * z);
    return {1 - s * (y * y + z * z), s * (x * y + w * z),     s * (x * z - w * y),
            s * (x * y - w * z),     1 - s * (x * x + z * z), s * (y * z + w * x),
            s * (x * z + w * y),     s * (y * z - w * x),     1 - s * (x * x + y * y)};
}

glm::dmat3 random_covariance(Pcg32& rng) {
    for (;;) {
        const glm::dmat3 axes = random_rotation(rng);
        glm::dmat3 scaled = axes;
        for (int i = 0; i < 3; ++i) scaled[i] *= std::exp2(rng.uniform(-1, 1));
        const glm::dmat3 s = scaled * glm::transpose(scaled);
        if (std::abs(s[0][1]) >= 0.2 * std::sqrt(s[0][0] * s[1][1])) return s;
    }
}

/// One experiment: {xx, xy, yy} of the weighted 2D covariance, divided by those of the 3D one.
std::array<double, 3> grid_ratios(const DerivedKernel& kernel, const glm::dmat3& covariance,
                                  const glm::dvec3& mean, int cells) {
    const double support = support_of(kernel);
    const glm::dmat3 inverse = glm::inverse(covariance);
    glm::dvec3 step, first;  // cell centres on the world's lattice, whatever the mean
    for (int a = 0; a < 3; ++a) {
        step[a] = 2 * std::sqrt(support * covariance[a][a]) / (cells - 1);
        first[a] = step[a] * (std::floor(mean[a] / step[a]) - 0.5 * (cells - 1));
    }
    double total = 0;
    glm::dvec2 centre(0);
    glm::dmat2 second(0);
    for (int j = 0; j < cells; ++j)
        for (int i = 0; i < cells; ++i) {
            double column = 0;  // the density summed along z
            for (int k = 0; k < cells; ++k) {
                const glm::dvec3 d = first + step * glm::dvec3(i, j, k) - mean;
                const double q = glm::dot(d, inverse * d);
                if (q < support) column += kernel.value(Footprint::psi, q);
            }
            const glm::dvec2 p(first.x + step.x * i, first.y + step.y * j);
            total += column;
            centre += column * p;
            second += column * glm::outerProduct(p, p);
        }
    centre /= total;
    second = second / total - glm::outerProduct(centre, centre);
    return {second[0][0] / covariance[0][0], second[0][1] / covariance[0][1],
            second[1][1] / covariance[1][1]};
}

PsiSpread spread(std::vector<double> values) {
    std::sort(values.begin(), values.end());
    const std::size_t n = values.size();
    double mean = 0, squares = 0;
    for (const double v : values) mean += v / static_cast<double>(n);
    for (const double v : values) squares += (v - mean) * (v - mean);
    return {0.5 * (values[(n - 1) / 2] + values[n / 2]), values.front(), values.back(),
            n > 1 ? std::sqrt(squares / static_cast<double>(n - 1)) : 0.0};
}

/// Integral of f over [from, to], with nodes that crowd at `to`, where footprints fall like a root.
template <class F>
double integrate(double from, double to, const F& f) {
    return 2 * (to - from) *
           integrate_unit([&](double x) { return x * f(to - (to - from) * x * x); });
}

/// Relative L2 and largest difference of `shown` from the projection; the edge of `shown` is at
/// `edge`.
template <class F>
FootprintDistance distance(const DerivedKernel& kernel, double edge, const F& shown) {
    const double support = support_of(kernel);
    const auto truth = [&](double q) { return projected_profile(kernel, q); };
    const auto squared_error = [&](double q) {
        const double error = truth(q) - shown(q);
        return error * error;
    };
    const double inner = std::min(support, edge), outer = std::max(support, edge);
    double error = integrate(0, inner, squared_error);
    if (outer > inner) error += integrate(inner, outer, squared_error);
    const double square = integrate(0, support, [&](double q) { return truth(q) * truth(q); });
    FootprintDistance result{std::sqrt(error / square), 0};
    for (int i = 0; i < kMaximumSamples; ++i) {
        const double q = outer * (i + 0.5) / kMaximumSamples;
        result.linf = std::max(result.linf, std::abs(truth(q) - shown(q)));
    }
    return result;
}

}  // namespace

double projected_profile(const DerivedKernel& kernel, double q) {
    const double support = kernel.row().support;
    if (!std::isfinite(support)) return std::exp(-q / 2);  // as shapes of splats start, too
    if (q >= support) return 0;
    const auto integral = [&](double at) {
        const double half = std::sqrt(support - at);
        double sum = 0;
        for (const auto [x, weight] : even_quadrature())
            sum += weight * kernel.value(Footprint::psi, at + half * half * x * x);
        return sum * half;
    };
    return integral(q) / integral(0);
}

std::array<PsiSpread, 3> psi_on_grid(const DerivedKernel& kernel, const PsiGridOptions& options) {
    DARB_CHECK(options.samples >= 1 && options.cells >= 8, "{} samples, {} cells", options.samples,
               options.cells);
    const auto count = static_cast<std::size_t>(options.samples);
    std::vector<glm::dmat3> covariances;
    std::vector<glm::dvec3> means;
    Pcg32 rng(options.seed);
    for (std::size_t i = 0; i < count; ++i) {
        covariances.push_back(random_covariance(rng));
        means.emplace_back(rng.uniform(-1, 1), rng.uniform(-1, 1), rng.uniform(-1, 1));
    }
    std::array<std::vector<double>, 3> ratios;
    for (std::vector<double>& r : ratios) r.resize(count);
    reference::parallel_for(count, 0, [&](std::size_t i) {
        const auto one = grid_ratios(kernel, covariances[i], means[i], options.cells);
        for (std::size_t e = 0; e < 3; ++e) ratios[e][i] = one[e];
    });
    return {spread(ratios[0]), spread(ratios[1]), spread(ratios[2])};
}

FootprintDistance footprint_distance(const DerivedKernel& kernel, double scale) {
    return distance(kernel, scale * support_of(kernel),
                    [&](double q) { return kernel.value(Footprint::psi, q / scale); });
}

FootprintDistance footprint_distance(const DerivedKernel& kernel, const KernelCoefficients& exact) {
    return distance(kernel, support_of(kernel), [&](double q) {
        float w, slope;
        evaluate(exact, static_cast<float>(q), w, slope);
        return static_cast<double>(w);
    });
}

double least_squares_psi(const DerivedKernel& kernel) {
    if (!std::isfinite(kernel.row().support)) return 1;
    // Golden section on the squared error, whose only minimum lies well within the bracket.
    constexpr double kGolden = 0.6180339887498949;
    double low = 0.2, high = 3;
    double a = high - kGolden * (high - low), b = low + kGolden * (high - low);
    double at_a = footprint_distance(kernel, a).l2, at_b = footprint_distance(kernel, b).l2;
    while (high - low > 1e-8) {
        if (at_a < at_b) {
            high = b;
            b = a;
            at_b = at_a;
            at_a = footprint_distance(kernel, a = high - kGolden * (high - low)).l2;
        } else {
            low = a;
            a = b;
            at_a = at_b;
            at_b = footprint_distance(kernel, b = low + kGolden * (high - low)).l2;
        }
    }
    return (low + high) / 2;
}

PsiResult measure_psi(const DerivedKernel& kernel, const PsiGridOptions& options) {
    PsiResult result;
    result.kernel = kernel.row().name;
    result.support = kernel.row().support;
    result.grid = psi_on_grid(kernel, options);
    result.exact = kernel.psi();
    result.best = least_squares_psi(kernel);
    result.by_psi = footprint_distance(kernel, result.exact);
    result.by_best = footprint_distance(kernel, result.best);
    result.by_one = footprint_distance(kernel, 1);
    result.by_exact_footprint =
        footprint_distance(kernel, fit_coefficients(kernel, Footprint::exact, kFullDegree));
    return result;
}

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

namespace {

Table fits_of_shaders(const std::vector<KernelFit>& fits) {
    using Kind = TableColumn::Kind;
    Table table{"shaders", "In the shaders", "", {}, {}};
    table.columns = {{"kernel", "", Better::neither, 0, Kind::name},
                     {"R^2", "", Better::neither, 4},
                     {"w, t = q / R^2", "", Better::neither, 0, Kind::name},
                     {"error", "", Better::neither, 1, Kind::scientific},
                     {"error of the exact footprint", "", Better::neither, 1, Kind::scientific},
                     {"made from", "", Better::neither, 0, Kind::name},
                     {"drawn to", "", Better::neither, 1, Kind::scientific}};
    for (const KernelFit& f : fits) {
        const double support = kernel_support(f.kernel);
        const bool own = !f.source.empty();
        table.rows.push_back(
            {{std::string(kernel_name(f.kernel)),
              std::isfinite(support) ? TableCell(support) : TableCell("none"), f.form, f.error,
              std::isnan(f.exact_error) ? TableCell("none") : TableCell(f.exact_error), f.source,
              own ? TableCell(f.source_error) : TableCell()}});
    }
    return table;
}

}  // namespace

namespace {

constexpr int kPoints = 241;    // points of a curve
constexpr int kFieldSize = 96;  // px of a picture of a field
constexpr double kFieldHalf = 5.2;
constexpr double kNoResidual = 1e-6;  // largest difference: rounding alone
// The ellipsoid of the pictures, in units of its parameter: covariance of x, y, z.
constexpr double kXX = 2.2, kXY = 0.9, kYY = 1.1, kXZ = 0.5, kYZ = -0.3, kZZ = 1.4;

nlohmann::json spread_json(const PsiSpread& s) {
    return {{"median", s.median}, {"low", s.low}, {"high", s.high}, {"deviation", s.deviation}};
}

nlohmann::json distance_json(const FootprintDistance& d) {
    return {{"relative_l2", d.l2}, {"largest", d.linf}};
}

template <class F>
PlotSeries curve(const std::string& name, double end, const F& f) {
    PlotSeries series{name};
    for (int i = 0; i < kPoints; ++i) {
        const double d = end * i / (kPoints - 1);
        series.points.emplace_back(d, f(d * d));
    }
    return series;
}

double shown_radius(const DerivedKernel& kernel) {
    return 1.1 * std::sqrt(std::min(kernel.row().support, 12.25));
}

void add_profiles(const std::vector<const DerivedKernel*>& kernels, Report& report) {
    Plot w{"Kernels", "distance d (standard deviations)", "w", {}};
    Plot a{"Their true projections, peak 1", "distance d (standard deviations)", "A / A(0)", {}};
    Plot p{"The paper's splats: w(d / sqrt psi)", "distance d (standard deviations)", "w", {}};
    double end = 4;
    for (const DerivedKernel* k : kernels)
        if (std::isfinite(k->row().support)) end = std::max(end, 1.1 * std::sqrt(k->row().support));
    std::vector<std::string> names;
    for (const DerivedKernel* k : kernels) {
        const std::string name(k->row().name);
        names.push_back(name);
        w.series.push_back(curve(name, end, [&](double q) { return k->value(Footprint::psi, q); }));
        a.series.push_back(curve(name, end, [&](double q) { return projected_profile(*k, q); }));
        p.series.push_back(
            curve(name, end, [&](double q) { return k->value(Footprint::psi, q / k->psi()); }));
    }
    for (Plot* plot : {&w, &a, &p}) plot->legend_beside = true;
    report.plots({{"kernels", w}, {"projections", a}, {"psi-splats", p}}, names);
}

void add_footprints(const PsiResult& r, const DerivedKernel& kernel, Report& report) {
    const auto truth = [&](double q) { return projected_profile(kernel, q); };
    const auto splat = [&](double scale) {
        return [&kernel, scale](double q) { return kernel.value(Footprint::psi, q / scale); };
    };
    const double end = shown_radius(kernel) * std::sqrt(std::max({1.0, r.exact, r.best}));
    const std::string x = "distance d (standard deviations)";
    Plot both{"Projection and splats", x, "", {}};
    both.series = {curve("psi", end, splat(r.exact)), curve("least squares", end, splat(r.best)),
                   curve("as it is", end, splat(1)), curve("projection", end, truth)};
    Plot rest{"Splat less projection", x, "", {}};
    const auto error = [&](double scale) {
        return [&, scale](double q) { return splat(scale)(q) - truth(q); };
    };
    rest.series = {curve("psi", end, error(r.exact)), curve("least squares", end, error(r.best)),
                   curve("as it is", end, error(1))};
    report.plots({{r.kernel + " splats", both}, {r.kernel + " residuals", rest}});
}

double coordinate(int pixel) {
    return kFieldHalf * (2 * (pixel + 0.5) / kFieldSize - 1);
}

/// q of (x, y) under the 2x2 covariance, and of (x, y, 0) under the 3x3 one.
double q_plane(double x, double y) {
    return (kYY * x * x - 2 * kXY * x * y + kXX * y * y) / (kXX * kYY - kXY * kXY);
}
double q_cut(double x, double y) {
    const double a = kYY * kZZ - kYZ * kYZ, b = kXZ * kYZ - kXY * kZZ, c = kXX * kZZ - kXZ * kXZ;
    const double det = kXX * a + kXY * b + kXZ * (kXY * kYZ - kYY * kXZ);
    return (a * x * x + 2 * b * x * y + c * y * y) / det;
}

std::string fields(const PsiResult& r, const DerivedKernel& kernel) {
    const auto field = [&](const auto& f) {
        return [&f](int i, int j) { return f(coordinate(i), coordinate(j)); };
    };
    const auto density = [&](double x, double y) {
        return kernel.value(Footprint::psi, q_cut(x, y));
    };
    const auto projection = [&](double x, double y) {
        return projected_profile(kernel, q_plane(x, y));
    };
    const auto splat = [&](double x, double y) {
        return kernel.value(Footprint::psi, q_plane(x, y) / r.exact);
    };
    const auto best = [&](double x, double y) {
        return kernel.value(Footprint::psi, q_plane(x, y) / r.best);
    };
    const auto residual = [&](double x, double y) { return splat(x, y) - projection(x, y); };
    const auto best_residual = [&](double x, double y) { return best(x, y) - projection(x, y); };
    const double limit = std::max(r.by_psi.linf, 1e-9);
    const auto caption = [&](const std::string& name, double largest, const std::string& colours) {
        return largest < kNoResidual ? fmt::format("{}: none, the projection is such a splat", name)
                                     : name + colours;
    };
    return html_pictures(
        {{grey_field(kFieldSize, 1, field(density)), "3D density, cut through the centre"},
         {grey_field(kFieldSize, 1, field(projection)), "projection along z"},
         {grey_field(kFieldSize, 1, field(splat)), fmt::format("splat, psi {:.4f}", r.exact)},
         {signed_field(kFieldSize, limit, field(residual)),
          caption("residual of psi", r.by_psi.linf, fmt::format(", full colour {:.3f}", limit))},
         {signed_field(kFieldSize, limit, field(best_residual)),
          caption(fmt::format("residual of {:.4f}", r.best), r.by_best.linf, ", same colours")}},
        190);
}

TableCell spread_cell(const PsiSpread& s) {
    TableCell cell(s.median);
    cell.deviation = s.deviation;
    return cell;
}

void add_rings(Report& report) {
    Plot plot{"Beyond the first pulse", "distance d (standard deviations)", "w", {}};
    for (const int kernel : {KERNEL_RAISED_COSINE_3_PULSES, KERNEL_SINC_3_PULSES}) {
        PlotSeries series{kernel == KERNEL_SINC_3_PULSES ? "|sinc|" : "raised cosine"};
        const double end = std::sqrt(kernel_support(kernel));
        for (int i = 0; i <= 2 * kPoints; ++i) {
            const double d = end * i / (2 * kPoints);
            series.points.emplace_back(d, kernel_value(kernel, Footprint::psi, d * d));
        }
        plot.series.push_back(std::move(series));
    }
    Table table{"rings", "Rings that the limit removes", "", {}, {}};
    table.columns = {{"kernel", "", Better::neither, 0, TableColumn::Kind::name},
                     {"pulses", "", Better::neither, 0},
                     {"radius", "", Better::neither, 1},
                     {"psi", "", Better::neither, 6},
                     {"of the mass beyond the first", "%", Better::neither, 1}};
    for (const Rings& r : all_rings())
        table.rows.push_back({{std::string(kernel_name(r.kernel)), double(r.pulses), r.radius,
                               r.psi, 100 * r.outside}});
    report.table(std::move(table), 2);
    report.plots({{"", plot}});
}

Table psi_figures(const std::vector<PsiResult>& results) {
    using Kind = TableColumn::Kind;
    Table table{"psi", "Every kernel", "", {}, {}};
    table.columns = {{"kernel", "", Better::neither, 0, Kind::name}};
    for (const char* name : {"grid xx", "grid xy", "grid yy"})
        table.columns.push_back({name, "", Better::neither, 5});
    for (const char* name : {"exact", "least squares"})
        table.columns.push_back({name, "", Better::neither, 6});
    for (const char* name : {"psi: L2", "max", "as it is: L2", "max", "least squares: L2", "max"})
        table.columns.push_back({name, "", Better::neither, 4});
    for (const char* name : {"exact footprint: L2", "max"})
        table.columns.push_back({name, "", Better::neither, 1, Kind::scientific});
    for (const PsiResult& r : results) {
        TableRow& row = table.rows.emplace_back();
        row.cells = {r.kernel,
                     spread_cell(r.grid[0]),
                     spread_cell(r.grid[1]),
                     spread_cell(r.grid[2]),
                     r.exact,
                     r.best};
        for (const FootprintDistance& d : {r.by_psi, r.by_one, r.by_best, r.by_exact_footprint})
            row.cells.insert(row.cells.end(), {TableCell(d.l2), TableCell(d.linf)});
    }
    return table;
}

}  // namespace

std::string psi_table(const std::vector<PsiResult>& results) {
    std::string text = fmt::format(
        "{:<22} {:^27} {:>9} {:>9}  {:^13} {:^13} {:^13} {:^15}\n{:<22} {:>8} {:>9} {:>8} {:>9} "
        "{:>9}  {:>6} {:>6} {:>6} {:>6} {:>6} {:>6} {:>7} {:>7}\n",
        "psi", "grid, median", "exact", "least", "psi footprint", "psi = 1", "least squares",
        "exact footprint", "", "xx", "xy", "yy", "moments", "squares", "L2", "max", "L2", "max",
        "L2", "max", "L2", "max");
    for (const PsiResult& r : results)
        text += fmt::format(
            "{:<22} {:>8.5f} {:>9.5f} {:>8.5f} {:>9.6f} {:>9.6f}  {:>6.4f} {:>6.4f} {:>6.4f} "
            "{:>6.4f} {:>6.4f} {:>6.4f} {:>7.1e} {:>7.1e}\n{:<22} {:>8.5f} {:>9.5f} {:>8.5f}\n",
            r.kernel, r.grid[0].median, r.grid[1].median, r.grid[2].median, r.exact, r.best,
            r.by_psi.l2, r.by_psi.linf, r.by_one.l2, r.by_one.linf, r.by_best.l2, r.by_best.linf,
            r.by_exact_footprint.l2, r.by_exact_footprint.linf, "  standard deviation",
            r.grid[0].deviation, r.grid[1].deviation, r.grid[2].deviation);
    text += fmt::format("\n{:<22} {:>8} {:>9} {:>9} {:>16}\n", "with more pulses", "pulses",
                        "radius", "psi", "mass beyond one");
    for (const Rings& r : all_rings())
        text += fmt::format("{:<22} {:>8} {:>9.1f} {:>9.6f} {:>14.1f} %\n", kernel_name(r.kernel),
                            r.pulses, r.radius, r.psi, 100 * r.outside);
    return text;
}

nlohmann::json psi_json(const std::vector<PsiResult>& results, const PsiGridOptions& options) {
    nlohmann::json kernels = nlohmann::json::array();
    for (const PsiResult& r : results)
        kernels.push_back(
            {{"kernel", r.kernel},
             {"support_q", std::isfinite(r.support) ? nlohmann::json(r.support) : nullptr},
             {"grid",
              {{"xx", spread_json(r.grid[0])},
               {"xy", spread_json(r.grid[1])},
               {"yy", spread_json(r.grid[2])}}},
             {"exact", r.exact},
             {"least_squares", r.best},
             {"distance_from_projection",
              {{"psi", distance_json(r.by_psi)},
               {"least_squares", distance_json(r.by_best)},
               {"covariance_as_it_is", distance_json(r.by_one)},
               {"exact_footprint_float32", distance_json(r.by_exact_footprint)}}}});
    nlohmann::json rings = nlohmann::json::array();
    for (const Rings& r : all_rings())
        rings.push_back({{"kernel", kernel_name(r.kernel)},
                         {"pulses", r.pulses},
                         {"radius", r.radius},
                         {"psi", r.psi},
                         {"mass_beyond_first", r.outside}});
    return {{"version", DARB_VERSION}, {"rings", rings},       {"samples", options.samples},
            {"cells", options.cells},  {"seed", options.seed}, {"kernels", kernels}};
}

Report psi_report(const std::vector<PsiResult>& results,
                  const std::vector<const DerivedKernel*>& kernels,
                  const std::vector<KernelFit>& fits, const PsiGridOptions& options) {
    Report report("The correction factor psi",
                  "The kernel's splat beside the true projection of the same 3D kernel");
    report.table(psi_figures(results), 2);
    add_profiles(kernels, report);
    report.table(fits_of_shaders(fits), 2);
    for (std::size_t i = 0; i < results.size(); ++i) {
        report.heading(results[i].kernel);
        report.html(fields(results[i], *kernels[i]));
        add_footprints(results[i], *kernels[i], report);
    }
    add_rings(report);
    report.html(fmt::format(
        "<h2>How to read it</h2><p>Grid: the paper's experiment, {} random covariances on {}^3 "
        "cells: density within the support, summed along z, its weighted 2D covariance over "
        "the 2x2 block of the 3D one; median and standard deviation, for xx, xy and yy apart. "
        "Exact: a third of the ratio of the fourth and the second radial moment. Least "
        "squares: the scale of the covariance that brings the splat nearest to the "
        "projection.</p><p>Distances: "
        "between profiles with peak 1 over the image plane, relative L2 and largest. The exact "
        "footprint is evaluated in float32, as the shaders have it.</p>\n",
        options.samples, options.cells));
    return report;
}

Rings rings_of(int kernel, int pulses) {
    const DerivedKernel& with = derived_kernel(kernel_with_pulses(kernel, pulses).value());
    const double radius = std::sqrt(with.row().support);
    const double first = std::sqrt(with.pulses().front().end);
    return {kernel, pulses, radius, with.psi(),
            1 - with.radial_moment(first, 2) / with.radial_moment(radius, 2)};
}

std::vector<Rings> all_rings() {
    std::vector<Rings> all;
    for (const int kernel : {KERNEL_RAISED_COSINE, KERNEL_SINC})
        for (int pulses = 1; pulses <= KERNEL_MAX_PULSES; ++pulses)
            all.push_back(rings_of(kernel, pulses));
    return all;
}

}  // namespace darb
