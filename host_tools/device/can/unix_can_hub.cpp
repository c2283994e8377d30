#include "host_tools/device/can/unix_can_hub.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/epoll.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <filesystem>

#include "host_tools/device/can/can_port.hpp"
#include "host_tools/device/link.hpp"

namespace kmax::device {

namespace {
[[noreturn]] void fail_hub(const std::string& path, const std::string& words) {
  throw LinkError(fmt::format("{}: {}", path, words));
}

sockaddr_un socket_address(const std::string& path) {
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  if (path.empty() || path.size() >= sizeof address.sun_path)
    fail_hub(path, fmt::format("the path has {} characters; a socket's can have 1 to {}", path.size(),
                               sizeof address.sun_path - 1));
  std::copy(path.begin(), path.end(), address.sun_path);
  return address;
}

/// Somebody accepts, or could.
bool is_served(const sockaddr_un& address) {
  const base::FileDescriptor probe(socket(AF_UNIX, SOCK_SEQPACKET | SOCK_CLOEXEC | SOCK_NONBLOCK, 0));
  return connect(probe.number(), reinterpret_cast<const sockaddr*>(&address), sizeof address) == 0 ||
         errno != ECONNREFUSED;
}

/// The system's own size holds some 200 frames, 0.05 s of four PDOs a millisecond; beyond its limit only root
/// gets it. What waits for a client counts against the sender (unix(7)), whatever the client's SO_RCVBUF.
void ask_for_room(int client) {
  const int bytes = 4 << 20;
  if (setsockopt(client, SOL_SOCKET, SO_SNDBUFFORCE, &bytes, sizeof bytes) != 0)
    setsockopt(client, SOL_SOCKET, SO_SNDBUF, &bytes, sizeof bytes);
}

void watch(int events, int descriptor) {
  epoll_event event{};
  event.events = EPOLLIN;
  event.data.fd = descriptor;
  epoll_ctl(events, EPOLL_CTL_ADD, descriptor, &event);
}

unsigned long long inode_at(const std::string& path) {
  struct stat status {};
  return lstat(path.c_str(), &status) == 0 && S_ISSOCK(status.st_mode) ? status.st_ino : 0;
}
}  // namespace

UnixCanHub::UnixCanHub(const std::string& path) : path_(path) {
  listen_at_path();
  events_ = base::FileDescriptor(epoll_create1(EPOLL_CLOEXEC));
  if (!events_) fail_hub(path_, fmt::format("cannot serve a CAN bus: {}", std::strerror(errno)));
  watch(events_.number(), listener_.number());
}

/// bind() shows a socket in the file system before listen() lets anybody connect to it (unix(7)): a client
/// that had waited for the path was refused, and a second hub took the first for dead. So it is bound beside
/// the path and linked there when it listens.
void UnixCanHub::listen_at_path() {
  const sockaddr_un address = socket_address(path_);
  const auto fail = [this] {
    fail_hub(path_, fmt::format("cannot make a socket for the CAN bus: {}", std::strerror(errno)));
  };
  const std::filesystem::path parent = std::filesystem::path(path_).parent_path();
  const base::FileDescriptor folder(
      open(parent.empty() ? "." : parent.c_str(), O_PATH | O_DIRECTORY | O_CLOEXEC));
  listener_ = base::FileDescriptor(socket(AF_UNIX, SOCK_SEQPACKET | SOCK_CLOEXEC | SOCK_NONBLOCK, 0));
  if (!folder || !listener_) fail();
  const std::string name = fmt::format(".kmax-{}-{}", getpid(), listener_.number());
  // By the folder's descriptor, so that a path of the full length leaves room for the longer name.
  const sockaddr_un beside = socket_address(fmt::format("/proc/self/fd/{}/{}", folder.number(), name));
  if (bind(listener_.number(), reinterpret_cast<const sockaddr*>(&beside), sizeof beside) != 0) fail();
  const auto link_it = [&] { return linkat(folder.number(), name.c_str(), AT_FDCWD, path_.c_str(), 0) == 0; };
  try {
    if (listen(listener_.number(), 64) != 0) fail();
    if (!link_it()) {
      if (errno != EEXIST) fail();
      if (inode_at(path_) == 0)
        fail_hub(path_, "there is something here that is not a socket; give another path for the CAN bus");
      if (is_served(address))
        fail_hub(path_, "another program serves a CAN bus here; end that one or give another path");
      unlink(path_.c_str());
      if (!link_it()) fail();
    }
  } catch (...) {
    unlinkat(folder.number(), name.c_str(), 0);
    throw;
  }
  unlinkat(folder.number(), name.c_str(), 0);
  inode_ = inode_at(path_);
}

UnixCanHub::~UnixCanHub() {
  if (inode_ != 0 && inode_at(path_) == inode_) unlink(path_.c_str());
}

void UnixCanHub::admit() {
  for (;;) {
    base::FileDescriptor client(accept4(listener_.number(), nullptr, nullptr, SOCK_CLOEXEC | SOCK_NONBLOCK));
    if (!client) return;
    watch(events_.number(), client.number());
    ask_for_room(client.number());
    const int number = client.number();
    clients_.emplace(number, std::move(client));
  }
}

void UnixCanHub::deliver(const can_frame& frame, int except) {
  for (const auto& [number, client] : clients_) {
    if (number == except) continue;
    // One that has just left is noticed when it is read from.
    if (::send(number, &frame, sizeof frame, MSG_NOSIGNAL | MSG_DONTWAIT) < 0 &&
        (errno == EAGAIN || errno == ENOBUFS))
      ++counters_.lost;
  }
}

bool UnixCanHub::drain(int client, std::vector<drivers::CanFrame>& frames) {
  for (int i = 0; i < frames_per_client; ++i) {
    can_frame kernel{};
    const ssize_t got = recv(client, &kernel, sizeof kernel, MSG_TRUNC);
    if (got < 0) return errno == EAGAIN || errno == EINTR;
    if (got == 0) return false;
    const auto frame = got == static_cast<ssize_t>(sizeof kernel) ? from_kernel(kernel) : std::nullopt;
    if (!frame) {
      ++counters_.malformed;
      continue;
    }
    ++counters_.received;
    deliver(to_kernel(*frame), client);
    frames.push_back(*frame);
  }
  return true;
}

std::vector<drivers::CanFrame> UnixCanHub::poll() {
  admit();
  std::vector<drivers::CanFrame> frames;
  std::vector<int> left;
  for (const auto& [number, client] : clients_) {
    if (!drain(number, frames)) left.push_back(number);
  }
  for (const int number : left) clients_.erase(number);
  return frames;
}

void UnixCanHub::send(const drivers::CanFrame& frame) {
  deliver(to_kernel(frame), -1);
}

}  // namespace kmax::device
