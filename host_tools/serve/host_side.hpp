#pragma once

#include <chrono>

#include "host_tools/serve/can_connection.hpp"
#include "host_tools/serve/pseudo_terminal.hpp"

namespace kmax::serve {

/// What a served device is connected to; null: an open connector.
struct HostSide {
  PseudoTerminal* line = nullptr;
  CanConnection* can = nullptr;
};

/// Sleeps until one of them has something to read, or for `longest`.
void wait_for_host(const HostSide& host, std::chrono::microseconds longest);

}  // namespace kmax::serve
