#include "host_tools/libkmax/session.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>

#include "host_tools/base/errors.hpp"
#include "host_tools/base/numbers.hpp"
#include "host_tools/device/disarm_failure.hpp"
#include "host_tools/device/sim/open_link.hpp"

namespace kmax::library {

namespace {
std::unique_ptr<SharedLink> open_shared(const device::DeviceAddress& address, const DeviceOptions& options) {
  return std::make_unique<SharedLink>(device::open_link(address, options.notice),
                                      address.kind == device::DeviceAddress::Kind::sim, options.poll);
}

DeviceOptions with_notice(DeviceOptions options) {
  if (!options.notice)
    options.notice = [](const std::string& text) { fmt::print(stderr, "kmax: {}\n", text); };
  return options;
}
}  // namespace

Session::Session(const device::DeviceAddress& where, DeviceOptions wanted)
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
          options.notice) {
  if (!link().virtual_time()) lender_ = std::jthread([this](const std::stop_token& stop) { lend(stop); });
}

Session::~Session() {
  for (std::size_t axis = 0; axis < axes_.size(); ++axis) {
    if (!axes_[axis].armed) continue;
    try {
      disarm(axis);
    } catch (const std::exception& error) {
      options.notice(disarm_failure(axis, error.what()));
    }
  }
}

std::string Session::disarm_failure(std::size_t axis, std::string_view why) const {
  return fmt::format("axis {}: {}", axis, device::words_for_disarm_failure(axes_[axis].timeout, why));
}

void Session::require_axis(std::size_t axis) const {
  if (axis >= firmware::axis_count)
    throw base::ValueError(
        fmt::format("there is no axis {}; axes are 0 to {}", axis, firmware::axis_count - 1));
}

void Session::arm(std::size_t axis, bool keep_alive) {
  require_axis(axis);
  const double timeout = link_timeout();
  // Without the lock: while it waits, the program's own signal handlers run, which may disarm.
  device::Drive(device, axis).arm();
  const std::lock_guard lock(axes_mutex_);
  axes_[axis].keeper.reset();
  axes_[axis].armed = true;
  axes_[axis].timeout = timeout;
  if (timeout == 0)
    options.notice("link.timeout is 0: the force stays on until it is disarmed, even if this program dies");
  if (keep_alive && !link().virtual_time())
    axes_[axis].keeper = std::make_unique<Keeper>(device, axis, timeout);
  note_kept_alive();
}

std::string Session::disarm(std::size_t axis) {
  require_axis(axis);
  const Uninterrupted uninterrupted;
  device::Drive drive(device, axis);
  const std::lock_guard lock(axes_mutex_);
  Axis& own = axes_[axis];
  std::string trouble = own.keeper ? own.keeper->trouble() : std::string();
  own.keeper.reset();
  note_kept_alive();
  if (own.armed && trouble.empty()) {
    try {
      const device::DriveStatus status = drive.status();
      if (!status.armed()) trouble = force_is_off(axis, status);
    } catch (const std::exception&) {
      // A lost answer must not keep the force on: it is taken away, whatever it was before.
    }
  }
  drive.disarm();
  own.armed = false;  // not if that failed: the destructor tries again
  return trouble;
}

void Session::note_kept_alive() {
  kept_alive_ = std::ranges::any_of(axes_, [](const Axis& one) { return one.keeper != nullptr; });
}

void Session::lend(const std::stop_token& stop) {
  using std::chrono::milliseconds;
  const Uninterrupted uninterrupted;
  // A look at any axis is a sign of life for all of them.
  const auto sign_of_life = [this] {
    if (!kept_alive_) return;
    try {
      device.read(device::Parameter::of<"drive.statusword">(0));
    } catch (const std::exception&) {
      // The keeper will find that out, too, and tells of it.
    }
  };
  while (!stop.stop_requested()) {
    milliseconds pause{5};
    try {
      link().lend_if_idle(sign_of_life);
    } catch (const std::exception&) {
      // Somebody has not given it back, and each attempt makes this program's own requests wait for it.
      pause = milliseconds(10000);
    }
    std::unique_lock lock(lender_mutex_);
    lender_ended_.wait_for(lock, stop, pause, [] { return false; });
  }
}

void Session::require_armed_ones() {
  for (std::size_t axis = 0; axis < axes_.size(); ++axis) {
    {
      const std::lock_guard lock(axes_mutex_);
      if (!axes_[axis].armed) continue;
      // Its own thread reads the state already.
      if (axes_[axis].keeper) {
        if (const std::string trouble = axes_[axis].keeper->trouble(); !trouble.empty())
          throw base::DeviceError(trouble);
        continue;
      }
    }
    const device::DriveStatus status = device::Drive(device, axis).status();
    if (!status.armed()) throw base::DeviceError(force_is_off(axis, status));
  }
}

}  // namespace kmax::library
