#include <cstdlib>
#include <exception>
#include <string>

#include "engine/core/error.h"
#include "engine/ranks/ranks.h"

namespace darb {

namespace {
constexpr int kBadInput = 2, kInternal = 1;  // exit codes, as those of main
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
    } catch (const std::exception& e) {
        what = std::string("internal: ") + e.what();
        code = kInternal;
    }
    ranks->fail(what, code);
    std::abort();  // gcc does not see that it never comes here
}

}  // namespace darb
