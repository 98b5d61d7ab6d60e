// darb: train, render and measure splat scenes. Exit codes: 0 done, 1 internal error, 2 bad usage
// or input.

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <exception>
#include <filesystem>
#include <limits>
#include <sstream>
#include <string>
#include <vector>

#include "engine/core/error.h"
#include "engine/core/text.h"
#include "tools/darb/commands.h"

namespace {

// 3DGS spells options with underscores; here they are the same as dashes.
std::vector<std::string> with_dashes(int argc, char** argv) {
    std::vector<std::string> arguments(argv + 1, argv + argc);
    for (std::string& argument : arguments) {
        if (argument.rfind("--", 0) != 0) continue;
        const size_t end = std::min(argument.find_first_of("= "), argument.size());
        for (size_t i = 2; i < end; ++i)
            if (argument[i] == '_') argument[i] = '-';
    }
    return arguments;
}

// Whether all of it is a number that float32 holds as infinity.
bool beyond_float(const std::string& value) {
    char* end = nullptr;
    const double number = std::strtod(value.c_str(), &end);
    return end != value.c_str() && *end == '\0' &&
           std::abs(number) > std::numeric_limits<float>::max();
}

// The parser takes these for numbers, and lets them through every limit.
void refuse_no_numbers(const std::vector<std::string>& arguments) {
    for (const std::string& argument : arguments) {
        const bool option = argument.starts_with("--");
        const size_t equals = option ? argument.find('=') : std::string::npos;
        if (option && equals == std::string::npos) continue;
        std::string value =
            darb::lower(equals == std::string::npos ? argument : argument.substr(equals + 1));
        if (value.starts_with('-') || value.starts_with('+')) value.erase(0, 1);
        if (value == "nan" || value == "inf" || value == "infinity" || beyond_float(value))
            throw darb::Error(argument, "is no number that anything here can take",
                              "Give a finite number; a file of that name as ./" + value + ".");
    }
}

// A value that begins with a minus reads like an option: "--effects -sh" becomes "--effects=-sh".
void join_effects(std::vector<std::string>& arguments) {
    for (size_t i = 0; i + 1 < arguments.size(); ++i) {
        const std::string& value = arguments[i + 1];
        if (arguments[i] != "--effects" || value.size() < 3 || value[0] != '-' || value[1] == '-')
            continue;
        arguments[i] += "=" + value;
        arguments.erase(arguments.begin() + static_cast<std::ptrdiff_t>(i + 1));
    }
}

int run(int argc, char** argv) {
    std::vector<std::string> arguments = with_dashes(argc, argv);
    join_effects(arguments);
    refuse_no_numbers(arguments);
    CLI::App app(
        "Train, render and measure 3D splat scenes with a choice of kernel, on any Vulkan device.",
        "darb");
    app.set_version_flag("--version", std::string("darb ") + DARB_VERSION);
    app.require_subcommand(1);
    darb::Action action;
    darb::add_train(app, action, arguments);
    darb::add_eval(app, action);
    darb::add_render(app, action);
#ifdef DARB_HAS_VIEWER
    darb::add_view(app, action);
#endif
    darb::add_cost(app, action);
    darb::add_bench(app, action);
    darb::add_plan(app, action);
    darb::add_info(app, action);
    darb::add_convert(app, action);
    darb::add_devices(app, action);
    darb::add_compare(app, action);
    darb::add_psi(app, action);
    darb::add_sim1d(app, action);
    darb::add_check(app, action);
    if (!arguments.empty() && !arguments[0].starts_with('-') &&
        app.get_subcommands([&](CLI::App* one) { return one->check_name(arguments[0]); }).empty())
        throw darb::Error("darb " + arguments[0], "no such subcommand", "darb --help lists them.");
    try {
        app.parse(std::vector<std::string>(arguments.rbegin(), arguments.rend()));
    } catch (const CLI::ParseError& e) {
        std::ostringstream out, err;  // the arguments that it repeats may steer a terminal
        const int code = app.exit(e, out, err);
        fmt::print("{}", out.str());
        fmt::print(stderr, "{}", darb::printable(err.str(), true));
        return code == 0 ? 0 : 2;
    }
    return action();
}

}  // namespace

int main(int argc, char** argv) {
    try {
        return run(argc, argv);
    } catch (const darb::Error& e) {
        fmt::print(stderr, "error: {}\n", darb::printable(e.what(), true));
        return 2;
    } catch (const std::filesystem::filesystem_error& e) {
        fmt::print(stderr, "error: {}: {}\n  Check the path and its permissions.\n",
                   e.path1().empty() ? "a path" : darb::printable(e.path1().string()),
                   e.code().message());
        return 2;
    } catch (const std::exception& e) {
        fmt::print(stderr, "internal error: {}\n", darb::printable(e.what(), true));
        return 1;
    }
}
