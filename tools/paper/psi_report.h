// The results of `darb psi` as a table, as JSON and as a page of plots.
#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "tools/paper/kernel_fits.h"
#include "tools/paper/psi_measure.h"

namespace darb {

std::string psi_table(const std::vector<PsiResult>& results);
nlohmann::json psi_json(const std::vector<PsiResult>& results, const PsiGridOptions& options);
/// kernels and fits: those of the results, in their order.
std::string psi_html(const std::vector<PsiResult>& results,
                     const std::vector<const DerivedKernel*>& kernels,
                     const std::vector<KernelFit>& fits, const PsiGridOptions& options);

}  // namespace darb
