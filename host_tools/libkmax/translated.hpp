#pragma once

#include <kmax/errors.hpp>

namespace kmax::library {

/// Throws the exception that is being handled as what the public headers promise. What they know nothing of
/// comes through as it is: what a caller's own function has thrown.
[[noreturn]] void rethrow_translated();

/// What `act` returns, with its errors translated.
template <typename Act>
auto translated(const Act& act) {
  try {
    return act();
  } catch (...) {
    rethrow_translated();
  }
}

}  // namespace kmax::library
