// The one table of tolerances of the tests and of `darb check`, by name and with reasons.
#pragma once

#include <limits>
#include <string_view>

namespace darb::reference {

struct Tolerance {
    std::string_view name{};
    // A value fails where |got - expected| > abs + rel |expected|, or where got is not finite.
    double abs = 0;
    double rel = 0;
    double max_fail_ratio = 0;  // of the values; for boundary bands only, which are counted
    double min_cosine = -1;     // between all expected and all got values as two vectors
    // |sum(got - expected)| / sum |expected|: rounding is unbiased, a mistake seldom is.
    double max_signed_bias = std::numeric_limits<double>::infinity();
    std::string_view reason{};
};

/// The row of that name; aborts on an unknown one.
const Tolerance& tolerance(std::string_view name);

}  // namespace darb::reference
