#pragma once

#include "host_tools/device/device.hpp"

namespace kmax::device {

/// Handle travel per encoder count of an axis, m, from the parameters: the reading measured.count_length is
/// rounded to float. Errors as Device.
double count_length(Device& device, std::size_t axis);

}  // namespace kmax::device
