#include "tools/darb/options_json.h"

#include <nlohmann/json.hpp>
#include <regex>

#include "tools/darb/help.h"

namespace darb {

namespace {

// "TEXT:{psi,exact}", as CLI11 describes a value that must be one of some.
nlohmann::json choices_of(const CLI::Option& option) {
    nlohmann::json choices = nlohmann::json::array();
    const std::string type = option.get_type_name();
    std::smatch found;
    static const std::regex kSet(R"(\{([^{}]*)\})");
    if (!std::regex_search(type, found, kSet)) return choices;
    for (const std::string& one : CLI::detail::split(found[1].str(), ',')) choices.push_back(one);
    return choices;
}

nlohmann::json option_json(const CLI::Option& option) {
    nlohmann::json names = nlohmann::json::array();
    for (const std::string& name : option.get_snames()) names.push_back("-" + name);
    for (const std::string& name : option.get_lnames()) names.push_back("--" + name);
    return {{"names", names},
            {"positional", option.get_positional() ? option.get_name(true) : ""},
            {"required", option.get_required()},
            {"takes_value", option.get_items_expected_max() > 0},
            {"choices", choices_of(option)},
            {"default", option.get_default_str()},
            {"help", option.get_description()},
            {"group", option.get_group()}};
}

nlohmann::json options_of(const CLI::App& app) {
    nlohmann::json options = nlohmann::json::array();
    for (const bool few : {false, true})  // those of many users first
        for (const CLI::Option* option : app.get_options())
            if (!option->get_group().empty() && is_for_few(option->get_group()) == few)
                options.push_back(option_json(*option));
    return options;
}

}  // namespace

std::string options_json(const CLI::App& app) {
    nlohmann::json commands = nlohmann::json::array();
    for (const CLI::App* one : app.get_subcommands({}))
        commands.push_back({{"name", one->get_name()},
                            {"help", one->get_description()},
                            {"group", one->get_group()},
                            {"options", options_of(*one)}});
    const nlohmann::json all = {{"version", DARB_VERSION},
                                {"help", app.get_description()},
                                {"options", options_of(app)},
                                {"commands", commands}};
    return all.dump(1) + "\n";
}

}  // namespace darb
