#include "host_tools/device/can/can_port.hpp"

#include <algorithm>

#include "host_tools/device/can/socket_can.hpp"
#include "host_tools/device/can/unix_can.hpp"

namespace kmax::device {

can_frame to_kernel(const drivers::CanFrame& frame) {
  can_frame kernel{};
  kernel.can_id =
      frame.identifier | (frame.extended ? CAN_EFF_FLAG : 0U) | (frame.remote ? CAN_RTR_FLAG : 0U);
  kernel.can_dlc = frame.length;
  if (!frame.remote) std::copy_n(frame.data.begin(), std::min<std::size_t>(frame.length, 8), kernel.data);
  return kernel;
}

std::optional<drivers::CanFrame> from_kernel(const can_frame& kernel) {
  if ((kernel.can_id & CAN_ERR_FLAG) != 0) return std::nullopt;
  drivers::CanFrame frame{.identifier = kernel.can_id & CAN_EFF_MASK,
                          .extended = (kernel.can_id & CAN_EFF_FLAG) != 0,
                          .remote = (kernel.can_id & CAN_RTR_FLAG) != 0,
                          .length = kernel.can_dlc};
  if (!frame.valid()) return std::nullopt;
  if (!frame.remote) std::copy_n(kernel.data, frame.length, frame.data.begin());
  return frame;
}

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

}  // namespace kmax::device
