// Pieces of HTML text: escaping, embedding, numbers.
#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace darb {

/// & < > " ' as entities: fit for text and for quoted attributes. Control characters become spaces.
std::string html_escape(std::string_view text);

std::string base64(std::span<const std::byte> bytes);

/// v with so many decimals and thousands separated; "-" where v is not finite.
std::string format_number(double v, int decimals = 0);

// The frame of every HTML page of the project: style for bright and dark screens and for print, no
// outside resources.

/// A whole document. title and subtitle are text; body is HTML.
std::string html_page(const std::string& title, const std::string& subtitle,
                      const std::string& body);

/// Names with the colours of classes s0, s1, ...
std::string html_legend(const std::vector<std::string>& names);

/// A value with its name below, as one of a row of cards.
std::string html_card(const std::string& value, const std::string& name);

}  // namespace darb
