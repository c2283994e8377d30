#include "host_tools/libkmax/session.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include "host_tools/base/errors.hpp"
#include "host_tools/base/numbers.hpp"
#include "host_tools/device/sim/open_link.hpp"

namespace kmax::library {

namespace {
std::unique_ptr<SharedLink> open_shared(const link::DeviceAddress& address, const DeviceOptions& options) {
  return std::make_unique<SharedLink>(link::open_link(address, options.notice),
                                      address.kind == link::DeviceAddress::Kind::sim, options.poll);
}

DeviceOptions with_notice(DeviceOptions options) {
  if (!options.notice)
    options.notice = [](const std::string& text) { fmt::print(stderr, "kmax: {}\n", text); };
  return options;
}
}  // namespace

Session::Session(const link::DeviceAddress& where, DeviceOptions wanted)
    : address(where),
      options(with_notice(std::move(wanted))),
      process(getpid()),
      opened_(nullptr),
      device(
          [this] {
            auto shared = open_shared(address, options);
            opened_ = shared.get();
            return shared;
          }(),
          options.notice) {}

Session::~Session() {
  for (std::size_t axis = 0; axis < axes_.size(); ++axis) {
    if (!axes_[axis].armed) continue;
    try {
      disarm(axis);
    } catch (const std::exception& error) {
      options.notice(fmt::format("axis {} could not be disarmed: {}; link.timeout removes its force", axis,
                                 error.what()));
    }
  }
}

bool Session::is_of_this_process() const {
  return getpid() == process;
}

void Session::require_axis(std::size_t axis) const {
  if (axis >= firmware::axis_count)
    throw device::ValueError(
        fmt::format("there is no axis {}; axes are 0 to {}", axis, firmware::axis_count - 1));
}

void Session::arm(std::size_t axis, bool keep_alive) {
  require_axis(axis);
  const double timeout = link_timeout();
  device::Drive drive(device, axis);
  const std::lock_guard lock(axes_mutex_);
  axes_[axis].keeper.reset();
  drive.arm();
  axes_[axis].armed = true;
  link().set_lending(true);
  if (timeout == 0)
    options.notice("link.timeout is 0: the force stays on until it is disarmed, even if this program dies");
  if (keep_alive && !link().virtual_time())
    axes_[axis].keeper = std::make_unique<Keeper>(link(), device, axis, timeout);
}

std::string Session::disarm(std::size_t axis) {
  require_axis(axis);
  const Uninterrupted uninterrupted;
  device::Drive drive(device, axis);
  const std::lock_guard lock(axes_mutex_);
  Axis& own = axes_[axis];
  std::string trouble = own.keeper ? own.keeper->trouble() : std::string();
  own.keeper.reset();
  const bool was_armed = std::exchange(own.armed, false);
  bool any = false;
  for (const Axis& one : axes_) any = any || one.armed;
  link().set_lending(any);
  if (was_armed && trouble.empty()) {
    const device::DriveStatus status = drive.status();
    if (!status.armed()) trouble = force_is_off(axis, status);
  }
  drive.disarm();
  return trouble;
}

void Session::require_armed_ones() {
  for (std::size_t axis = 0; axis < axes_.size(); ++axis) {
    {
      const std::lock_guard lock(axes_mutex_);
      if (!axes_[axis].armed) continue;
      // Its own thread reads the state already.
      if (axes_[axis].keeper) {
        if (const std::string trouble = axes_[axis].keeper->trouble(); !trouble.empty())
          throw device::DeviceError(trouble);
        continue;
      }
    }
    const device::DriveStatus status = device::Drive(device, axis).status();
    if (!status.armed()) throw device::DeviceError(force_is_off(axis, status));
  }
}

}  // namespace kmax::library
