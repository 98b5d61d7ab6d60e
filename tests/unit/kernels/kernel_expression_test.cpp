// SPDX-License-Identifier: MIT
// Kernels as expressions, lists of kernels on a command line, and the places of errors.
#include "engine/kernels/kernel_expression.h"

#include <gtest/gtest.h>

#include <limits>

#include "engine/kernels/kernel_coefficients.h"
#include "engine/kernels/kernel_registry.h"

namespace darb {
namespace {

class KernelExpression : public testing::Test {
    void SetUp() override {
        if (!has_expressions()) GTEST_SKIP() << "built without muParser";
    }
};

TEST(KernelList, Commas_of_brackets_and_of_a_kernel_do_not_split) {
    using List = std::vector<std::string>;
    EXPECT_EQ(split_kernel_list("sinc,gaussian"), (List{"sinc", "gaussian"}));
    EXPECT_EQ(split_kernel_list(" all , expr: max(1 - q/9, 0), support 9, name a,, sinc "),
              (List{"all", "expr: max(1 - q/9, 0), support 9, name a", "sinc"}));
    EXPECT_EQ(split_kernel_list("expr: exp(-q/2), expr:1,support 2"),
              (List{"expr: exp(-q/2)", "expr:1, support 2"}));
    EXPECT_EQ(split_kernel_list("support 9"), List{"support 9"});
    EXPECT_EQ(split_kernel_list(""), List{});
}

// The nine kernels, as a user would write them.
TEST_F(KernelExpression, The_family_as_expressions_has_its_coefficients) {
    const char* family[KERNEL_COUNT] = {
        "expr: exp(-q/2)",
        "expr: 0.5 + 0.5*cos(pi*d/2.5), support 2.5^2",
        "expr: cos(pi*q/18), support 9",
        "expr: sin(pi*d/3)/(pi*d/3), support 9",
        "expr: 1/(1 + q), support 9",
        "expr: cos(pi*d/6), support 9",
        "expr: (0.5 + 0.5*cos(pi*d/3))^2, support 9",
        "expr: 1/sqrt(1 + q), support 9",
        "expr: 1 - q/9, support 9",
    };
    for (int kernel = 0; kernel < KERNEL_COUNT; ++kernel) {
        const int anew = register_kernel(kernel_from_expression(family[kernel], "test"));
        SCOPED_TRACE(family[kernel]);
        EXPECT_NEAR(kernel_psi(anew), kernel_psi(kernel), 1e-12);
        for (const Footprint f : {Footprint::psi, Footprint::exact}) {
            const KernelCoefficients& k = kernel_coefficients(kernel, f, kFullDegree);
            const KernelCoefficients& again = kernel_coefficients(anew, f, kFullDegree);
            EXPECT_EQ(again.degree, k.degree);
            for (std::size_t i = 0; i < k.c.size(); ++i)
                EXPECT_NEAR(again.c[i], k.c[i], i < 4 ? 6e-8 : 2e-9) << i;
        }
    }
}

TEST_F(KernelExpression, A_kernel_without_a_name_is_named_by_its_content) {
    const KernelDefinition a = kernel_from_expression("expr: (1 - q/9)^2, support 9", "test");
    const KernelDefinition b = kernel_from_expression("expr:(1-q/9)*(1-q/9),support 3^2", "test");
    const KernelDefinition c = kernel_from_expression("expr: (1 - q/8)^2, support 8", "test");
    EXPECT_EQ(a.name, b.name);
    EXPECT_NE(a.name, c.name);
    EXPECT_EQ(a.source, "expr: (1 - q/9)^2, support 9");
    EXPECT_EQ(register_kernel(a), register_kernel(b));
}

struct Case {
    const char *text, *reason;
};

// Each reason ends with the text and carets below the place.
TEST_F(KernelExpression, Errors_show_the_place) {
    const Case cases[] = {
        {"expr: (1 - q/9^3, support 9",
         "a bracket that is never closed\n    expr: (1 - q/9^3, support 9\n          ^"},
        {"expr: 1 - q/9), support 9",
         "a bracket that closes none\n    expr: 1 - q/9), support 9\n                 ^"},
        {"expr: 1 - qq/9, support 9",
         "Unexpected token \"qq\" found\n    expr: 1 - qq/9, support 9\n              ^^"},
        {"expr: (1 - q/9)^, support 9",
         "Unexpected end of expression\n    expr: (1 - q/9)^, support 9\n                    ^"},
        {"expr: 1 - q/9, support 0",
         "a support of 0\n    expr: 1 - q/9, support 0\n                           ^"},
        {"expr: 1 - q/9, support nine",
         "Unexpected token \"nine\" found\n    expr: 1 - q/9, support nine\n"
         "                           ^^^^"},
        {"expr: 1 - q/9, support 9, name sinc",
         "is a name of the family\n    expr: 1 - q/9, support 9, name sinc\n"
         "                                   ^^^^"},
        {"expr: 1 - q/9, support 9, name Big",
         "is no name of a kernel: small letters, digits and _, a letter first, 40 at most\n"
         "    expr: 1 - q/9, support 9, name Big\n                                   ^^^"},
        {"expr: q = 3, support 9",
         "an expression assigns nothing\n    expr: q = 3, support 9\n            ^"},
        {"expr: 1 - q/4, support 9",
         "is negative, -0.000854, at q = 4.00342\n    expr: 1 - q/4, support 9\n          ^^^^^^^"},
        {"expr: 0.5 + sqrt(4 - q)/4, support 9",
         "is not a number at q = 4.00342\n    expr: 0.5 + sqrt(4 - q)/4, support 9\n"
         "                ^^^^^^^^^^^"},
        {"expr: 1 + q, support 9",
         "grows, from 1 to 1.00439, before q = 0.00439453\n    expr: 1 + q, support 9\n"
         "          ^^^^^"},
        {"expr: exp(-q)",
         "has no support, and is not exp(-q/2)\n    expr: exp(-q)\n          ^^^^^^^"},
        {"expr: 1 - q/9, support 9, sinc",
         "no part of a kernel\n    expr: 1 - q/9, support 9, sinc\n                              "
         "^^^^"},
        {"expr: , support 9", "no expression\n    expr: , support 9\n                     ^"},
        {"expr: \"a\", support 9",
         "no letter of an expression\n    expr: \"a\", support 9\n          ^"},
        {"expr: 1/q, support 9",
         "is inf at its centre, q = 0\n    expr: 1/q, support 9\n          ^^^"},
    };
    for (const Case& c : cases) try {
            kernel_from_expression(c.text, "--kernel");
            ADD_FAILURE() << "taken: " << c.text;
        } catch (const Error& e) {
            EXPECT_EQ(e.reason, c.reason);
            EXPECT_EQ(e.where, "--kernel");
            EXPECT_FALSE(e.hint.empty());
        }
}

TEST_F(KernelExpression, A_name_that_another_kernel_has_is_refused_with_its_place) {
    register_kernel(kernel_from_expression("expr: 1 - q/7, support 7, name mine_here", "test"));
    EXPECT_NO_THROW(kernel_from_expression("expr: (7 - q)/7, support 7, name mine_here", "test"));
    try {
        kernel_from_expression("expr: 1 - q/8, support 8, name mine_here", "test");
        ADD_FAILURE();
    } catch (const Error& e) {
        EXPECT_EQ(e.reason,
                  "is the name of another kernel: expr: 1 - q/7, support 7, name mine_here\n"
                  "    expr: 1 - q/8, support 8, name mine_here\n"
                  "                                   ^^^^^^^^^");
    }
}

// No text crashes, not even at muParser's own limits.
TEST_F(KernelExpression, A_text_of_any_length_is_a_kernel_or_an_error) {
    const std::string whole = "expr: (0.5 + 0.5*cos(pi*d/3))^2, support 3^2, name any_length";
    int good = 0;
    for (std::size_t length = 0; length <= whole.size(); ++length) try {
            kernel_from_expression(whole.substr(0, length), "test");
            ++good;
        } catch (const Error&) {
        }
    EXPECT_GT(good, 0);
    for (const std::string& text :
         {"expr: " + std::string(5000, '('), "expr: " + std::string(5000, '-') + "q, support 9",
          "expr: 1" + std::string(2000, '0') + ", support 9", std::string("expr: \0q", 8),
          std::string("expr: q?q?q?q:1, support 9"), std::string("expr: sum(), support 1e999")})
        EXPECT_THROW(kernel_from_expression(text, "test"), Error) << text.substr(0, 40);
}

TEST(KernelCarets, Long_texts_are_cut_around_the_place) {
    const std::string text = std::string(200, 'a') + "X" + std::string(200, 'b');
    const std::string lines = with_carets(text, 200, 1);
    EXPECT_EQ(lines.find('X') - lines.find("...a"), lines.rfind('^') - lines.rfind("\n    ") - 5);
    EXPECT_LT(lines.size(), 300u);
    EXPECT_EQ(with_carets("a\tb\x1b", 3, 1), "\n    a?b?\n       ^");
}

}  // namespace
}  // namespace darb
