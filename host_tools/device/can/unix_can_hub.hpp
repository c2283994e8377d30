#pragma once

#include <map>
#include <string>
#include <vector>

#include "drivers/can_frame.hpp"
#include "host_tools/base/file_descriptor.hpp"

struct can_frame;

namespace kmax::device {

/// Serves a CAN bus at a Unix domain socket (unix_can.hpp): what one client sends goes to all others and to
/// the owner; what the owner sends goes to all clients. Belongs to one thread; frames move only in poll().
///
/// A bus without bits: no arbitration, no errors, no acknowledgement, no bit rate. A client that does not
/// fetch its frames loses them, like a controller whose receive queue is full; the others do not wait for it.
class UnixCanHub {
 public:
  struct Counters {
    std::uint64_t received = 0;   ///< frames from clients
    std::uint64_t lost = 0;       ///< frames a client did not get because its queue was full
    std::uint64_t malformed = 0;  ///< messages that are no classical CAN frame
  };

  /// A socket that nobody serves any more is replaced; anything else at `path` is left alone and refused.
  /// Errors: LinkError.
  explicit UnixCanHub(const std::string& path);
  /// Removes the socket.
  ~UnixCanHub();
  UnixCanHub(const UnixCanHub&) = delete;
  UnixCanHub& operator=(const UnixCanHub&) = delete;

  /// Admits clients, moves frames, and returns them in the order of arrival. Does not wait. At most
  /// `frames_per_client` of each client, so that one that floods the bus keeps out nobody: call it again
  /// while it returns some.
  std::vector<drivers::CanFrame> poll();
  static constexpr int frames_per_client = 64;

  void send(const drivers::CanFrame& frame);

  /// Readable when poll() has something to do.
  int descriptor() const { return events_.number(); }
  std::size_t clients() const { return clients_.size(); }
  const std::string& path() const { return path_; }
  const Counters& counters() const { return counters_; }

 private:
  using Clients = std::map<int, base::FileDescriptor>;

  void listen_at_path();
  void admit();
  void deliver(const can_frame& frame, int except);
  /// False: it has left.
  bool drain(int client, std::vector<drivers::CanFrame>& frames);

  std::string path_;
  base::FileDescriptor listener_, events_;
  unsigned long long inode_ = 0;  ///< of the socket, so that nobody else's is removed
  Clients clients_;
  Counters counters_;
};

}  // namespace kmax::device
