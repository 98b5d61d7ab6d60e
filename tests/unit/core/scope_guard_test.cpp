// SPDX-License-Identifier: MIT
// What a scope restores, and which failure is reported where restoring fails, too.
#include "engine/core/scope_guard.h"

#include <gtest/gtest.h>

#include <stdexcept>
#include <string>

namespace darb {
namespace {

TEST(ScopeGuard, puts_back_at_the_end_of_the_scope_however_that_ends) {
    int value = 1;
    const auto set = [&](bool fails) {
        const ScopeGuard restore([&, before = value] { value = before; });
        value = 2;
        if (fails) throw std::runtime_error("the work");
        EXPECT_EQ(value, 2);
    };
    set(false);
    EXPECT_EQ(value, 1);
    EXPECT_THROW(set(true), std::runtime_error);
    EXPECT_EQ(value, 1);
}

std::string told(bool work_fails, bool undo_fails) {
    try {
        const ScopeGuard restore([&] {
            if (undo_fails) throw std::runtime_error("the undo");
        });
        if (work_fails) throw std::runtime_error("the work");
    } catch (const std::runtime_error& e) {
        return e.what();
    }
    return "nothing";
}

TEST(ScopeGuard, tells_the_first_failure) {
    EXPECT_EQ(told(false, false), "nothing");
    EXPECT_EQ(told(true, false), "the work");
    EXPECT_EQ(told(false, true), "the undo");
    EXPECT_EQ(told(true, true), "the work");
}

struct Nested {
    std::string& inner;
    ~Nested() { inner = told(false, true); }
};

TEST(ScopeGuard, tells_its_own_failure_inside_a_destructor_that_another_one_runs) {
    std::string inner;
    EXPECT_THROW(
        {
            const Nested nested{inner};
            throw std::runtime_error("outer");
        },
        std::runtime_error);
    EXPECT_EQ(inner, "the undo");
}

}  // namespace
}  // namespace darb
