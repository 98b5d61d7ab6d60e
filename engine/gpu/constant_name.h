// SPDX-License-Identifier: MIT
// Names of specialization constants. The build collects them from the shaders, so that a misspelt
// one does not compile.
#pragma once

#include <compare>
#include <cstddef>
#include <string_view>

#include <darb_constant_names.h>

namespace darb {

/// The name of a specialization constant that a shader declares. Made of a literal, which is
/// checked while compiling.
class ConstantName {
  public:
    template <std::size_t n>
    consteval ConstantName(const char (&name)[n])
        : text_(declared(std::string_view(name, n - 1))) {}  // implicit, as SpecValue
    constexpr std::string_view text() const { return text_; }
    auto operator<=>(const ConstantName&) const = default;

  private:
    static consteval std::string_view declared(std::string_view name) {
        for (const std::string_view known : kConstantNames)
            if (known == name) return known;
        throw "no shader declares a specialization constant of this name";
    }
    std::string_view text_;
};

}  // namespace darb
