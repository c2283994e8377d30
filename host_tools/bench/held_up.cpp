#include "host_tools/bench/held_up.hpp"

#include <fmt/format.h>

#include "host_tools/base/errors.hpp"
#include "host_tools/device/drive.hpp"

namespace kmax::bench {

namespace {
constexpr device::Parameter uptime = device::Parameter::of<"info.uptime">();

/// Nobody and nothing but a silent link took the force away.
bool in_order(const device::DriveStatus& status) {
  const bool stopped = status.state() == firmware::DriveState::quick_stop_active;
  return !stopped && (!status.faulty() || heard_nothing(status));
}
}  // namespace

bool heard_nothing(const device::DriveStatus& status) {
  return device::fault_of(status) == firmware::Fault::link_silent;
}

bool stood_still(const std::exception& error) {
  return dynamic_cast<const base::StoodStill*>(&error) != nullptr;
}

void require_another_try(int silences, const HeldUp& held_up) {
  if (silences < most_silences) return;
  throw base::DeviceError(
      fmt::format("{} times in a row the device heard nothing for {} s and removed the force: this program "
                  "or the link was held up for so long; try again when this computer has less to do",
                  silences, base::number_text(held_up.silence)));
}

void Standstill::begin() {
  uptime_ = device_.read(uptime);
}

bool Standstill::make_ready(const std::exception& error, std::string& why) const {
  const bool without_a_fault =
      dynamic_cast<const device::LinkError*>(&error) != nullptr || stood_still(error);
  why = error.what();
  bool silent = false;
  for (const std::size_t axis : axes_) {
    const device::DriveStatus status = device::Drive(device_, axis).status();
    if (!in_order(status)) return false;
    if (!heard_nothing(status)) continue;
    silent = true;
    why = fmt::format("the device heard nothing for {} s and removed the force",
                      base::number_text(status.fault_value));
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

bool Standstill::cut_off(const std::exception& error, const std::string& name) const {
  std::string why;
  try {
    if (!make_ready(error, why)) return false;
  } catch (const std::exception&) {
    return false;  // what ended the work is what matters
  }
  if (notice_)
    notice_(
        fmt::format("{}: this touch is thrown away and made again, since this computer or the link stood "
                    "still: {}",
                    name, why));
  return true;
}

}  // namespace kmax::bench
