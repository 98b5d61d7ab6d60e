#include "tools/paper/compare_means.h"

#include <algorithm>
#include <utility>

#include "engine/kernels/kernel_family.h"
#include "tools/paper/paper_numbers.h"

namespace darb {

namespace {

using Value = std::optional<double>;

constexpr std::pair<std::string_view, double PaperNumbers::*> kPaperColumns[] = {
    {"psnr_db", &PaperNumbers::psnr_db},
    {"ssim", &PaperNumbers::ssim},
    {"lpips", &PaperNumbers::lpips},
    {"model_mb", &PaperNumbers::model_mb},
    {"training_s", &PaperNumbers::training_s}};

Value paper_mean(const std::vector<std::string>& names, const std::string& kernel, int iteration,
                 const std::string& column) {
    double sum = 0;
    std::size_t found = 0;
    for (const auto& [json, member] : kPaperColumns)
        for (const std::string& name : names)
            for (const PaperNumbers& p : paper_numbers_of(name))
                if (json == column && p.iteration == iteration && kernel_name(p.kernel) == kernel) {
                    sum += p.*member;
                    ++found;
                }
    return found > 0 && found == names.size() ? Value(sum / double(found)) : Value();
}

Means means_over(const Comparison& c, int iteration, const std::vector<Column>& columns,
                 const std::string& benchmark, const std::vector<const ComparedDataset*>& sets) {
    Means means{benchmark, {}, {}, {}, {}};
    for (const ComparedDataset* set : sets) means.names.push_back(set->name);
    for (const Column& column : columns) {
        std::vector<double> sums(c.kernels.size(), 0.0);
        int covered = 0;
        for (const ComparedDataset* set : sets) {
            std::vector<Value> values;
            for (const std::string& kernel : c.kernels)
                values.push_back(over_seeds(*set, kernel, iteration, column).median);
            if (std::count(values.begin(), values.end(), std::nullopt) > 0) continue;
            for (std::size_t i = 0; i < sums.size(); ++i) sums[i] += *values[i];
            ++covered;
        }
        std::vector<Value> of_column, of_paper;
        for (std::size_t i = 0; i < sums.size(); ++i) {
            of_column.push_back(covered > 0 ? Value(sums[i] / covered) : Value());
            of_paper.push_back(paper_mean(means.names, c.kernels[i], iteration, column.json));
        }
        means.values.push_back(std::move(of_column));
        means.paper.push_back(std::move(of_paper));
        means.covered.push_back(covered);
    }
    return means;
}

}  // namespace

std::vector<Means> means_of(const Comparison& c, int iteration,
                            const std::vector<Column>& columns) {
    std::vector<Means> groups;
    std::vector<const ComparedDataset*> all;
    for (const ComparedDataset& dataset : c.datasets) all.push_back(&dataset);
    bool one_benchmark = false;
    for (const std::string_view benchmark : paper_benchmarks()) {
        std::vector<const ComparedDataset*> sets;
        for (const ComparedDataset* dataset : all)
            if (paper_benchmark_of(dataset->name) == benchmark) sets.push_back(dataset);
        one_benchmark |= sets.size() == all.size();
        if (sets.size() > 1)
            groups.push_back(means_over(c, iteration, columns, std::string(benchmark), sets));
    }
    if (all.size() > 1 && !one_benchmark)
        groups.insert(groups.begin(), means_over(c, iteration, columns, "", all));
    return groups;
}

nlohmann::json means_json(const Comparison& c) {
    const auto number = [](const Value& v) {
        return v ? nlohmann::json(*v) : nlohmann::json(nullptr);
    };
    const std::vector<Column>& columns = quality_columns();
    nlohmann::json rows = nlohmann::json::array();
    for (const int iteration : c.iterations)
        for (const Means& m : means_of(c, iteration, columns))
            for (std::size_t k = 0; k < columns.size(); ++k)
                for (std::size_t i = 0; i < c.kernels.size(); ++i)
                    rows.push_back({{"benchmark", m.benchmark},
                                    {"data_sets", m.names},
                                    {"iteration", iteration},
                                    {"kernel", c.kernels[i]},
                                    {"value", columns[k].json},
                                    {"mean", number(m.values[k][i])},
                                    {"covered", m.covered[k]},
                                    {"paper", number(m.paper[k][i])}});
    return rows;
}

}  // namespace darb
