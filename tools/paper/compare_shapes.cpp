#include "tools/paper/compare_shapes.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "engine/core/quantile.h"
#include "engine/kernels/shaped_kernel.h"
#include "engine/report/html.h"
#include "engine/report/svg_plot.h"
#include "engine/scene/splat_file.h"
#include "shaders/shared/limits.h"

namespace darb {

namespace {

constexpr std::size_t kBins = 32;

// Bins are even in the exponent, or in its logarithm where no exponent is 0.
bool by_logarithm(const ShapedKernel& kernel) {
    return kernel.exponent_least() > 0;
}

std::vector<double> edges_of(const ShapedKernel& kernel) {
    const double least = kernel.exponent_least(), most = kernel.exponent_most();
    std::vector<double> edges;
    for (std::size_t i = 0; i <= kBins; ++i) {
        const double share = static_cast<double>(i) / kBins;
        edges.push_back(by_logarithm(kernel) ? least * std::pow(most / least, share)
                                             : least + share * (most - least));
    }
    return edges;
}

const ComparedRun* first_with_shapes(const ComparedDataset& dataset, const std::string& kernel) {
    for (const ComparedRun& run : dataset.runs)
        if (run.kernel == kernel && run.shapes) return &run;
    return nullptr;
}

std::string table_of(const Comparison& c, const std::string& kernel) {
    std::string rows;
    for (const ComparedDataset& dataset : c.datasets)
        if (const ComparedRun* run = first_with_shapes(dataset, kernel)) {
            rows += "<tr><td>" + html_escape(dataset.name) + "</td>";
            for (const double value : run->shapes->percentiles)
                rows += fmt::format("<td>{:.3g}</td>", value);
            rows += "</tr>\n";
        }
    std::string head;
    for (const int p : LearnedShapes::kPercentiles) head += fmt::format("<th>{} %</th>", p);
    return "<div class='wide'><table><tr><th>" + html_escape(kernel) + "</th>" + head + "</tr>\n" +
           rows + "</table></div>\n";
}

std::string plot_of(const Comparison& c, const std::string& kernel) {
    Plot plot{"Learned by " + kernel, "exponent", "splats (%)", {}};
    plot.from_zero = true;
    for (const ComparedDataset& dataset : c.datasets) {
        PlotSeries series;
        series.name = dataset.name;
        series.stairs = true;
        if (const ComparedRun* run = first_with_shapes(dataset, kernel)) {
            const LearnedShapes& s = *run->shapes;
            plot.log_x = s.edges.front() > 0;
            if (!plot.log_x) plot.x_label = "weight of the second kernel";
            for (std::size_t i = 0; i < s.shares.size(); ++i)
                series.points.emplace_back(s.edges[i], 100 * s.shares[i]);
            series.points.emplace_back(s.edges.back(), 100 * s.shares.back());
        }
        plot.series.push_back(std::move(series));
    }
    return svg_plot(plot);
}

}  // namespace

std::optional<LearnedShapes> learned_shapes(const SplatModel& model) {
    if (!kernel_has_shape(model.kernel)) return {};
    std::vector<double> exponents;
    for (std::size_t i = 0; i < model.size(); ++i)
        if (sigmoid(model.opacity_logit[i]) >= ALPHA_CUTOFF_DEFAULT)
            exponents.push_back(
                splat_exponent(model.kernel, model.footprint, double{model.shape[i]}));
    if (exponents.empty()) return {};
    LearnedShapes shapes;
    shapes.edges = edges_of(shaped_kernel(model.kernel));
    shapes.shares.resize(kBins);
    for (const double exponent : exponents) {
        const auto above = std::upper_bound(shapes.edges.begin(), shapes.edges.end(), exponent);
        const auto bin = std::max<std::ptrdiff_t>(above - shapes.edges.begin() - 1, 0);
        shapes.shares[std::min<std::size_t>(std::size_t(bin), kBins - 1)] +=
            1.0 / static_cast<double>(exponents.size());
    }
    for (const int p : LearnedShapes::kPercentiles)
        shapes.percentiles.push_back(nearest_rank(exponents, p / 100.0));
    return shapes;
}

void read_shapes_of(ComparedRun& run) {
    if (run.at.empty() || run.at.back().model.empty()) return;
    const std::optional<int> kernel = kernel_from_name(run.kernel);
    if (kernel && kernel_has_shape(*kernel))
        run.shapes = learned_shapes(load_splats(run.at.back().model));
}

std::string shapes_html(const Comparison& c) {
    std::string plots, tables;
    for (const std::string& kernel : c.kernels)
        if (std::any_of(c.datasets.begin(), c.datasets.end(), [&](const ComparedDataset& dataset) {
                return first_with_shapes(dataset, kernel) != nullptr;
            })) {
            plots += plot_of(c, kernel);
            tables += table_of(c, kernel);
        }
    if (plots.empty()) return {};
    return "<h2>One kernel, or many?</h2><p class='soft'>The shapes that splats learned, of those "
           "that are drawn, first seed that is there. Where a curve is narrow, one kernel would "
           "do. The tables "
           "have percentiles.</p><div class='plots'>" +
           plots + "</div>\n" + tables;
}

nlohmann::json shapes_json(const LearnedShapes& shapes) {
    nlohmann::json json{{"edges", shapes.edges}, {"shares", shapes.shares}};
    for (std::size_t i = 0; i < shapes.percentiles.size(); ++i)
        json[fmt::format("p{}", LearnedShapes::kPercentiles[i])] = shapes.percentiles[i];
    return json;
}

}  // namespace darb
