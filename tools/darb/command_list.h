// SPDX-License-Identifier: MIT
// The subcommands of darb: each adds itself to the command line and leaves the action to run.
#pragma once

#include <CLI/CLI.hpp>
#include <functional>
#include <string>
#include <vector>

namespace darb {

/// The body of the chosen subcommand; returns the exit code.
using Action = std::function<int()>;

/// `darb train` also looks at the words as they were typed.
void add_train(CLI::App& app, Action& action, const std::vector<std::string>& arguments);

#ifdef DARB_HAS_VIEWER
#define DARB_VIEW_COMMAND(ROW) ROW(view, "Scenes")
#else
#define DARB_VIEW_COMMAND(ROW)
#endif

/// The other commands: the name, which is also that of the file, and the heading in `darb --help`.
#define DARB_COMMANDS(ROW)  \
    ROW(eval, "Scenes")     \
    ROW(render, "Scenes")   \
    DARB_VIEW_COMMAND(ROW)  \
    ROW(convert, "Scenes")  \
    ROW(edit, "Scenes")     \
    ROW(mesh, "Scenes")     \
    ROW(clean, "Scenes")    \
    ROW(info, "Insight")    \
    ROW(plan, "Insight")    \
    ROW(devices, "Insight") \
    ROW(cost, "Insight")    \
    ROW(bench, "Insight")   \
    ROW(check, "Insight")   \
    ROW(compare, "Paper")   \
    ROW(psi, "Paper")       \
    ROW(sim1d, "Paper")

#define DARB_COMMAND_ADDED(name, heading) void add_##name(CLI::App& app, Action& action);
DARB_COMMANDS(DARB_COMMAND_ADDED)
#undef DARB_COMMAND_ADDED

}  // namespace darb
