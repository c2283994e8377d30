#include "host_tools/record/telemetry_request.hpp"

#include <fmt/format.h>

#include <array>

#include "host_tools/device/lock.hpp"

namespace kmax::record {

using device::Parameter;

namespace {
constexpr std::array event_times = {Parameter::of<"tpdo1.event_time">(), Parameter::of<"tpdo2.event_time">(),
                                    Parameter::of<"tpdo3.event_time">(), Parameter::of<"tpdo4.event_time">()};
constexpr std::uint32_t wanted_ms = 1;
}  // namespace

TelemetryRequest::~TelemetryRequest() {
  try {
    put_back();
  } catch (const std::exception& error) {
    notice_(fmt::format(
        "the event times of TPDO 1 to 4 could not be put back to {} ms, so that the device may go on filling "
        "the bus until its communication is reset: {}",
        event_times[0].default_raw(), error.what()));
  }
}

bool TelemetryRequest::ask() {
  device::Device device = connect_();
  const auto found = device.read(event_times);
  for (std::size_t i = 0; i < found.size(); ++i) {
    if (found[i] != event_times[i].default_raw()) return false;
  }
  if (device::Lock(device).status().state == device::LockState::locked) return false;
  asked_ = true;
  for (const Parameter& time : event_times) device.write(time, wanted_ms, true);
  return true;
}

void TelemetryRequest::put_back() {
  if (!asked_) return;
  asked_ = false;
  device::Device device = connect_();
  const auto found = device.read(event_times);
  for (std::size_t i = 0; i < found.size(); ++i) {
    if (found[i] == wanted_ms) device.write(event_times[i], event_times[i].default_raw(), true);
  }
}

}  // namespace kmax::record
