#include "tools/paper/compare_pulses.h"

#include <fmt/format.h>

#include <algorithm>

#include "engine/kernels/kernel_family.h"
#include "engine/report/html.h"
#include "tools/paper/compare_stats.h"

namespace darb {

namespace {

using Value = std::optional<double>;

Value median_of(const ComparedDataset& dataset, const std::string& kernel, int iteration,
                std::string_view column) {
    for (const Column& c : quality_columns())
        if (c.json == column) return over_seeds(dataset, kernel, iteration, c).median;
    return std::nullopt;
}

std::string difference_text(const Value& v, int decimals) {
    return v ? fmt::format("{:+.{}f}", *v, decimals) : "-";
}

std::string ratio_text(const Value& v) {
    return v ? fmt::format("x{:.2f}", *v) : "-";
}

std::string yes(const Value& known, bool so) {
    return !known ? "-" : so ? "yes" : "no";
}

}  // namespace

std::vector<PulseChange> pulse_changes(const Comparison& comparison, const ComparedDataset& dataset,
                                       int iteration) {
    std::vector<PulseChange> changes;
    const std::vector<std::string>& names = comparison.kernels;
    for (const std::string& name : names) {
        const int row = kernel_from_name(name).value();
        const std::string one(kernel_name(kernel_with_pulses(row, 1).value()));
        if (name == one || std::find(names.begin(), names.end(), one) == names.end()) continue;
        const auto both = [&](std::string_view column, auto change) {
            const Value more = median_of(dataset, name, iteration, column);
            const Value base = median_of(dataset, one, iteration, column);
            return more && base ? Value(change(*more, *base)) : Value();
        };
        const auto less = [](double more, double base) { return more - base; };
        const auto over = [](double more, double base) { return more / base; };
        changes.push_back({one, kernel_pulses(row), both("psnr_db", less), both("ssim", less),
                           both("splats", over), both("model_mb", over), both("peak_mb", over),
                           both("training_s", over)});
    }
    return changes;
}

std::string pulse_lines(const Comparison& comparison, const ComparedDataset& dataset) {
    std::string text;
    for (const int iteration : comparison.iterations)
        for (const PulseChange& c : pulse_changes(comparison, dataset, iteration))
            text += fmt::format(
                "{}, {} iterations, {} with {} pulses against one: PSNR {} dB, SSIM {}, splats {}, "
                "model {}, peak {}, time {}; less memory: {}, less PSNR: {}, less SSIM: {}\n",
                dataset.name, format_number(iteration), c.kernel, c.pulses,
                difference_text(c.psnr_db, 2), difference_text(c.ssim, 4), ratio_text(c.splats),
                ratio_text(c.model), ratio_text(c.peak), ratio_text(c.seconds),
                yes(c.model, c.less_memory()), yes(c.psnr_db, c.less_psnr()),
                yes(c.ssim, c.less_ssim()));
    return text;
}

std::string pulse_html(const Comparison& comparison, const ComparedDataset& dataset) {
    std::string rows;
    for (const int iteration : comparison.iterations)
        for (const PulseChange& c : pulse_changes(comparison, dataset, iteration))
            rows += fmt::format(
                "<tr><td>{}</td><td>{}</td><td>{}</td><td>{}</td><td>{}</td><td>{}</td><td>{}</td>"
                "<td>{}</td><td>{}</td><td>{}</td><td>{}</td><td>{}</td></tr>\n",
                html_escape(c.kernel), c.pulses, format_number(iteration),
                difference_text(c.psnr_db, 2), difference_text(c.ssim, 4), ratio_text(c.splats),
                ratio_text(c.model), ratio_text(c.peak), ratio_text(c.seconds),
                yes(c.model, c.less_memory()), yes(c.psnr_db, c.less_psnr()),
                yes(c.ssim, c.less_ssim()));
    if (rows.empty()) return {};
    return "<h3>More pulses against one</h3><p class='soft'>The paper: less memory and less "
           "quality. Memory is that of the model.</p><div class='wide'><table>"
           "<tr><th>kernel</th><th>pulses</th><th>iterations</th><th>PSNR (dB)</th><th>SSIM</th>"
           "<th>splats</th><th>model</th><th>peak</th><th>training</th><th>less memory</th>"
           "<th>less PSNR</th><th>less SSIM</th></tr>\n" +
           rows + "</table></div>\n";
}

nlohmann::json pulse_json(const Comparison& comparison, const ComparedDataset& dataset) {
    const auto number = [](const Value& v) {
        return v ? nlohmann::json(*v) : nlohmann::json(nullptr);
    };
    nlohmann::json rows = nlohmann::json::array();
    for (const int iteration : comparison.iterations)
        for (const PulseChange& c : pulse_changes(comparison, dataset, iteration))
            rows.push_back({{"kernel", c.kernel},
                            {"pulses", c.pulses},
                            {"iteration", iteration},
                            {"psnr_db_difference", number(c.psnr_db)},
                            {"ssim_difference", number(c.ssim)},
                            {"splats_ratio", number(c.splats)},
                            {"model_ratio", number(c.model)},
                            {"peak_ratio", number(c.peak)},
                            {"training_ratio", number(c.seconds)},
                            {"less_memory", c.less_memory()},
                            {"less_psnr", c.less_psnr()},
                            {"less_ssim", c.less_ssim()}});
    return rows;
}

}  // namespace darb
