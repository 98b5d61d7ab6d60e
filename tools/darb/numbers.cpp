#include "tools/darb/numbers.h"

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

void refuse_no_numbers(const std::vector<std::string>& arguments) {
    for (const std::string& argument : arguments) {
        const bool option = argument.starts_with("--");
        const size_t equals = option ? argument.find('=') : std::string::npos;
        if (option && equals == std::string::npos) continue;
        std::string value =
            lower(equals == std::string::npos ? argument : argument.substr(equals + 1));
        if (value.starts_with('-') || value.starts_with('+')) value.erase(0, 1);
        if (value == "nan" || value == "inf" || value == "infinity" || beyond_float(value))
            throw Error(argument, "is no number that anything here can take",
                        "Give a finite number; a file of that name as ./" + value + ".");
    }
}

}  // namespace darb
