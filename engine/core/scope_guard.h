// SPDX-License-Identifier: MIT
// ScopeGuard: restores something at the end of a scope, however the scope ends.
//
//     const Tuning before = device.tuning();
//     const ScopeGuard restore([&] { device.set_tuning(before); });
// until the end of this scope, even if something throws
#pragma once

#include <exception>
#include <utility>

namespace darb {

/// Calls `undo` once, at the end of the scope. An exception from `undo` propagates to the caller,
/// unless another exception is already ending the scope: then that one propagates.
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
        } catch (...) {  // the first failure is the one to report
        }
    }

  private:
    Undo undo_;
    int before_ = std::uncaught_exceptions();
};

}  // namespace darb
