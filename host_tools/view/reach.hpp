#pragma once

#include <functional>
#include <memory>
#include <string>

#include "host_tools/device/can/can_port.hpp"
#include "host_tools/device/link.hpp"

namespace kmax::view {

/// How a device is reached. Errors of both: device::LinkError.
struct Reach {
  std::string address{};
  std::function<std::unique_ptr<device::Link>()> open_link{};
  /// Null: the device is not on a CAN bus, so that its rows are asked for one by one.
  std::function<std::unique_ptr<device::CanPort>(const device::CanPortOptions&)> open_bus{};
  std::uint8_t node = 0;
  bool own_time = false;  ///< simulated in this process, where its time may pass faster than the user's
};

}  // namespace kmax::view
