#pragma once

#include <string>
#include <vector>

#include "firmware/command/fault_log.hpp"
#include "host_tools/device/device.hpp"

namespace kmax::device {

/// The device's fault log (firmware/command/fault_log.hpp), the newest entry first; each is whole. Errors:
/// DeviceError, and as Link.
std::vector<firmware::LogEntry> read_fault_log(device::Link& link);

/// Refused while an axis is armed. Errors: DeviceError, device::LinkError.
void erase_fault_log(Device& device);

/// s since the start that the entry names: of a trip to the tick, which is 32 bits wide and wraps after 60 h.
double time_of(const firmware::LogEntry& entry);

/// A number of a trip.
inline float number_of(const firmware::LogEntry& entry, firmware::TripNumber which) {
  return std::bit_cast<float>(entry.numbers[static_cast<std::size_t>(which)]);
}

/// What crashed before a start; its count is 0 if nothing did.
firmware::CrashRecord crash_before(const firmware::LogEntry& entry);

/// "link_silent", "reset by the watchdog".
std::string name_of(const firmware::LogEntry& entry);

}  // namespace kmax::device
