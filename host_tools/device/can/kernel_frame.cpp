#include "host_tools/device/can/kernel_frame.hpp"

#include <algorithm>

namespace kmax::link {

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
  drivers::CanFrame frame;
  frame.extended = (kernel.can_id & CAN_EFF_FLAG) != 0;
  frame.remote = (kernel.can_id & CAN_RTR_FLAG) != 0;
  frame.identifier = kernel.can_id & CAN_EFF_MASK;
  frame.length = kernel.can_dlc;
  if (!frame.valid()) return std::nullopt;
  if (!frame.remote) std::copy_n(kernel.data, frame.length, frame.data.begin());
  return frame;
}

}  // namespace kmax::link
