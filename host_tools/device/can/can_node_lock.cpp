#include "host_tools/device/can/can_node_lock.hpp"

#include <fmt/format.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>

#include <algorithm>
#include <cerrno>
#include <cstddef>
#include <cstring>

#include "host_tools/device/can/can_port.hpp"

namespace kmax::device {

namespace {
/// The same for all names of a bus: paths are told apart by what they lead to.
std::string key_of(const std::string& bus, std::uint8_t node) {
  struct stat status {};
  if (is_socket_path(bus) && stat(bus.c_str(), &status) == 0)
    return fmt::format("kmax/can/{:x}:{:x}/node/{}", status.st_dev, status.st_ino, node);
  return fmt::format("kmax/can/{}/node/{}", bus, node);
}

struct LockAddress {
  sockaddr_un address{};
  socklen_t length = 0;
};

LockAddress lock_address(const std::string& key) {
  LockAddress result;
  result.address.sun_family = AF_UNIX;
  // The first character stays zero: an abstract name.
  const std::size_t length = std::min(key.size(), sizeof result.address.sun_path - 1);
  std::copy_n(key.begin(), length, result.address.sun_path + 1);
  result.length = static_cast<socklen_t>(offsetof(sockaddr_un, sun_path) + 1 + length);
  return result;
}

base::FileDescriptor make_socket() {
  return base::FileDescriptor(socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0));
}
}  // namespace

CanNodeLock::CanNodeLock(const std::string& bus, std::uint8_t node)
    : bus_(bus), node_(node), key_(key_of(bus, node)) {}

CanNodeLock::CanNodeLock(const std::string& bus, std::uint8_t node, const Notice& notice)
    : CanNodeLock(bus, node) {
  take(notice);
}

std::unique_ptr<CanNodeLock> CanNodeLock::try_to_take(const std::string& bus, std::uint8_t node) {
  std::unique_ptr<CanNodeLock> lock(new CanNodeLock(bus, node));
  if (!lock->try_take()) lock.reset();
  return lock;
}

bool CanNodeLock::try_take() {
  const LockAddress address = lock_address(key_);
  base::FileDescriptor attempt = make_socket();
  if (bind(attempt.number(), reinterpret_cast<const sockaddr*>(&address.address), address.length) != 0) {
    if (errno == EADDRINUSE) return false;
    throw LinkError(fmt::format("{}: cannot be reserved for this program: {}", name(), std::strerror(errno)));
  }
  listen(attempt.number(), 16);  // so that others can ask whose it is
  socket_ = std::move(attempt);
  return true;
}

std::string CanNodeLock::name() const {
  return fmt::format("node {} on {}", node_, bus_);
}

std::string CanNodeLock::words_for_in_use() const {
  const LockAddress address = lock_address(key_);
  const base::FileDescriptor question = make_socket();
  ucred holder{};
  socklen_t size = sizeof holder;
  std::string who = "another program";
  if (connect(question.number(), reinterpret_cast<const sockaddr*>(&address.address), address.length) == 0 &&
      getsockopt(question.number(), SOL_SOCKET, SO_PEERCRED, &holder, &size) == 0 && holder.pid > 0)
    who += fmt::format(" (process {})", holder.pid);
  return fmt::format("it is in use by {}; end that one and try again", who);
}

}  // namespace kmax::device
