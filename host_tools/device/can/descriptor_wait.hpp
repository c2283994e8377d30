#pragma once

#include <chrono>

namespace kmax::link {

/// Waits for `events` (POLLIN, POLLOUT) on a descriptor, not longer than `wait`; 0 looks and returns.
/// True: they, or an error or a hang-up, are there. A signal ends the wait early with false.
bool wait_for(int descriptor, short events, std::chrono::microseconds wait);

}  // namespace kmax::link
