#include "tools/darb/numbers.h"

#include <fmt/format.h>

#include <cmath>
#include <cstdlib>
#include <limits>

#include "engine/core/error.h"
#include "engine/core/text.h"

namespace darb {

namespace {

// Whether all of it is a number that float32 holds as infinity.
bool beyond_float(const std::string& value) {
    char* end = nullptr;
    const double number = std::strtod(value.c_str(), &end);
    return end != value.c_str() && *end == '\0' &&
           std::abs(number) > std::numeric_limits<float>::max();
}

}  // namespace

void refuse_empty_values(const std::vector<std::string>& arguments) {
    for (size_t i = 0; i < arguments.size(); ++i) {
        const std::string& argument = arguments[i];
        const bool ends_empty = argument.starts_with("--") && argument.ends_with('=');
        if (ends_empty || (argument.empty() && i > 0 && arguments[i - 1].starts_with('-')))
            throw Error(ends_empty ? argument.substr(0, argument.size() - 1) : arguments[i - 1],
                        "has an empty value", "Give a value, or leave the option out.");
    }
}

namespace {

// What CLI11 itself makes a number of; options that are text to it read their numbers on their own.
bool is_number(const CLI::Option& option) {
    const std::string type = option.get_type_name();
    return type.starts_with("FLOAT") || type.starts_with("INT") || type.starts_with("UINT");
}

// A check that a number is above 0, or 0 where zero says so.
CLI::Validator number_from(bool zero, const std::string& name) {
    return CLI::Validator(
        [zero](const std::string& given) {
            char* end = nullptr;
            const double number = std::strtod(given.c_str(), &end);
            const bool whole = end != given.c_str() && *end == '\0';
            if (whole && (number > 0 || (zero && number == 0) || std::isnan(number)))
                return std::string();
            return fmt::format("{} is not a number {}", given, zero ? "of at least 0" : "above 0");
        },
        name);
}

}  // namespace

CLI::Validator above_zero() {
    return number_from(false, "POSITIVE");
}

CLI::Validator zero_or_more() {
    return number_from(true, "NONNEGATIVE");
}

void refuse_no_numbers(const CLI::App& app) {
    for (const CLI::Option* option : app.get_options()) {
        if (!is_number(*option)) continue;
        for (const std::string& given : option->results()) {
            std::string value = lower(given);
            if (value.starts_with('-') || value.starts_with('+')) value.erase(0, 1);
            if (value == "nan" || value == "inf" || value == "infinity" || beyond_float(value))
                throw Error(option->get_name() + " " + given, "is no number that it can take",
                            "Give a finite number.");
        }
    }
    for (const CLI::App* command : app.get_subcommands()) refuse_no_numbers(*command);
}

}  // namespace darb
