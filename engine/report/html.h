// SPDX-License-Identifier: MIT
// Pieces of HTML text: escaping, embedding, numbers.
#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace darb {

/// Replaces & < > " ' by entities, for text and quoted attributes; control characters become
/// spaces.
std::string html_escape(std::string_view text);

std::string base64(std::span<const std::byte> bytes);

/// The number with `decimals` decimals and separated thousands; "-" where v is not finite.
std::string format_number(double v, int decimals = 0);

// The frame of every HTML page of the project: a style for light and dark screens and for print,
// with no external resources.

/// A whole document. title and subtitle are plain text; body is HTML.
std::string html_page(const std::string& title, const std::string& subtitle,
                      const std::string& body);

/// Names with the colours of classes s0, s1, ...
std::string html_legend(const std::vector<std::string>& names);

/// A card with a value above its name.
std::string html_card(const std::string& value, const std::string& name);

}  // namespace darb
