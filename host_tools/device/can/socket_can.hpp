#pragma once

#include "host_tools/base/file_descriptor.hpp"
#include "host_tools/device/can/can_faults.hpp"
#include "host_tools/device/can/can_port.hpp"

struct can_frame;

namespace kmax::device {

/// A CAN interface of the kernel (SocketCAN, Documentation/networking/can.rst): a raw socket bound to it,
/// with the kernel's filters and its own time stamps (taken when the frame came in, not when it was read).
///
/// Error frames of the controller are never handed out: trouble() says them in words.
///
/// A queue that is full (ENOBUFS: ten frames deep on most interfaces) is waited for, counted, and given up
/// after CanPortOptions::send_patience: then the bus does not move, because nobody acknowledges.
class SocketCan final : public CanPort {
 public:
  /// Errors: LinkError if there is no such interface, it is not a CAN interface, it is down, or the kernel
  /// has no CAN.
  explicit SocketCan(const std::string& interface, const CanPortOptions& options = {});

  void send(const drivers::CanFrame& frame) override;
  std::optional<Received> receive(std::chrono::microseconds wait) override;
  int descriptor() const override { return socket_.number(); }
  std::string description() const override { return interface_; }
  std::string trouble() const override { return faults_.words(interface_); }
  bool bus_off() const override { return faults_.bus_off(); }

 private:
  void open();
  void check_up() const;
  void set_filters();
  bool fetch(can_frame& frame, std::chrono::nanoseconds& time);
  [[noreturn]] void fail(const char* doing, int error) const;

  std::string interface_;
  CanPortOptions options_;
  base::FileDescriptor socket_;
  CanFaults faults_;
};

/// Names of the CAN interfaces of this machine, up or down.
std::vector<std::string> can_interfaces();

}  // namespace kmax::device
