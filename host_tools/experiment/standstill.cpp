#include "host_tools/experiment/standstill.hpp"

#include <fmt/format.h>

#include <utility>

#include "host_tools/base/errors.hpp"
#include "host_tools/base/numbers.hpp"
#include "host_tools/device/drive.hpp"

namespace kmax::experiment {

namespace {
constexpr device::Parameter uptime = device::Parameter::of<"info.uptime">();

bool heard_nothing(const device::DriveStatus& status) {
  return device::fault_of(status) == firmware::Fault::link_silent;
}

/// Nobody and nothing but a silent link took the force away.
bool in_order(const device::DriveStatus& status) {
  const bool stopped = status.state() == firmware::DriveState::quick_stop_active;
  return !stopped && (!status.faulty() || heard_nothing(status));
}
}  // namespace

Standstill::Standstill(device::Device& device, std::vector<std::size_t> axes, Tell notice)
    : device_(device), axes_(std::move(axes)), notice_(std::move(notice)) {}

void Standstill::touch_begins() {
  uptime_ = device_.read(uptime);
}

bool Standstill::make_ready(const std::exception& error, std::string& why) const {
  const bool without_a_fault = dynamic_cast<const link::LinkError*>(&error) != nullptr ||
                               dynamic_cast<const device::StoodStill*>(&error) != nullptr;
  why = error.what();
  bool silent = false;
  for (const std::size_t axis : axes_) {
    const device::DriveStatus status = device::Drive(device_, axis).status();
    if (!in_order(status)) return false;
    if (!heard_nothing(status)) continue;
    silent = true;
    why = fmt::format("the device heard nothing for {} s and removed the force",
                      device::number_text(status.fault_value));
  }
  if (!silent && !without_a_fault) return false;
  if (device_.read(uptime) < uptime_) return false;
  for (const std::size_t axis : axes_) device::Drive(device_, axis).disarm();
  for (const std::size_t axis : axes_) {
    device::Drive drive(device_, axis);
    // What has tripped an axis since the first look is not to be cleared.
    const device::DriveStatus status = drive.status();
    if (!in_order(status)) return false;
    if (heard_nothing(status)) drive.clear();
  }
  return true;
}

bool Standstill::cut_off(const std::exception& error, const std::string& touch) const {
  std::string why;
  try {
    if (!make_ready(error, why)) return false;
  } catch (const std::exception&) {
    return false;  // what ended the touch is what is to be told
  }
  if (notice_)
    notice_(fmt::format(
        "{}: this touch is thrown away and made again, since this computer or the link stood still: {}",
        touch, why));
  return true;
}

}  // namespace kmax::experiment
