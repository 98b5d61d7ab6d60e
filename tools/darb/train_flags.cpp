// SPDX-License-Identifier: MIT
#include "tools/darb/train_flags.h"

#include <fmt/format.h>

#include <cstdint>
#include <utility>

#include "engine/core/error.h"
#include "tools/darb/outputs.h"
#include "tools/darb/tune_flags.h"

namespace darb {

namespace {

struct Removed {
    const char* flags;
    const char* reason;
    const char* instead;
};

constexpr Removed kRemoved[] = {
    {"--position-lr-falls", "is no longer an option",
     "It follows from --average-from: 1 lets the rate fall for the whole run, as 3DGS does."},
    {"--final-lr-share", "is no longer an option",
     "It follows from --average-from: rates stay in a run that ends with a mean, and fall in one "
     "that does not."},
    {"--opacity-decay", "is no longer an option",
     "The strategy budget is adc, steered to a number: it resets opacities as adc does."},
};

// Options that no longer exist are hidden flags whose Error says what replaced them.
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

void add_row(CLI::App& command, const RequestOption& option, GivenOptions& given) {
    const OptionRow& row = option.row;
    const std::string name = option_name(row);
    if (row.is_switch) {
        command
            .add_flag_function(
                row.flags,
                [name, &given](std::int64_t count) {
                    given.emplace_back(name, count > 0 ? "on" : "off");
                },
                row.help)
            ->group(row.group);
        return;
    }
    CLI::Option* added = nullptr;
    if (option.several)
        added = command.add_option_function<std::vector<std::string>>(
            row.flags,
            [name, &given](const std::vector<std::string>& values) {
                for (const std::string& value : values) given.emplace_back(name, value);
            },
            row.help);
    else
        added = command.add_option_function<std::string>(
            row.flags,
            [name, &given](const std::string& value) { given.emplace_back(name, value); },
            row.help);
    added->default_str(default_text(row))->group(row.group);
    if (*option.words != '\0') added->type_name(fmt::format("TEXT:{{{}}}", option.words));
    if (option.before_others) added->allow_extra_args(false);
}

// How the command shows its run, in addition to the rows, which come first in the help.
void add_own_flags(CLI::App& command, const std::string& behind, TrainFlags& f) {
    if (behind == "--resume") {
        command.add_flag("--view", f.shown.view, "watch the run; closing the window lets it go on")
            ->group(option_group::kRun);
        add_quiet_flag(command, f.shown.quiet)->group(option_group::kRun);
    } else if (behind == "--allow-mixed") {
        command.add_flag("--verbose", f.shown.verbose, "print the time of each pass at the end")
            ->group(option_group::kDevice);
    } else if (behind == "--tune") {
        add_retune_flag(command, f.retune);
    }
}

}  // namespace

void add_train_flags(CLI::App& command, TrainFlags& f) {
    for (const RequestOption& option : request_options()) {
        if (*option.row.flags == '\0') continue;
        add_row(command, option, f.given);
        add_own_flags(command, option_name(option.row), f);
    }
    command.add_flag("--deterministic", f.deterministic)->group("");
    add_removed_options(command);
    command.parse_complete_callback([&f] { set_request_options(f.request, f.given); });
}

TrainRequest parse_train_words(std::vector<std::string> words, const std::string& options,
                               const std::string& command) {
    words.insert(words.begin(), "train");
    for (const std::string& word : CLI::detail::split_up(options)) words.push_back(word);
    TrainFlags f;
    CLI::App app;
    add_train_flags(*app.add_subcommand("train"), f);
    try {
        app.parse(std::vector<std::string>(words.rbegin(), words.rend()));
    } catch (const CLI::ParseError& e) {
        throw Error(command, e.what(), "`darb train --help` lists what --train-options takes.");
    }
    for (const char* own : {"--blocks", "--tune"})
        if (was_given(f.request, own))
            throw Error(command + " " + own, "is an option of darb train alone", "Leave it out.");
    complete_request(f.request);
    return std::move(f.request);
}

}  // namespace darb
