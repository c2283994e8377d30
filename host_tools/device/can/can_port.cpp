#include "host_tools/device/can/can_port.hpp"

#include <algorithm>

#include "host_tools/device/can/socket_can.hpp"
#include "host_tools/device/can/unix_can.hpp"

namespace kmax::link {

bool passes(const drivers::CanFrame& frame, const std::vector<CanFilter>& filters) {
  if (filters.empty()) return true;
  if (frame.extended || frame.remote) return false;
  return std::any_of(filters.begin(), filters.end(), [&](const CanFilter& filter) {
    return (frame.identifier & filter.mask) == (filter.identifier & filter.mask);
  });
}

bool is_socket_path(const std::string& name) {
  return name.find('/') != std::string::npos;
}

std::unique_ptr<CanPort> open_can_port(const std::string& name, const CanPortOptions& options) {
  if (is_socket_path(name)) return std::make_unique<UnixCan>(name, options);
  return std::make_unique<SocketCan>(name, options);
}

}  // namespace kmax::link
