// SPDX-License-Identifier: MIT
#include "tools/darb/tune_flags.h"

#include "engine/core/user_folders.h"
#include "trainer/job/request_options.h"

namespace darb {

void add_tune_flags(CLI::App& command, TuneFlags& flags) {
    const OptionRow& row = request_option("--tune").row;
    command.add_option(row.flags, flags.choice, row.help)->group(row.group);
    add_retune_flag(command, flags.retune);
}

void add_retune_flag(CLI::App& command, bool& retune) {
    command
        .add_flag("--retune", retune,
                  "measure which ways are the fastest on this device, and keep the result")
        ->group(option_group::kDevice);
}

std::string tuning_of_listed(const DeviceInfo& info) {
    if (const auto record = read_tuning(info, cache_folder()))
        return "measured: " + tuning_text(*record);
    const std::string usual = names_text(tuning_names(usual_tuning(info)));
    return usual + (is_known_device(info) ? " (known; --retune measures)"
                                          : " (to be measured at the first use)");
}

}  // namespace darb
