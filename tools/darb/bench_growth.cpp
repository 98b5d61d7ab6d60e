#include "tools/darb/bench_growth.h"

#include <fmt/format.h>

#include "engine/core/files.h"
#include "tools/darb/cost_flags.h"

namespace darb {

void bench_growth(Device& device, const GrowthFlags& flags, const nlohmann::json& context,
                  const std::filesystem::path& json,
                  const std::function<void(const std::string&)>& progress) {
    const std::vector<GrowthCurve> curves = measure_growth(device, flags.plan, progress);
    fmt::print("{}", growth_table(curves));
    write_json(json, {{"context", context}, {"growth", growth_json(curves)}});
    if (!flags.html.empty()) write_file_atomic(flags.html, growth_html(curves, context));
}

}  // namespace darb
