// SPDX-License-Identifier: MIT
#include <cstdlib>
#include <exception>
#include <filesystem>
#include <new>
#include <string>
#include <system_error>

#include "engine/core/error.h"
#include "engine/ranks/ranks.h"

namespace darb {

namespace {
constexpr int kBadInput = 2, kInternal = 1;  // exit codes, equal to those of main
}

int with_ranks(const std::function<int(Ranks&)>& work) {
    const std::unique_ptr<Ranks> ranks = start_ranks();
    if (ranks->count() == 1) return work(*ranks);
    std::string what;
    int code = kBadInput;
    try {
        const int done = work(*ranks);
        ranks->finish();
        return done;
    } catch (const Error& e) {
        what = e.what();
    } catch (const std::filesystem::filesystem_error& e) {
        what = e.path1().string() + ": " + e.code().message();
    } catch (const std::system_error& e) {
        what = e.code().message();
    } catch (const std::bad_alloc&) {
        what = "no memory is left";
    } catch (const std::exception& e) {
        what = std::string("internal: ") + e.what();
        code = kInternal;
    }
    ranks->fail(what, code);
    std::abort();  // gcc does not see that this is never reached
}

}  // namespace darb
