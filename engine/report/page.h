// The frame of every HTML page of the project: style for bright and dark screens and for print, no
// outside resources.
#pragma once

#include <string>
#include <vector>

namespace darb {

/// A whole document. title and subtitle are text; body is HTML.
std::string html_page(const std::string& title, const std::string& subtitle,
                      const std::string& body);

/// Names with the colours of classes s0, s1, ...
std::string html_legend(const std::vector<std::string>& names);

/// A value with its name below, as one of a row of cards.
std::string html_card(const std::string& value, const std::string& name);

}  // namespace darb
