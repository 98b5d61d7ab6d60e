// What a program was at when the system refused it memory or a thread.
#pragma once

#include <new>
#include <stdexcept>
#include <string>
#include <system_error>

#include "engine/core/error.h"

namespace darb {

/// Returns work(). Where that runs out of memory it throws NoRoom, where it cannot start a thread
/// Error, either naming `what`, a file or a part of the work; other exceptions stay as they are.
template <class Work>
decltype(auto) while_doing(const std::string& what, Work&& work) {
    constexpr const char* kLess =
        "Close other programs, or give it less: fewer or smaller photos "
        "(-r), fewer splats.";
    try {
        return work();
    } catch (const std::bad_alloc&) {
        throw NoRoom(what, "no memory is left", kLess);
    } catch (const std::length_error&) {  // more than any memory has
        throw NoRoom(what, "no memory has room for so much", kLess);
    } catch (const std::system_error& e) {
        if (e.code() != std::errc::resource_unavailable_try_again) throw;
        throw Error(what, "no thread can be started: " + e.code().message(),
                    "The limits of this system are reached: close other programs.");
    }
}

}  // namespace darb
