// Pieces of HTML text: escaping, embedding, numbers.
#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <string_view>

namespace darb {

/// & < > " ' as entities: fit for text and for quoted attributes. Control characters become spaces.
std::string html_escape(std::string_view text);

std::string base64(std::span<const std::byte> bytes);

/// v with so many decimals and thousands separated; "-" where v is not finite.
std::string format_number(double v, int decimals = 0);

}  // namespace darb
