#pragma once

#include <chrono>
#include <optional>
#include <span>
#include <stdexcept>

#include "host_tools/device/device.hpp"
#include "host_tools/view/server/command_queue.hpp"
#include "host_tools/view/server/messages.hpp"

namespace kmax::view {

/// What was going on ended because something more urgent came: the force has been taken.
class ForceRemoved : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// Takes the force of every axis as soon as it is urgent, between two requests of whatever else is going on:
/// the quick stop of CiA 402, first for the axes that a client has armed. Belongs to the thread of the link.
class ForceRemoval {
 public:
  /// Both must outlive it.
  ForceRemoval(device::Link& link, CommandQueue& commands) : link_(link), commands_(commands) {}

  /// If it is urgent, takes the force; settle() has to follow. device::LinkError if the device does not
  /// answer: then it is urgent still.
  void remove_if_urgent();
  /// The same before every request: throws ForceRemoved if it took the force.
  void interrupt_if_urgent();
  /// The force has been taken, and settle() has not followed yet.
  bool removed() const { return removed_.has_value(); }
  /// Before these are written: throws ForceRemoved if that would arm an axis between the two. What was going
  /// on may go on to tidy up.
  void refuse_to_arm(std::span<const device::SlotValue> values) const;

  struct Settled {
    StopReport report;
    std::vector<Command> revoked;  ///< commands to arm, of before
  };
  /// If the force was taken: makes sure that no axis is armed, and leaves those of a client that is gone
  /// disarmed.
  std::optional<Settled> settle(device::Device& device);

 private:
  std::vector<std::size_t> axes_in_order() const;

  device::Link& link_;
  CommandQueue& commands_;
  bool removing_ = false;
  std::optional<Urgency> removed_;
  std::chrono::steady_clock::time_point answered_{};
};

/// Disarms what clients have armed, each axis even if another one fails; the first failure is then thrown:
/// device::LinkError, base::DeviceError. An axis that failed stays its client's.
void disarm_of_clients(device::Device& device, CommandQueue& commands);

}  // namespace kmax::view
