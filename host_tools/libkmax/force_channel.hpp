#pragma once

#include <kmax/device.hpp>

#include <memory>
#include <optional>

#include "host_tools/libkmax/session.hpp"
#include "host_tools/record/row.hpp"

namespace kmax::library {

/// How a force loop talks to a device in each cycle.
///
/// Over CAN: a SYNC, which TPDO 1 to 4 answer with what the device measures, and the force in RPDO 3. SDO
/// carries none of it, so that others can use the node's server meanwhile. Over other links: one reading, one
/// writing.
class ForceChannel {
 public:
  ForceChannel() = default;
  ForceChannel(const ForceChannel&) = delete;
  ForceChannel& operator=(const ForceChannel&) = delete;
  /// Puts back what it has set up, as far as the device can be reached.
  virtual ~ForceChannel() = default;

  /// What the device measures now; none if no complete answer comes within `patience`.
  virtual std::optional<record::AxisSample> sample(std::chrono::microseconds patience) = 0;
  /// N at the handle.
  virtual void send(float force) = 0;
  /// s of the cycle so far that were spent in talking.
  virtual double round_trip() const = 0;
  /// So fast can it go, Hz.
  virtual double highest_rate() const = 0;
};

/// For an axis that is not armed, which must keep what this sets up. Errors: DeviceError for settings of
/// somebody's own that are in the way.
std::unique_ptr<ForceChannel> open_force_channel(Session& session, std::size_t axis);

/// Puts the PDOs back that a force loop of a killed program has left over CAN, unless an axis is armed: then
/// another program's loop may be going on.
void put_back_left_pdos(Session& session);

}  // namespace kmax::library
