// The subcommands of darb: each adds itself to the command line and leaves what to run.
#pragma once

#include <CLI/CLI.hpp>
#include <functional>
#include <string>
#include <vector>

namespace darb {

/// The chosen subcommand's body; returns the exit code.
using Action = std::function<int()>;

void add_train(CLI::App& app, Action& action, const std::vector<std::string>& arguments);
void add_eval(CLI::App& app, Action& action);
void add_render(CLI::App& app, Action& action);
void add_view(CLI::App& app, Action& action);
void add_cost(CLI::App& app, Action& action);
void add_bench(CLI::App& app, Action& action);
void add_plan(CLI::App& app, Action& action);
void add_info(CLI::App& app, Action& action);
void add_convert(CLI::App& app, Action& action);
void add_devices(CLI::App& app, Action& action);
void add_psi(CLI::App& app, Action& action);
void add_sim1d(CLI::App& app, Action& action);
void add_compare(CLI::App& app, Action& action);
void add_check(CLI::App& app, Action& action);

}  // namespace darb
