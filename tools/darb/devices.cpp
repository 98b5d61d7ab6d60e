// SPDX-License-Identifier: MIT
#include "tools/darb/devices.h"

#include <fmt/format.h>

#include <memory>

#include "engine/core/error.h"
#include "engine/core/say.h"
#include "engine/gpu/device.h"
#include "engine/ranks/ranks.h"
#include "tools/bench/bench_step.h"
#include "tools/darb/command_list.h"
#include "tools/darb/outputs.h"
#include "tools/darb/tune_flags.h"

namespace darb {

namespace {

std::string mebibytes(std::uint64_t bytes) {
    if (bytes >= std::uint64_t{10} << 30)
        return fmt::format("{:.0f} GiB", static_cast<double>(bytes) / (1 << 30));
    return fmt::format("{:.0f} MiB", static_cast<double>(bytes) / (1 << 20));
}

std::string subgroups(const DeviceInfo& info) {
    if (info.min_subgroup_size == info.max_subgroup_size)
        return fmt::format("{}", info.subgroup_size);
    return fmt::format("{} ({} to {})", info.subgroup_size, info.min_subgroup_size,
                       info.max_subgroup_size);
}

void print_device(std::FILE* out, const DeviceInfo& info, bool chosen) {
    tell(out, "{} {}  {}\n", chosen ? '*' : ' ', info.index, info.name);
    const auto row = [&](const char* label, const std::string& value) {
        tell(out, "       {:<19}{}\n", label, value);
    };
    row("type", info.type + (info.unified_memory ? ", memory shared with the host" : ""));
    row("driver",
        fmt::format("{}, Vulkan {}.{}.{}", info.driver, VK_API_VERSION_MAJOR(info.api_version),
                    VK_API_VERSION_MINOR(info.api_version),
                    VK_API_VERSION_PATCH(info.api_version)));
    row("memory", mebibytes(info.heap_bytes));
    row("largest allocation", mebibytes(info.max_allocation_bytes));
    row("largest binding", mebibytes(info.max_storage_buffer_bytes));
    row("subgroup size", subgroups(info));
    row("workgroup", fmt::format("{} threads, {} KiB shared memory", info.max_workgroup_threads,
                                 info.shared_memory_bytes / 1024));
    row("float atomics", info.float_atomics ? "yes" : "no");
    row("half arithmetic", info.half_arithmetic ? "yes" : "no");
    row("timestamps",
        info.timestamp_period_ns > 0 ? fmt::format("every {} ns", info.timestamp_period_ns) : "no");
    if (info.usable) row("passes", tuning_of_listed(info));
    row("status", info.reason);
}

}  // namespace

void require_timestamps(const Device& device) {
    if (device.info().timestamp_period_ns > 0) return;
    throw Error(device.info().name, "has no timestamps", "Choose another device (darb devices).");
}

void print_devices(std::FILE* out, const std::string& select) {
    const std::vector<DeviceInfo> devices = list_devices();
    const std::size_t chosen = choose_device(devices, select);
    for (const DeviceInfo& info : devices) print_device(out, info, &info == &devices[chosen]);
    const char* why = !select.empty() ? "asked for with --device"
                      : devices.size() > 1
                          ? "the best usable one: discrete before integrated before "
                            "virtual before cpu, then the largest memory"
                          : "the only one";
    tell(out, "\nchosen: {} {} ({})\n", devices[chosen].index, devices[chosen].name, why);
    const std::string mpi = mpi_name();
    tell(out, "several machines: {}\n",
         mpi.empty() ? "no, built without MPI" : mpi + ", by mpirun");
}

void add_devices(CLI::App& app, Action& action) {
    struct Flags {
        std::string select;
        std::filesystem::path json;
        bool passes = false, quiet = false;
    };
    auto flags = std::make_shared<Flags>();
    CLI::App* command = app.add_subcommand("devices", "List the Vulkan devices and their limits");
    command->add_option("--device", flags->select,
                        "show which device this number or part of a name would choose");
    add_quiet_flag(*command, flags->quiet);
    CLI::Option* passes = command->add_flag(
        "--passes", flags->passes,
        "compile every pass for the chosen device and print what its compiler reports: registers, "
        "spills, occupancy, instructions; nothing is executed");
    add_json_option(*command, flags->json)->needs(passes);
    command->callback([flags, &action] {
        action = [flags] {
            if (!flags->passes) {
                print_devices(flags->quiet ? nullptr : stdout, flags->select);
                return 0;
            }
            const PassStatistics statistics = compile_every_pass(flags->select);
            print_pass_statistics(stream_beside_json(flags->json, flags->quiet), statistics);
            write_json(flags->json, pass_statistics_json(statistics));
            tell_paths(flags->quiet, {flags->json});
            return 0;
        };
    });
}

}  // namespace darb
