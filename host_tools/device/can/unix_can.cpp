#include "host_tools/device/can/unix_can.hpp"

#include <fmt/format.h>
#include <sys/socket.h>
#include <sys/un.h>

#include <algorithm>
#include <cerrno>
#include <cstring>

#include "host_tools/base/file_descriptor.hpp"
#include "host_tools/device/link.hpp"

namespace kmax::device {

namespace {
using Clock = std::chrono::steady_clock;
using std::chrono::microseconds;

std::string last_error_text(int error) {
  switch (error) {
    case ENOENT:
      return "there is no bus at this path; start one with 'kmax serve --can PATH'";
    case ECONNREFUSED:
      return "nobody serves this bus any more; start it again with 'kmax serve --can PATH'";
    case ENOTSOCK:
    case EPROTOTYPE:
      return "this is not a CAN bus's socket; give the path that 'kmax serve --can PATH' was given";
    case EACCES:
    case EPERM:
      return "you may not use this bus; its owner is who started it";
    case EAGAIN:
      return "the program that serves this bus does not accept anybody; look whether it hangs";
    default:
      return std::strerror(error);
  }
}
}  // namespace

UnixCan::UnixCan(const std::string& path, const CanPortOptions& options)
    : path_(path),
      options_(options),
      socket_(socket(AF_UNIX, SOCK_SEQPACKET | SOCK_CLOEXEC | SOCK_NONBLOCK, 0)) {
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  if (path.size() >= sizeof address.sun_path)
    throw LinkError(fmt::format("{}: the path has {} characters; a socket's can have {}", path, path.size(),
                                sizeof address.sun_path - 1));
  std::copy(path.begin(), path.end(), address.sun_path);
  if (!socket_ || connect(socket_.number(), reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0)
    throw LinkError(fmt::format("{}: {}", path, last_error_text(errno)));
}

void UnixCan::send(const drivers::CanFrame& frame) {
  const can_frame kernel = to_kernel(frame);
  const auto deadline = Clock::now() + options_.send_patience;
  bool waited = false;
  for (;;) {
    if (::send(socket_.number(), &kernel, sizeof kernel, MSG_NOSIGNAL) ==
        static_cast<ssize_t>(sizeof kernel)) {
      ++counters_.sent;
      return;
    }
    const int error = errno;
    if (error == EINTR) continue;
    if (error == EPIPE || error == ECONNRESET || error == ENOTCONN) fail_closed();
    if (error != EAGAIN && error != ENOBUFS)
      throw LinkError(fmt::format("{}: cannot send: {}", path_, std::strerror(error)));
    const auto left = std::chrono::duration_cast<microseconds>(deadline - Clock::now());
    if (left <= microseconds(0))
      throw SendQueueFull(
          fmt::format("{}: the bus took no frame for {} ms; look whether the program that serves it hangs",
                      path_, options_.send_patience.count()));
    if (!waited) ++counters_.send_waits;
    waited = true;
    base::wait_for(socket_.number(), POLLOUT, left);
  }
}

std::optional<Received> UnixCan::receive(microseconds wait) {
  const auto deadline = Clock::now() + wait;
  for (;;) {
    for (;;) {
      can_frame kernel{};
      const ssize_t got = recv(socket_.number(), &kernel, sizeof kernel, MSG_TRUNC);
      if (got < 0 && (errno == EAGAIN || errno == EINTR)) break;
      if (got <= 0) fail_closed();
      const auto frame = got == static_cast<ssize_t>(sizeof kernel) ? from_kernel(kernel) : std::nullopt;
      if (!frame) {
        ++counters_.malformed;
      } else if (passes(*frame, options_.filters)) {
        ++counters_.received;
        return Received{*frame, std::chrono::system_clock::now().time_since_epoch()};
      }
      // Frames for others must not hold the caller.
      if (wait > microseconds(0) && Clock::now() >= deadline) return std::nullopt;
    }
    const auto left = std::chrono::duration_cast<microseconds>(deadline - Clock::now());
    if (left <= microseconds(0)) return std::nullopt;
    base::wait_for(socket_.number(), POLLIN, left);
  }
}

void UnixCan::fail_closed() const {
  throw LinkError(fmt::format(
      "{}: the bus was closed: the program that served it has ended; start it and try again", path_));
}

}  // namespace kmax::device
