#pragma once

#include <chrono>
#include <memory>
#include <string>
#include <vector>

#include "drivers/can_frame.hpp"
#include "host_tools/device/can/can_port.hpp"
#include "host_tools/device/can/unix_can_hub.hpp"

namespace kmax::serve {

/// The far end of a device's CAN transceiver: a SocketCAN interface by its name, or, if the name holds a '/',
/// a bus that is served at that Unix domain socket. Belongs to one thread.
///
/// Errors: device::LinkError, at the start only. An interface that goes down later is a cable that is pulled
/// out: frames are lost until it is up again, which is looked for five times a second. A bus that takes no
/// frame now (nobody acknowledges, a client that does not fetch) loses it: the simulation does not wait.
class CanConnection {
 public:
  explicit CanConnection(const std::string& name);
  CanConnection(const CanConnection&) = delete;
  CanConnection& operator=(const CanConnection&) = delete;

  /// What others have sent since the last call; does not wait.
  std::vector<drivers::CanFrame> received();
  void send(const drivers::CanFrame& frame);

  /// Frames that were not sent: the queue was full.
  std::uint64_t lost() const { return hub_ ? hub_->counters().lost : lost_; }

  /// Readable when received() has something to give; -1 while the interface is down.
  int descriptor() const;
  /// The address of a device on this bus, as a user gives it.
  std::string address(unsigned node_id) const;

 private:
  bool connected();

  std::string name_;
  std::unique_ptr<device::UnixCanHub> hub_;  // one of the two
  std::unique_ptr<device::CanPort> port_;    // null while the interface is down
  std::chrono::steady_clock::time_point next_attempt_;
  std::uint64_t lost_ = 0;
};

}  // namespace kmax::serve
