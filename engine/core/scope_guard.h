// ScopeGuard: what was set for a while is put back, however the scope ends.
//
//     const Tuning before = device.tuning();
//     const ScopeGuard restore([&] { device.set_tuning(before); });
//     device.set_tuning(another);  // until the end of this scope, also where something throws
#pragma once

#include <exception>
#include <utility>

namespace darb {

/// Calls `undo` once, at the end of its scope. An exception of `undo` goes on to the caller, as if
/// it were called there; where another exception is ending the scope, that one goes on instead.
template <class Undo>
class [[nodiscard]] ScopeGuard {
  public:
    explicit ScopeGuard(Undo undo) : undo_(std::move(undo)) {}
    ScopeGuard(const ScopeGuard&) = delete;
    ScopeGuard& operator=(const ScopeGuard&) = delete;

    ~ScopeGuard() noexcept(false) {
        if (std::uncaught_exceptions() == before_) {
            undo_();
            return;
        }
        try {
            undo_();
        } catch (...) {  // the first failure is the one to tell
        }
    }

  private:
    Undo undo_;
    int before_ = std::uncaught_exceptions();
};

}  // namespace darb
