#pragma once
// Which power stage a device has: what its firmware and wires are judged by.

#include <string_view>

#include "board/description.hpp"
#include "host_tools/device/device.hpp"

namespace kmax::bench {

/// The power stage of a board by the name that it gives itself; nullptr for a board without one, and for one
/// that these tools do not know.
const board::BoardDescription* power_stage_of_board(std::string_view board);

/// Of the board that answers (Link::identify, model_name). Errors: base::DeviceError with the name, what is
/// known here and what to do; device::LinkError. Cost: one request on a serial line, three on CAN.
const board::BoardDescription& power_stage_of(device::Device& device);

}  // namespace kmax::bench
