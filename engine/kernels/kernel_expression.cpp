// SPDX-License-Identifier: MIT
#include "engine/kernels/kernel_expression.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <optional>

#include "engine/core/error.h"
#include "engine/kernels/kernel_registry.h"
#include "engine/kernels/shaped_kernel.h"
#ifdef DARB_MUPARSER
#include <muParser.h>
#endif

namespace darb {
namespace {

constexpr std::string_view kBlanks = " \t\r\n", kMark = "expr:";
constexpr const char* kHelp =
    "docs/kernels.md has the grammar: expr: EXPRESSION in q, support NUMBER, name NAME";

/// A part of the given text, and its place there.
struct Part {
    std::string text;
    std::size_t at = 0;
};

Part trimmed(std::string_view whole, std::size_t begin, std::size_t end) {
    begin = std::min(whole.find_first_not_of(kBlanks, begin), end);
    while (end > begin && kBlanks.find(whole[end - 1]) != kBlanks.npos) --end;
    return {std::string(whole.substr(begin, end - begin)), begin};
}

std::vector<Part> items_of(std::string_view list) {
    std::vector<Part> items;
    int depth = 0;
    std::size_t begin = 0;
    for (std::size_t i = 0; i <= list.size(); ++i) {
        const char c = i < list.size() ? list[i] : ',';
        depth += c == '(' ? 1 : c == ')' ? -1 : 0;
        if (i < list.size() && (c != ',' || depth > 0)) continue;
        items.push_back(trimmed(list, begin, i));
        begin = i + 1;
    }
    return items;
}

/// What follows the word in "support 9" or "name cubic".
std::optional<Part> behind(std::string_view word, const Part& item) {
    if (!item.text.starts_with(word)) return std::nullopt;
    const std::size_t next = item.text.find_first_not_of(kBlanks, word.size());
    if (next == word.size()) return std::nullopt;
    if (next == std::string::npos) return Part{"", item.at + item.text.size()};
    return Part{item.text.substr(next), item.at + next};
}

/// The text of one kernel, and the name under which errors are reported.
class Source {
  public:
    Source(std::string whole, const std::string& where) : whole_(std::move(whole)), where_(where) {}
    Error error(const Part& part, const std::string& what, const std::string& hint) const {
        return at(part.at, std::max<std::size_t>(part.text.size(), 1), what, hint);
    }
    Error at(std::size_t begin, std::size_t length, const std::string& what,
             const std::string& hint) const {
        return Error(where_, what + with_carets(whole_, begin, length), hint);
    }
    const std::string& whole() const { return whole_; }

  private:
    std::string whole_;
    const std::string& where_;
};

void check_brackets(const Source& source, const Part& part) {
    std::vector<std::size_t> open;
    for (std::size_t i = 0; i < part.text.size(); ++i) {
        if (part.text[i] == '(') open.push_back(i);
        if (part.text[i] != ')') continue;
        if (open.empty()) throw source.at(part.at + i, 1, "a bracket that closes none", kHelp);
        open.pop_back();
    }
    if (!open.empty())
        throw source.at(part.at + open.back(), 1, "a bracket that is never closed", kHelp);
}

void check_letters(const Source& source, const Part& part) {
    for (std::size_t i = 0; i < part.text.size(); ++i) {
        const char c = part.text[i];
        if (c < ' ' || c > '~' || c == '"')
            throw source.at(part.at + i, 1, "no letter of an expression", kHelp);
        if (c != '=') continue;
        const char before = i > 0 ? part.text[i - 1] : ' ';
        const char after = i + 1 < part.text.size() ? part.text[i + 1] : ' ';
        if (after == '=' || std::string_view("=<>!").find(before) != std::string_view::npos)
            continue;
        throw source.at(part.at + i, 1, "an expression assigns nothing", kHelp);
    }
}

#ifdef DARB_MUPARSER

/// An expression in q and d. Not thread-safe.
class Expression {
  public:
    explicit Expression(const std::string& text) {
        parser_.DefineConst("pi", std::numbers::pi);
        parser_.DefineVar("q", &q_);
        parser_.DefineVar("d", &d_);
        parser_.SetExpr(text);
    }
    double operator()(double q) {
        q_ = q;
        d_ = std::sqrt(q);
        return parser_.Eval();
    }
    int results() const { return parser_.GetNumResults(); }

  private:
    double q_ = 0, d_ = 0;
    mu::Parser parser_;
};

Error parse_error(const Source& source, const Part& part, const mu::ParserError& e) {
    std::size_t at = 0, length = 1;
    if (e.GetPos() >= 0) at = std::min(static_cast<std::size_t>(e.GetPos()), part.text.size());
    if (part.text.compare(at, e.GetToken().size(), e.GetToken()) == 0)
        length = std::max<std::size_t>(e.GetToken().size(), 1);
    std::string what = e.GetMsg();
    if (const std::size_t place = what.find(" at position"); place != what.npos)
        what = what.substr(0, place);
    while (!what.empty() && (what.back() == '.' || what.back() == '\n')) what.pop_back();
    return source.at(part.at + at, length, what, kHelp);
}

/// The shortest part of the expression that is not finite at q, which the carets mark.
Part culprit(const Part& part, double q) {
    Part worst = part;
    const std::size_t n = std::min<std::size_t>(part.text.size(), 120);  // n^2 short parses
    for (std::size_t begin = 0; begin < n; ++begin)
        for (std::size_t length = 1; begin + length <= n && length < worst.text.size(); ++length)
            try {
                const std::string some = part.text.substr(begin, length);
                if (kBlanks.find(some.front()) != kBlanks.npos) break;
                if (std::ranges::count(some, '(') != std::ranges::count(some, ')')) continue;
                if (!std::isfinite(Expression(some)(q))) worst = {some, part.at + begin};
            } catch (const mu::ParserError&) {
            }
    return worst;
}

double number_of(const Source& source, const Part& part) {
    check_letters(source, part);
    try {
        mu::Parser parser;
        parser.DefineConst("pi", std::numbers::pi);
        parser.SetExpr(part.text);
        return parser.Eval();
    } catch (const mu::ParserError& e) {
        throw parse_error(source, part, e);
    }
}

/// Reports what register_kernel would refuse, but at its place in the text.
void check_not_taken(const Source& source, const Part& name, const KernelDefinition& definition) {
    const std::optional<int> known = kernel_from_name(definition.name);
    const KernelDefinition* other = known ? kernel_definition(*known) : nullptr;
    if (known && (other == nullptr || !other->same_kernel(definition)))
        throw source.error(name,
                           other == nullptr ? "is a name of the family"
                                            : "is the name of another kernel: " + other->source,
                           "Choose another name.");
}

KernelDefinition define(const Source& source, const Part& text, const Part& support_text,
                        double support, const Part& name) {
    check_letters(source, text);
    check_brackets(source, text);
    if (text.text.size() > kMostExpressionLength)
        throw source.error(text, fmt::format("{} letters of an expression", text.text.size()),
                           fmt::format("{} are allowed: give a table.", kMostExpressionLength));
    if (const std::string fault = fault_of_kernel_name(name.text);
        !name.text.empty() && !fault.empty())
        throw source.error(name, fault, "Choose another name.");
    try {
        Expression w(text.text);
        const double support_end = std::isfinite(support) ? support : 1;
        if (w(support_end / 2); w.results() != 1)
            throw source.error(text, fmt::format("{} expressions, not one", w.results()), kHelp);
        KernelDefinition definition =
            define_kernel(name.text, support, std::ref(w), source.whole());
        check_not_taken(source, name, definition);
        return definition;
    } catch (const mu::ParserError& e) {
        throw parse_error(source, text, e);
    } catch (const ProfileFault& fault) {
        const bool infinite = fault.reason.find(" inf") != std::string::npos ||
                              fault.reason.find("not a number") != std::string::npos;
        const bool of_support = fault.reason.find("support") != std::string::npos;
        throw source.error(of_support && !support_text.text.empty() ? support_text
                           : infinite                               ? culprit(text, fault.q)
                                                                    : text,
                           fault.reason, fault.hint);
    }
}

#else

[[noreturn]] double number_of(const Source& source, const Part& part) {
    throw source.error(part, "this build reads no expressions: muParser was not there",
                       "Give a table with --kernel-file, or build with libmuparser-dev.");
}

[[noreturn]] KernelDefinition define(const Source& source, const Part& text, const Part&, double,
                                     const Part&) {
    number_of(source, text);
}

#endif

}  // namespace

bool has_expressions() {
#ifdef DARB_MUPARSER
    return true;
#else
    return false;
#endif
}

std::string with_carets(std::string_view text, std::size_t begin, std::size_t length) {
    constexpr std::size_t kBefore = 60, kShown = 96;
    const std::size_t from = begin > kBefore ? begin - kBefore : 0;
    std::string shown(text.substr(std::min(from, text.size()), kShown));
    for (char& c : shown)
        if (c < ' ' || c > '~') c = '?';  // one column each, so that the carets line up
    const std::size_t column = begin - from;
    const std::size_t most = std::max(column + 1, shown.size()) - column;
    return fmt::format("\n    {}{}\n    {}{}", from > 0 ? "..." : "", shown,
                       std::string(column + (from > 0 ? 3 : 0), ' '),
                       std::string(std::clamp<std::size_t>(length, 1, most), '^'));
}

std::vector<std::string> split_kernel_list(std::string_view list) {
    std::vector<std::string> kernels;
    for (const Part& item : items_of(list)) {
        const bool own = behind("support", item) || behind("name", item);
        const bool halved = !kernels.empty() && kernels.back().starts_with(kBlendMark) &&
                            kernels.back().find(',') == std::string::npos;
        if (halved)
            kernels.back() += "," + item.text;
        else if (own && !kernels.empty() && is_kernel_expression(kernels.back()))
            kernels.back() += ", " + item.text;
        else if (!item.text.empty())
            kernels.push_back(item.text);
    }
    return kernels;
}

bool is_kernel_expression(std::string_view item) {
    return item.substr(std::min(item.find_first_not_of(kBlanks), item.size())).starts_with(kMark);
}

KernelDefinition kernel_from_expression(std::string_view item, const std::string& where) {
    const Source source{std::string(item), where};
    Part expression, support_text, name;
    for (const Part& part : items_of(item)) {
        if (part.text.starts_with(kMark) && expression.text.empty())
            expression = trimmed(item, part.at + kMark.size(), part.at + part.text.size());
        else if (const auto number = behind("support", part))
            support_text = *number;
        else if (const auto word = behind("name", part))
            name = *word;
        else
            throw source.error(part, "no part of a kernel", kHelp);
    }
    if (expression.text.empty()) throw source.at(item.size(), 1, "no expression", kHelp);
    double support = std::numeric_limits<double>::infinity();
    if (!support_text.text.empty()) support = number_of(source, support_text);
    return define(source, expression, support_text, support, name);
}

KernelDefinition kernel_from_expression(const std::string& expression, double support,
                                        const std::string& name, const std::string& where) {
    const Source source(expression, where);
    return define(source, {expression, 0}, {}, support, {name, 0});
}

}  // namespace darb
