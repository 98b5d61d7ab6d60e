// SPDX-License-Identifier: MIT
// Kernels given by functions: the family written anew, profiles that are refused, and the registry.
#include "engine/kernels/kernel_definition.h"

#include <gtest/gtest.h>

#include <atomic>
#include <cmath>
#include <limits>
#include <numbers>
#include <thread>

#include "engine/kernels/kernel_coefficients.h"
#include "engine/kernels/kernel_registry.h"
#include "engine/kernels/relocation_table.h"
#include "tests/support/footprints.h"
#include "tests/support/kernel_vectors.h"

namespace darb {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

/// KERNEL_* by the formulas of the paper, which know nothing of the family's careful forms.
double paper_formula(int kernel, double q) {
    const double d = std::sqrt(q);
    switch (kernel) {
        case KERNEL_GAUSSIAN:
            return std::exp(-q / 2);
        case KERNEL_RAISED_COSINE:
            return 0.5 + 0.5 * std::cos(std::numbers::pi * d / 2.5);
        case KERNEL_HALF_COSINE_SQUARED:
            return std::cos(std::numbers::pi * q / 18);
        case KERNEL_SINC:
            return std::sin(std::numbers::pi * d / 3) /
                   (std::numbers::pi * d / 3);  // 0/0 at the centre
        case KERNEL_INVERSE_QUADRATIC:
            return 1 / (1 + q);
        case KERNEL_COSINE:
            return std::cos(std::numbers::pi * d / 6);
        case KERNEL_SQUARED_RAISED_COSINE:
            return std::pow(0.5 + 0.5 * std::cos(std::numbers::pi * d / 3), 2);
        case KERNEL_INVERSE_MULTIQUADRIC:
            return std::pow(1 + q, -0.5);
        default:
            return 1 - q / 9;
    }
}

int written_anew(int kernel) {
    return register_kernel(std::string(kernel_name(kernel)) + "_anew", kernel_support(kernel),
                           [kernel](double q) { return paper_formula(kernel, q); });
}

TEST(KernelDefinition, The_family_written_anew_has_its_coefficients) {
    for (int kernel = 0; kernel < KERNEL_COUNT; ++kernel) {
        const int anew = written_anew(kernel);
        EXPECT_GE(anew, KERNEL_ROWS);
        EXPECT_TRUE(has_exact_footprint(anew));
        for (const Footprint footprint : test::kFootprints)
            for (int degree = kLeastDegree; degree <= kFullDegree; ++degree) {
                SCOPED_TRACE(std::string(kernel_name(kernel)) + " " +
                             std::string(footprint_name(footprint)) + " " + std::to_string(degree));
                const KernelCoefficients& k = kernel_coefficients(kernel, footprint, degree);
                const KernelCoefficients& again = kernel_coefficients(anew, footprint, degree);
                EXPECT_EQ(again.form, k.form);
                EXPECT_EQ(again.degree, k.degree);
                EXPECT_EQ(again.half_power, k.half_power);
                EXPECT_EQ(again.squared, k.squared);
                EXPECT_EQ(again.inverse_support, k.inverse_support);
                // Most are equal bit by bit. The last steps of the fit of a polynomial of degree 5
                // move its smallest term by some floats: 1e-9 of w.
                for (std::size_t i = 0; i < k.c.size(); ++i)
                    EXPECT_NEAR(again.c[i], k.c[i], i < 4 ? 6e-8 : 2e-9) << i;
            }
    }
}

TEST(KernelDefinition, The_family_written_anew_has_its_psi_and_values) {
    for (int kernel = 0; kernel < KERNEL_COUNT; ++kernel) {
        const int anew = written_anew(kernel);
        SCOPED_TRACE(std::string(kernel_name(kernel)));
        EXPECT_NEAR(kernel_psi(anew), kernel_psi(kernel), 1e-12);
        for (const Footprint f : test::kFootprints) {
            EXPECT_NEAR(equal_area_scale(anew, f), equal_area_scale(kernel, f), 1e-12);
            EXPECT_NEAR(relocation_scale(anew, f, 0.8, 5), relocation_scale(kernel, f, 0.8, 5),
                        1e-12);
        }
    }
}

TEST(KernelDefinition, The_family_written_anew_meets_the_reference_vectors) {
    const auto vectors = test::load_kernel_vectors();
    if (!vectors) GTEST_SKIP() << test::kernel_vectors_path() << " is missing";
    std::vector<int> anew;
    for (int kernel = 0; kernel < KERNEL_COUNT; ++kernel) anew.push_back(written_anew(kernel));
    for (const test::KernelVector& v : *vectors) {  // 50-digit arithmetic
        const int kernel = anew[static_cast<std::size_t>(v.kernel)];
        if (!(v.q < kernel_support(kernel))) continue;
        EXPECT_NEAR(kernel_value(kernel, Footprint::psi, v.q), v.w, 1e-12) << kernel_name(kernel);
        EXPECT_NEAR(kernel_slope(kernel, Footprint::psi, v.q), v.slope, 1e-11)
            << kernel_name(kernel) << " " << v.tag;
    }
}

TEST(KernelDefinition, Order_of_the_edge_is_found) {
    for (int order = 0; order <= kMostEdgeOrder; ++order) {
        const KernelDefinition d = define_kernel(
            "", 5, [order](double q) { return std::pow(1 - q / 5, order) * std::exp(-q / 10) / 3; },
            "");
        EXPECT_EQ(d.edge_order, order);
        EXPECT_LT(d.error, 1e-12);
        ASSERT_EQ(d.notes.size(), 1u);  // about the division
        EXPECT_EQ(d.notes[0], "w(0) is 0.333333: divided by it");
    }
}

// u^2, accurate to 1e-15 in double, and everything that follows from it in closed form.
TEST(KernelDefinition, A_kernel_of_ones_own_has_all_that_the_family_has) {
    const int k = register_kernel("biweight", 4, [](double q) { return std::pow(1 - q / 4, 2); });
    EXPECT_EQ(kernel_name(k), "biweight");
    EXPECT_EQ(kernel_from_name("biweight"), k);
    EXPECT_EQ(kernel_with_pulses(k, 1), k);
    EXPECT_EQ(kernel_with_pulses(k, 2), std::nullopt);
    EXPECT_EQ(shader_kernel(k), KERNEL_PARABOLIC);
    EXPECT_FALSE(ends_with_a_jump(k));
    EXPECT_NEAR(kernel_psi(k), 4.0 / 9, 1e-14);
    EXPECT_NEAR(kernel_reach(k, Footprint::psi, 0.5, 0.02), 4 * (1 - 0.2), 1e-12);
    for (double q = 0; q < 4; q += 0.1)
        EXPECT_NEAR(kernel_value(k, Footprint::exact, q), std::pow(1 - q / 4, 2.5), 1e-14);
    EXPECT_EQ(kernel_value(k, Footprint::psi, 4), 0);
    EXPECT_GT(kernel_radius_quantile(k, 0.9), kernel_radius_quantile(k, 0.5));
}

// No shader can draw exp(-q/2) cut at 9 to float accuracy: the polynomial is drawn, and is the
// truth.
TEST(KernelDefinition, A_profile_beyond_the_polynomials_becomes_the_nearest_one) {
    const auto w = [](double q) { return std::exp(-q / 2); };
    const KernelDefinition d = define_kernel("cut", 9, w, "");
    EXPECT_GT(d.error, 1e-7);
    EXPECT_LT(d.error, 1e-5);
    ASSERT_EQ(d.notes.size(), 1u);
    EXPECT_NE(d.notes[0].find("its nearest polynomial is drawn"), std::string::npos);
    const int k = register_kernel(d);
    EXPECT_LT(kernel_coefficients(k, Footprint::psi, kFullDegree).value_error, 1e-7);
    for (double q = 0; q < 9; q += 0.01)
        EXPECT_NEAR(kernel_value(k, Footprint::psi, q), w(q), 1.05 * d.error);
    EXPECT_TRUE(ends_with_a_jump(k));
}

TEST(KernelDefinition, A_table_of_degrees_takes_what_fits_from_there_on) {
    const int k = register_kernel("slow", 9, [](double q) { return 1 / (1 + q / 4); });
    EXPECT_LT(kernel_coefficients(k, Footprint::psi, 2).value_error, kShortAccuracy);
    EXPECT_GT(kernel_coefficients(k, Footprint::psi, 2).degree, 2);
}

struct Refused {
    const char* what;
    double support;
    std::function<double(double)> w;
};

TEST(KernelDefinition, What_is_no_kernel_is_refused_with_its_place) {
    const Refused all[] = {
        {"is negative, -0.000854, at q = 4.00342", 9, [](double q) { return 1 - q / 4; }},
        {"grows, from 0.555664 to 0.655176, before q = 4.00342", 9,
         [](double q) { return 1 - q / 9 + (q > 4 ? 0.1 : 0); }},
        {"grows", 9, [](double q) { return 1 / (4 - q); }},
        {"is not a number at q = 4.00342", 9, [](double q) { return std::sqrt(4 - q); }},
        {"is 0 from q = 4.00342 on", 9, [](double q) { return std::max(0.0, 1 - q / 4); }},
        {"is 0 at its centre", 9, [](double q) { return q; }},
        {"is inf at its centre", 9, [](double q) { return 1 / q; }},
        {"is -1 at its centre", 9, [](double q) { return q - 1; }},
        {"a support of 0", 0, [](double) { return 1.0; }},
        {"a support of -2", -2, [](double) { return 1.0; }},
        {"a support of nan", std::nan(""), [](double) { return 1.0; }},
        {"has no support, and is not exp(-q/2)", kInfinity, [](double q) { return std::exp(-q); }},
        {"off what the shaders' polynomials reach", 9,
         [](double q) { return std::exp(-std::sqrt(q)); }},
        {"off what the shaders' polynomials reach", 9, [](double q) { return q < 2 ? 1 : 0.5; }},
    };
    for (const Refused& r : all) try {
            define_kernel("no_kernel", r.support, r.w, "");
            ADD_FAILURE() << "taken, and should be: " << r.what;
        } catch (const ProfileFault& fault) {
            EXPECT_NE(fault.reason.find(r.what), std::string::npos) << fault.reason;
            EXPECT_FALSE(fault.hint.empty());
        }
    for (const char* name : {"Big", "1st", "", "a b", "all", "expr", "\xc3\xa4"})
        EXPECT_FALSE(fault_of_kernel_name(name).empty()) << name;
    EXPECT_FALSE(fault_of_kernel_name(std::string(41, 'a')).empty());
    EXPECT_TRUE(fault_of_kernel_name(std::string(40, 'a')).empty());
}

TEST(KernelRegistry, The_same_kernel_has_one_id_and_another_of_its_name_is_refused) {
    const auto cubic = [](double q) { return std::pow(1 - q / 9, 3); };
    const int k = register_kernel("twice", 9, cubic);
    EXPECT_EQ(register_kernel("twice", 9, cubic), k);
    EXPECT_THROW(register_kernel("twice", 8, [](double q) { return 1 - q / 8; }), Error);
    EXPECT_THROW(register_kernel("sinc", 9, cubic), Error);
    const std::vector<int> known = known_kernels();
    EXPECT_EQ(std::count(known.begin(), known.end(), k), 1);
    EXPECT_EQ(kernel_definition(k)->name, "twice");
    EXPECT_EQ(kernel_definition(KERNEL_SINC), nullptr);
    KernelDefinition of_file = define_kernel(
        "twice", 8, [](double q) { return 1 - q / 8; }, "");
    std::vector<std::string> notes;
    const int other = register_kernel_of_file(of_file, "a.ply", notes);
    EXPECT_EQ(kernel_name(other), "twice_2");
    ASSERT_EQ(notes.size(), 1u);
    EXPECT_EQ(register_kernel_of_file(of_file, "a.ply", notes), other);
    of_file.name = "sinc";  // which the family may have got after the file
    EXPECT_EQ(kernel_name(register_kernel_of_file(of_file, "a.ply", notes)), "sinc_2");
}

TEST(KernelRegistry, Threads_agree) {
    constexpr int kThreads = 4, kKernels = 5;
    std::vector<std::vector<int>> ids(kThreads);
    std::vector<std::thread> threads;
    for (std::vector<int>& mine : ids)
        threads.emplace_back([&mine] {
            for (int i = 1; i <= kKernels; ++i) {
                const double support = 4 + i;
                mine.push_back(register_kernel("of_threads_" + std::to_string(i), support,
                                               [=](double q) { return 1 - q / support; }));
                EXPECT_NEAR(kernel_value(mine.back(), Footprint::psi, 1), 1 - 1 / support, 1e-14);
            }
        });
    for (std::thread& thread : threads) thread.join();
    for (const std::vector<int>& mine : ids) EXPECT_EQ(mine, ids[0]);
}

TEST(KernelRegistry, What_no_definition_can_be_is_refused) {
    const KernelDefinition good = define_kernel(
        "good", 9, [](double q) { return std::pow(1 - q / 9, 2); }, "");
    const auto refused = [&](const std::function<void(KernelDefinition&)>& spoil) {
        KernelDefinition d = good;
        spoil(d);
        EXPECT_THROW(check_definition(d), ProfileFault);
    };
    refused([](KernelDefinition& d) { d.name = "no name"; });
    refused([](KernelDefinition& d) { d.support = 0; });
    refused([](KernelDefinition& d) { d.support = kInfinity; });
    refused([](KernelDefinition& d) { d.edge_order = 5; });
    refused([](KernelDefinition& d) { d.edge_order = -1; });
    refused([](KernelDefinition& d) { d.series.clear(); });
    refused([](KernelDefinition& d) { d.series.assign(65, 0.01); });
    refused([](KernelDefinition& d) { d.series = {std::nan("")}; });
    refused([](KernelDefinition& d) { d.series = {0.5}; });
    refused([](KernelDefinition& d) { d.series = {0, 1}; });  // negative beyond the middle
    refused([](KernelDefinition& d) { d.like = KERNEL_SINC; });
    refused([](KernelDefinition& d) { d.like = KERNEL_GAUSSIAN; });
    EXPECT_NO_THROW(check_definition(good));
}

}  // namespace
}  // namespace darb
