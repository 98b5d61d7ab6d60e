#include "tools/darb/tune_flags.h"

#include <fmt/format.h>

#include <cstdlib>

#include "engine/plan/tuner.h"
#include "tools/darb/help.h"
#include "tools/darb/outputs.h"
#include "tools/darb/user_folders.h"

namespace darb {

void add_tune_flags(CLI::App& command, TuneFlags& flags) {
    command
        .add_option("--tune", flags.choice,
                    "run passes in these ways, such as blend=128x2,backward=buckets; an "
                    "unknown name lists those of the device")
        ->group(help_group::kDevice);
    command
        .add_flag("--retune", flags.retune,
                  "measure which ways are the fastest on this device, and keep the result")
        ->group(help_group::kDevice);
}

void settle_tuning(Device& device, const TuneFlags& flags) {
    const char* environment = std::getenv("DARB_TUNE");
    tune(device, {flags.choice, environment != nullptr ? environment : "", flags.retune, say_note});
}

std::string tuning_of_listed(const DeviceInfo& info) {
    if (const auto record = read_tuning(info, cache_folder()))
        return "measured: " + tuning_text(*record);
    const std::string usual = names_text(tuning_names(usual_tuning(info)));
    return usual + (is_known_device(info) ? " (known; --retune measures)"
                                          : " (to be measured at the first use)");
}

}  // namespace darb
