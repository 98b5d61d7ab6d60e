// SPDX-License-Identifier: MIT
// Kernels in JSON files and tables: what they give, and that no file causes a crash.
#include "engine/kernels/kernel_definition.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "engine/kernels/kernel_coefficients.h"
#include "engine/kernels/kernel_expression.h"
#include "engine/kernels/kernel_registry.h"

namespace darb {
namespace {

using Rows = std::vector<std::pair<double, double>>;

Rows rows_of(int count, double support, const std::function<double(double)>& w) {
    Rows rows;
    for (int i = 0; i < count; ++i) {
        const double q = support * i / (count - 1);
        rows.emplace_back(q, w(q));
    }
    return rows;
}

std::string reason_of(const std::string& text) {
    try {
        parse_kernel_file(text, "mine.json");
    } catch (const Error& e) {
        EXPECT_EQ(e.where.substr(0, 9), "mine.json");
        EXPECT_FALSE(e.hint.empty()) << e.reason;
        return e.reason;
    }
    return "taken";
}

TEST(KernelTable, Rows_of_a_smooth_profile_give_it_back) {
    const auto w = [](double q) { return std::pow(1 - q / 9, 2); };
    for (const auto& [count, error] : {std::pair{9, 4e-3}, {33, 2e-4}, {257, 1e-6}}) {
        const KernelDefinition d = kernel_from_table("", rows_of(count, 9, w), "test");
        const int k = register_kernel(d);
        EXPECT_EQ(kernel_support(k), 9);
        for (double q = 0; q < 9; q += 0.1)
            EXPECT_NEAR(kernel_value(k, Footprint::psi, q), w(q), error) << count << " " << q;
    }
}

TEST(KernelTable, Errors_name_the_row) {
    const auto reason = [](const Rows& rows) -> std::string {
        try {
            kernel_from_table("", rows, "test");
        } catch (const Error& e) {
            return e.reason;
        }
        return "taken";
    };
    EXPECT_EQ(reason({{0, 1}, {1, 0.8}, {2, 0.9}, {4, 0}}),
              "row 3 of its table, q 2, w 0.9: w grows, it is 0.8 before");
    EXPECT_EQ(reason({{0, 1}, {2, 0.8}, {1, 0.7}, {4, 0}}),
              "row 3 of its table, q 1, w 0.7: q does not rise, it is 2 before");
    EXPECT_EQ(reason({{0.5, 1}, {2, 0.8}, {4, 0}}),
              "row 1 of its table, q 0.5, w 1: the first q is not 0");
    EXPECT_EQ(reason({{0, 1}, {1, 0.5}, {2, -0.1}}), "row 3 of its table, q 2, w -0.1: negative");
    EXPECT_EQ(reason({{0, 1}, {1, 0}, {2, 0}}),
              "row 2 of its table, q 1, w 0: 0 before the last row");
    EXPECT_EQ(reason({{0, 1}, {1, std::nan("")}, {2, 0}}),
              "row 2 of its table, q 1, w nan: not finite");
    EXPECT_EQ(reason({{0, 0}, {1, 0}, {2, 0}}), "row 1 of its table, q 0, w 0: 0 at the centre");
    EXPECT_EQ(reason({{0, 1}, {2, 0}}), "a table of 2 rows");
    EXPECT_EQ(reason({{0, 1}, {1, 1}, {1.001, 0.2}, {9, 0}}).substr(0, 21),
              "its table, near row 4");
}

TEST(KernelFile, Errors_name_what_is_wrong) {
    EXPECT_EQ(reason_of("{\"name\": \"a\""),
              "is no valid JSON: it ends in line 1 before it is complete");
    EXPECT_EQ(reason_of("3"), "a kernel is no object {...}");
    EXPECT_EQ(reason_of("[]"), "holds 0 kernels");
    EXPECT_EQ(reason_of("{}"), "has no profile");
    EXPECT_EQ(reason_of(R"({"expression": "1", "table": []})"), "has more than one profile");
    EXPECT_EQ(reason_of(R"({"expresion": "1"})"), "'expresion' is nothing that a kernel has");
    EXPECT_EQ(reason_of(R"({"table": [[0, 1], [1]]})"), "row 2 of its table is no pair [q, w]");
    EXPECT_EQ(reason_of(R"({"table": [[0, 1], [1, "a"]]})"),
              "row 2 of its table, w is no number: \"a\"");
    EXPECT_EQ(reason_of(R"({"table": [[0, 1], [1, 0.5], [2, 0]], "support": 3})"),
              "its support is not the last q of its table, 2");
    EXPECT_EQ(reason_of(R"({"name": "Big", "table": [[0, 1], [1, 0.5], [2, 0]]})"),
              "'Big' is no name of a kernel: small letters, digits and _, a letter first, 40 at "
              "most");
    EXPECT_EQ(
        reason_of(R"({"name": "a", "function": {"support": 9, "edge_order": 9, "series": [1]}})"),
        "an edge of order 9");
    EXPECT_EQ(
        reason_of(R"({"name": "a", "function": {"support": 9, "series": [1, 5]}})").substr(0, 10),
        "its series");
    EXPECT_EQ(reason_of(R"({"name": "a", "function": {"support": 9, "series": [1e300]}})"),
              "a term 1e+300 in its series");
    const std::string many = "[" + std::string(20'002, '1') + "]";
    EXPECT_NE(reason_of("{\"table\": " + many + "}"), "taken");
    std::string rows = "[0, 1]";
    for (int i = 1; i <= 10'000; ++i) rows += fmt::format(",[{}, 1]", i);
    EXPECT_EQ(reason_of("{\"table\": [" + rows + "]}"), "a table of 10001 rows");
    EXPECT_NE(reason_of(std::string(100'000, '[')), "taken");
}

TEST(KernelFile, A_list_and_a_name_of_the_file) {
    const std::string one = R"({"table": [[0, 1], [1, 0.75], [2, 0.5], [4, 0]]})";
    EXPECT_EQ(parse_kernel_file(one, "folder/ramp.json").at(0).name, "ramp");
    EXPECT_EQ(parse_kernel_file(one, "folder/sinc.json").at(0).name.substr(0, 7), "kernel_");
    const auto two = parse_kernel_file("[" + one + "," + one + "]", "ramp.json");
    ASSERT_EQ(two.size(), 2u);
    EXPECT_TRUE(two[0].same_kernel(two[1]));
    EXPECT_EQ(two[0].name.substr(0, 7), "kernel_");
    if (!has_expressions()) return;
    EXPECT_EQ(reason_of(R"([{"expression": "1 - q/9", "support": 9},
                            {"expression": "1 - q/", "support": 9}])"),
              "Unexpected end of expression\n    1 - q/\n          ^");
}

TEST(KernelFile, What_is_written_is_read_as_the_same_kernel) {
    for (const auto& [name, support, w] :
         std::vector<std::tuple<std::string, double, std::function<double(double)>>>{
             {"written_a", 9, [](double q) { return std::pow(1 - q / 9, 3); }},
             {"written_b", 7, [](double q) { return std::cos(q / 5) * std::cos(q / 5); }},
             {"written_c", 9, [](double q) { return 1 / (1 + q); }},
             {"written_d", INFINITY, [](double q) { return std::exp(-q / 2); }}}) {
        const KernelDefinition d = define_kernel(name, support, w, "a \"source\"\n");
        const std::string text = definition_json(d).dump();
        const KernelDefinition again = parse_kernel_file(text, "test").at(0);
        EXPECT_TRUE(again.same_kernel(d)) << text;
        EXPECT_EQ(again.source, d.source);
        EXPECT_EQ(again.error, d.error);
        EXPECT_EQ(register_kernel(again), register_kernel(d));
    }
}

TEST(KernelFile, Cut_at_every_length_or_with_any_byte_changed_it_is_a_kernel_or_an_error) {
    const KernelDefinition d = define_kernel(
        "cut_file", 7, [](double q) { return std::pow(std::cos(q / 5), 2); }, "");
    const std::string function = definition_json(d).dump();
    const std::string table = R"({"name": "t", "table": [[0, 1], [1, 0.75], [2, 0.5], [4, 0.0]]})";
    for (const std::string& whole : {function, table}) {
        int good = 0;
        for (std::size_t length = 0; length <= whole.size(); ++length) try {
                parse_kernel_file(whole.substr(0, length), "test");
                ++good;
            } catch (const Error&) {
            }
        EXPECT_EQ(good, 1);
        for (std::size_t at = 0; at < whole.size(); ++at)
            for (const char byte : {'9', '-', 'e', '"', '[', '\0', '\xff'}) try {
                    std::string changed = whole;
                    changed[at] = byte;
                    for (const KernelDefinition& k : parse_kernel_file(changed, "test"))
                        check_definition(k);
                } catch (const Error&) {
                }
    }
}

}  // namespace
}  // namespace darb
