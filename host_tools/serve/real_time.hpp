#pragma once

#include <chrono>
#include <functional>

#include "host_tools/serve/can_connection.hpp"
#include "host_tools/serve/pace.hpp"
#include "host_tools/serve/pseudo_terminal.hpp"
#include "host_tools/simulated_board/simulated_board.hpp"

namespace kmax::serve {

/// What a served device is connected to; null: an open connector.
struct HostSide {
  PseudoTerminal* line = nullptr;
  CanConnection* can = nullptr;
};

/// Sleeps until one of them has something to read, or for `longest`.
void wait_for_host(const HostSide& host, std::chrono::microseconds longest);

/// Runs a simulated board at `pace` by the real clock, connected to `host`, until `stop` says so (asked about
/// every millisecond). Returns how many ticks it ran.
///
/// Bytes that arrive together are put on the line one after the other at its baud rate, so a frame never
/// falls apart because the host was busy.
std::uint64_t run_in_real_time(simulated_board::SimulatedBoard& simulation, const HostSide& host, Pace& pace,
                               const std::function<bool()>& stop);

}  // namespace kmax::serve
