// Error: bad input or a device that cannot go on. Thrown anywhere, caught once in main, which
// prints "error: WHERE: WHAT" and "  WHAT TO DO", and exits with 2. What is caught before that, to
// go on in another way, is one of its kinds below.
#pragma once

#include <stdexcept>
#include <string>
#include <utility>

namespace darb {

struct Error : std::runtime_error {
    /// where: file and record, or device and pass. what: the reason. hint: what the user can do.
    Error(std::string where_, std::string what_, std::string hint_ = {})
        : std::runtime_error(where_ + ": " + what_ + (hint_.empty() ? "" : "\n  " + hint_)),
          where(std::move(where_)),
          reason(std::move(what_)),
          hint(std::move(hint_)) {}

    std::string where;
    std::string reason;
    std::string hint;
};

/// There is no room: memory of the device or of the host ran out, a budget of it did, or a limit of
/// the driver. A smaller attempt may succeed, so this is what an attempt with a fallback catches.
struct NoRoom : Error {
    using Error::Error;
};

/// The device is gone, and nothing that uses it can succeed: no fallback may catch this.
struct DeviceLost : Error {
    using Error::Error;
};

/// The hint of what finds bytes that no writer of a format can have meant.
inline constexpr const char* kCopyAgain =
    "The file is damaged or cut off: export or copy it again.";

}  // namespace darb
