#pragma once

#include "host_tools/base/file_descriptor.hpp"
#include "host_tools/device/can/can_port.hpp"

namespace kmax::device {

/// A CAN bus without a kernel that has CAN: a Unix domain socket (SOCK_SEQPACKET) that carries `struct
/// can_frame`, one in each message, served by a UnixCanHub in `kmax serve` or `kmax-board`.
///
/// Frames go in order and are not lost, except to a client that does not fetch them. Time stamps are taken
/// when a frame is fetched.
class UnixCan final : public CanPort {
 public:
  /// Errors: LinkError if nobody serves a bus at this path.
  explicit UnixCan(const std::string& path, const CanPortOptions& options = {});

  void send(const drivers::CanFrame& frame) override;
  std::optional<Received> receive(std::chrono::microseconds wait) override;
  int descriptor() const override { return socket_.number(); }
  std::string description() const override { return path_; }

 private:
  [[noreturn]] void fail_closed() const;

  std::string path_;
  CanPortOptions options_;
  base::FileDescriptor socket_;
};

}  // namespace kmax::device
