#pragma once

#include "firmware/fault.hpp"
#include "host_tools/device/drive.hpp"

namespace kmax::device {

/// Fault::none also for an error code that this program does not know.
inline firmware::Fault fault_of(const DriveStatus& status) {
  const firmware::FaultText* text =
      status.faulty() ? firmware::fault_by_error_code(status.error_code) : nullptr;
  return text != nullptr ? text->fault : firmware::Fault::none;
}

}  // namespace kmax::device
