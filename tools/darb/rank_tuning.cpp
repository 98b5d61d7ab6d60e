#include "tools/darb/rank_tuning.h"

#include <span>
#include <string>
#include <string_view>

#include "engine/plan/tuning_names.h"

namespace darb {

void take_tuning_of_first(Ranks& ranks, Device& device, bool keeps_own) {
    if (ranks.count() == 1) return;
    const std::string own = names_text(tuning_names(device.tuning()));
    const Bytes first = from_first(ranks, std::as_bytes(std::span(own)));
    if (keeps_own) return;
    const std::string_view names(reinterpret_cast<const char*>(first.data()), first.size());
    device.set_tuning(resumed_tuning(device.info(), device.tuning(), names, "tuning of rank 0"));
}

}  // namespace darb
