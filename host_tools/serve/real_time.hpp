#pragma once

#include <chrono>
#include <functional>

#include "host_tools/serve/can_connection.hpp"
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

struct PaceReport {
  std::uint64_t ticks = 0;
  double behind_s = 0;  ///< real time that was given up because the process had been held up
};

/// Runs a simulated board at the pace of the real clock, connected to `host`, until `stop` says so (asked
/// about every millisecond).
///
/// A process that is held up catches up as long as it is less than 50 ms behind; beyond, the simulated time
/// stands still for the rest and that is counted. Bytes that arrive together are put on the line one after
/// the other at its baud rate, so a frame never falls apart because the host was busy.
PaceReport run_in_real_time(simulated_board::SimulatedBoard& simulation, const HostSide& host,
                            const std::function<bool()>& stop);

}  // namespace kmax::serve
