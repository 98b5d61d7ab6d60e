#include "tools/darb/bench_growth.h"

#include <fmt/format.h>

#include "engine/core/error.h"
#include "engine/core/files.h"
#include "engine/core/say.h"
#include "tools/darb/json_output.h"

namespace darb {

void add_growth_flags(CLI::App& command, GrowthFlags& flags) {
    command.add_flag(
        "--growth", flags.on,
        "time against splats, pixels and intersections instead, with fitted exponents");
    command.add_option("--most-splats", flags.plan.most_splats, "of --growth")
        ->capture_default_str()
        ->check(CLI::Range(1'000u, 100'000'000u));
    command.add_option("--html", flags.html, "write the plots of --growth to this page");
}

void check_growth(const GrowthFlags& flags, const std::string& filter) {
    if (flags.on && !filter.empty())
        throw Error("darb bench --growth " + filter, "--growth measures no cases",
                    "Leave one of them out.");
    if (!flags.on && !flags.html.empty())
        throw Error("darb bench --html", "the page is that of --growth", "Add --growth.");
}

void bench_growth(Device& device, const GrowthFlags& flags, const nlohmann::json& context,
                  const std::filesystem::path& json, bool quiet,
                  const std::function<void(const std::string&)>& progress) {
    const std::vector<GrowthCurve> curves = measure_growth(device, flags.plan, progress);
    write_json(json, {{"context", context}, {"growth", growth_json(curves)}});
    if (!flags.html.empty()) write_file_atomic(flags.html, growth_html(curves, context));
    tell(stream_beside_json(json, quiet), "{}", growth_table(curves));
}

}  // namespace darb
