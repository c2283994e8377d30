#pragma once

#include <linux/can.h>

#include <chrono>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "drivers/can_frame.hpp"
#include "host_tools/device/link.hpp"

namespace kmax::device {

/// The bus can be used, but there was no room for a frame within CanPortOptions::send_patience.
class SendQueueFull : public LinkError {
 public:
  using LinkError::LinkError;
};

/// A frame and when it was received, since 1970 (CLOCK_REALTIME).
struct Received {
  drivers::CanFrame frame;
  std::chrono::nanoseconds time{};
};

/// Lets pass standard data frames with (identifier & mask) == (own identifier & mask).
struct CanFilter {
  std::uint32_t identifier = 0;
  std::uint32_t mask = 0x7FF;
};

struct CanPortOptions {
  std::vector<CanFilter> filters{};  ///< a frame passes if one of them lets it; none: every frame passes
  /// How long send() waits for room in the queue before it gives up.
  std::chrono::milliseconds send_patience{500};
};

struct CanPortCounters {
  std::uint64_t sent = 0;
  std::uint64_t received = 0;
  std::uint64_t send_waits = 0;    ///< times the queue was full and send() waited
  std::uint64_t lost = 0;          ///< frames the kernel dropped because they were not fetched in time
  std::uint64_t malformed = 0;     ///< what arrived and is no classical CAN frame
  std::uint64_t error_frames = 0;  ///< reports of the controller about the bus
};

/// A place on a CAN bus: frames out, frames in. Own frames do not come back. Belongs to one thread.
///
/// Errors of all calls: LinkError, when the bus cannot be used any more or not at all. It says what to do.
class CanPort {
 public:
  CanPort() = default;
  CanPort(const CanPort&) = delete;
  CanPort& operator=(const CanPort&) = delete;
  virtual ~CanPort() = default;

  /// Hands the frame to the bus; it may still be waiting there when this returns. Waits while the queue is
  /// full, up to CanPortOptions::send_patience; then SendQueueFull. The frame must be valid().
  virtual void send(const drivers::CanFrame& frame) = 0;

  /// The next frame that passes the filters; none if there is none within `wait` (0: does not wait).
  virtual std::optional<Received> receive(std::chrono::microseconds wait) = 0;

  /// Readable when receive() has something to do; for poll() and epoll().
  virtual int descriptor() const = 0;

  /// The interface's name or the socket's path, for messages.
  virtual std::string description() const = 0;

  /// What the controller has reported about the bus since the last good frame, for messages: "nobody
  /// acknowledges ...". Empty if nothing.
  virtual std::string trouble() const { return {}; }

  /// The controller has left the bus because of errors: nothing can be sent.
  virtual bool bus_off() const { return false; }

  const CanPortCounters& counters() const { return counters_; }

 protected:
  CanPortCounters counters_;
};

/// The kernel's form of a classical frame (linux/can.h), 16 bytes; also what a Unix domain bus carries.
can_frame to_kernel(const drivers::CanFrame& frame);

/// Nothing for an error frame, and for one that no bus can carry (length above 8, identifier too large).
std::optional<drivers::CanFrame> from_kernel(const can_frame& frame);

/// True if the frame passes.
bool passes(const drivers::CanFrame& frame, const std::vector<CanFilter>& filters);

/// A name with a '/' in it is a bus at a Unix domain socket (unix_can.hpp), any other is a SocketCAN
/// interface (socket_can.hpp): "can0", "vcan0", "/tmp/bus", "./bus".
bool is_socket_path(const std::string& name);
std::unique_ptr<CanPort> open_can_port(const std::string& name, const CanPortOptions& options = {});

}  // namespace kmax::device
