// Text that goes into a script of an HTML page: data never ends it.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>
#include <string_view>

namespace darb {

/// JSON in ASCII without '<' or '>', fit for a <script> of any type: "</script>", "<!--", marks of
/// direction and line separators are escapes. What is no UTF-8 becomes U+FFFD.
std::string script_json(const nlohmann::json& value);

/// Source without its comment lines ("//" first), blank lines and indentation.
std::string without_comment_lines(std::string_view source);

}  // namespace darb
