#include "tools/darb/option_flags.h"

#include <fmt/format.h>

#include <cstdint>

#include "engine/core/error.h"

namespace darb {

namespace {

struct Removed {
    const char* flags;
    const char* reason;
    const char* instead;
};

constexpr Removed kRemoved[] = {
    {"--position-lr-falls", "is no option any more",
     "It follows from --average-from: 1 lets the rate fall for the whole run, as 3DGS does."},
    {"--final-lr-share", "is no option any more",
     "It follows from --average-from: rates stay in a run that ends with a mean, and fall in one "
     "that does not."},
    {"--opacity-decay", "is no option any more",
     "The strategy budget is adc, steered to a number: it resets opacities as adc does."},
};

}  // namespace

void add_option_rows(CLI::App& command, TrainOptions& options, GivenOfStrategies& given) {
    for (const OptionRow& row : option_rows()) {
        if (*row.flags == '\0') continue;
        const std::string help = fmt::format("{} [{}]", row.help, default_text(row));
        if (row.is_switch) {
            command
                .add_flag_function(
                    row.flags,
                    [&row, &options](std::int64_t count) {
                        set_option(row, count > 0 ? "on" : "off", options);
                    },
                    row.help)
                ->group(row.group);
            continue;
        }
        command
            .add_option_function<std::string>(
                row.flags,
                [&row, &options, &given](const std::string& text) {
                    set_option(row, text, options);
                    if (*row.strategies != '\0')
                        given.emplace_back(option_name(row), row.strategies);
                },
                help)
            ->group(row.group);
    }
}

void add_removed_options(CLI::App& command) {
    for (const Removed& one : kRemoved)
        command
            .add_option_function<std::string>(one.flags,
                                              [&one](const std::string&) {
                                                  const std::string flags = one.flags;
                                                  throw Error(flags.substr(0, flags.find(',')),
                                                              one.reason, one.instead);
                                              })
            ->expected(0, 1)
            ->group("");
}

}  // namespace darb
