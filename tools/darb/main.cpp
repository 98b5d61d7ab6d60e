// SPDX-License-Identifier: MIT
// darb: train, render and measure splat scenes. Exit codes: 0 done; 1 internal error; 2 bad usage
// or input, or a refusal of the system (a full disk); 128 plus its number where a signal ended a
// run that was saved.

#include <fmt/format.h>

#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <exception>
#include <filesystem>
#include <new>
#include <sstream>
#include <string>
#include <system_error>
#include <vector>

#include "engine/core/error.h"
#include "engine/core/say.h"
#include "engine/core/system.h"
#include "engine/ranks/ranks.h"
#include "tools/darb/command_list.h"
#include "tools/darb/flags.h"
#include "tools/darb/help.h"

namespace {

std::string with_mpi() {
    const std::string name = darb::mpi_name();
    return name.empty() ? "\nwithout MPI: on one machine alone" : "\nwith " + name;
}

// 3DGS spells options with underscores, which mean the same as dashes here.
std::vector<std::string> with_dashes(std::vector<std::string> arguments) {
    for (std::string& argument : arguments) {
        if (argument.rfind("--", 0) != 0) continue;
        const size_t end = std::min(argument.find_first_of("= "), argument.size());
        for (size_t i = 2; i < end; ++i)
            if (argument[i] == '_') argument[i] = '-';
    }
    return arguments;
}

// A value that begins with a minus would be read as an option: "--effects -sh" becomes
// "--effects=-sh".
void join_effects(std::vector<std::string>& arguments) {
    for (size_t i = 0; i + 1 < arguments.size(); ++i) {
        const std::string& value = arguments[i + 1];
        if (arguments[i] != "--effects" || value.size() < 3 || value[0] != '-' || value[1] == '-')
            continue;
        arguments[i] += "=" + value;
        arguments.erase(arguments.begin() + static_cast<std::ptrdiff_t>(i + 1));
    }
}

void add_commands(CLI::App& app, darb::Action& action, const std::vector<std::string>& arguments) {
    darb::add_train(app, action, arguments);
    app.get_subcommand("train")->group("Scenes");
#define DARB_ADD_COMMAND(name, heading) \
    darb::add_##name(app, action);      \
    app.get_subcommand(#name)->group(heading);
    DARB_COMMANDS(DARB_ADD_COMMAND)
#undef DARB_ADD_COMMAND
}

// Shows help, or the version.
int show_help(const CLI::App& app, const CLI::ParseError& asked) {
    std::ostringstream text;
    const int code = app.exit(asked, text, text);
    darb::tell_text(text.str());
    return code;
}

int run(const std::vector<std::string>& words) {
    std::vector<std::string> arguments = with_dashes({words.begin() + 1, words.end()});
    join_effects(arguments);
    darb::refuse_empty_values(arguments);
    CLI::App app(
        "Train, render and measure 3D splat scenes with a choice of kernel, on any Vulkan device.",
        "darb");
    app.set_version_flag("--version", std::string("darb ") + DARB_VERSION + with_mpi());
    app.require_subcommand(1);
    app.formatter(darb::make_help_formatter());
    app.set_help_flag("-h,--help", "this help, without rarely used options");
    app.set_help_all_flag("--help-all", "this help, with every option");
    darb::Action action;
    add_commands(app, action, arguments);
    if (arguments == std::vector<std::string>{"--options-json"}) {
        darb::tell_text(darb::options_json(app));
        return 0;
    }
    if (!arguments.empty() && !arguments[0].starts_with('-') &&
        app.get_subcommands([&](CLI::App* one) { return one->check_name(arguments[0]); }).empty())
        throw darb::unknown_command(app, arguments[0]);
    try {
        app.parse(std::vector<std::string>(arguments.rbegin(), arguments.rend()));
    } catch (const CLI::ParseError& e) {
        if (e.get_exit_code() == 0) return show_help(app, e);
        throw darb::usage_error(app, e);
    }
    darb::refuse_no_numbers(app);
    return action();
}

// The error is about the output where the file behind stdout failed, otherwise about a thread that
// did not start.
int report(const std::system_error& e) {
    const bool output = std::ferror(stdout) != 0;
    darb::say("error: {}: {}\n  {}\n", output ? "standard output" : "darb", e.code().message(),
              output ? "Free space, or send the output elsewhere."
                     : "The limits of this system are reached: close other programs.");
    return 2;
}

}  // namespace

int main(int argc, char** argv) {
    const std::vector<std::string> words = darb::command_words(argc, argv);
    darb::keep_standard_descriptors();
    darb::fail_at_the_file_limit();
    darb::go_on_without_readers();
    try {
        const int code = run(words);
        darb::tell_text("");  // writes what is left in the buffer
        return code;
    } catch (const darb::Error& e) {
        darb::say("error: {}\n", e.what());
        return 2;
    } catch (const std::filesystem::filesystem_error& e) {
        darb::say("error: {}: {}\n  Check the path and its permissions.\n",
                  e.path1().empty() ? "a path" : e.path1().string(), e.code().message());
        return 2;
    } catch (const std::system_error& e) {
        return report(e);
    } catch (const std::bad_alloc&) {
        darb::say(
            "error: darb {}: no memory is left\n  Close other programs, or give it less work.\n",
            words.size() > 1 ? words[1] : "");
        return 2;
    } catch (const std::exception& e) {
        darb::say("internal error: {}\n", e.what());
        return 1;
    }
}
