#include "host_tools/device/can/socket_can.hpp"

#include <fmt/format.h>
#include <linux/can.h>
#include <linux/can/error.h>
#include <linux/can/raw.h>
#include <net/if.h>
#include <net/if_arp.h>
#include <sys/ioctl.h>
#include <sys/socket.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <ctime>
#include <filesystem>
#include <fstream>
#include <thread>

#include "host_tools/base/file_descriptor.hpp"
#include "host_tools/device/link.hpp"

namespace kmax::device {

namespace {
using Clock = std::chrono::steady_clock;
using std::chrono::microseconds;
using std::chrono::nanoseconds;

bool is_virtual(const std::string& interface) {
  return interface.starts_with("vcan") || interface.starts_with("vxcan");
}

std::string words_for_bringing_up(const std::string& interface) {
  return is_virtual(interface)
             ? fmt::format("'sudo ip link set {} up'", interface)
             : fmt::format("'sudo ip link set {} up type can bitrate 1000000' (the device's can.bit_rate)",
                           interface);
}

std::string words_for_missing(const std::string& interface) {
  const auto others = can_interfaces();
  const std::string there = others.empty()
                                ? std::string("there are no CAN interfaces here")
                                : fmt::format("CAN interfaces here are {}", fmt::join(others, ", "));
  const std::string remedy =
      is_virtual(interface)
          ? fmt::format("make it with 'sudo ip link add dev {0} type vcan' and 'sudo ip link set {0} up'",
                        interface)
          : "check the adapter and its driver; a bus at a Unix socket is written with a '/', as in can:./bus";
  return fmt::format("there is no such interface; {}; {}", there, remedy);
}

constexpr const char* words_for_no_can =
    "this kernel has no CAN sockets; try 'sudo modprobe can_raw', or use a bus at a Unix socket (a name with "
    "a '/', as in can:./bus)";
}  // namespace

std::vector<std::string> can_interfaces() {
  std::vector<std::string> names;
  std::error_code ignored;
  for (const auto& entry : std::filesystem::directory_iterator("/sys/class/net", ignored)) {
    int type = 0;
    if (std::ifstream(entry.path() / "type") >> type && type == ARPHRD_CAN)
      names.push_back(entry.path().filename());
  }
  std::sort(names.begin(), names.end());
  return names;
}

SocketCan::SocketCan(const std::string& interface, const CanPortOptions& options)
    : interface_(interface), options_(options) {
  open();
  check_up();
}

void SocketCan::open() {
  socket_ = base::FileDescriptor(socket(PF_CAN, SOCK_RAW | SOCK_CLOEXEC | SOCK_NONBLOCK, CAN_RAW));
  if (!socket_) fail("cannot use this interface", errno);
  const unsigned index = interface_.size() < IFNAMSIZ ? if_nametoindex(interface_.c_str()) : 0;
  if (index == 0) throw LinkError(fmt::format("{}: {}", interface_, words_for_missing(interface_)));

  set_filters();  // before bind(): nothing that is not wanted is queued
  const can_err_mask_t all_errors = CAN_ERR_MASK;
  if (setsockopt(socket_.number(), SOL_CAN_RAW, CAN_RAW_ERR_FILTER, &all_errors, sizeof all_errors) != 0)
    fail("cannot listen for error frames", errno);
  const int on = 1;
  if (setsockopt(socket_.number(), SOL_SOCKET, SO_TIMESTAMPNS, &on, sizeof on) != 0)
    fail("cannot get time stamps", errno);
  // The kernel's own size holds some 300 frames, less than 0.1 s of four PDOs a millisecond: a program that
  // does not get the processor for longer would lose some. Beyond the system's limit only root gets it.
  const int receive_bytes = 4 << 20;
  if (setsockopt(socket_.number(), SOL_SOCKET, SO_RCVBUFFORCE, &receive_bytes, sizeof receive_bytes) != 0)
    setsockopt(socket_.number(), SOL_SOCKET, SO_RCVBUF, &receive_bytes, sizeof receive_bytes);
  // Without it lost frames go unnoticed; an old kernel that refuses it still works.
  setsockopt(socket_.number(), SOL_SOCKET, SO_RXQ_OVFL, &on, sizeof on);

  sockaddr_can address{};
  address.can_family = AF_CAN;
  address.can_ifindex = static_cast<int>(index);
  if (bind(socket_.number(), reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0) {
    if (errno == ENODEV)
      throw LinkError(
          fmt::format("{}: this is not a CAN interface; {}", interface_, words_for_missing(interface_)));
    fail("cannot use this interface", errno);
  }
}

void SocketCan::check_up() const {
  ifreq request{};
  std::copy(interface_.begin(), interface_.end(), request.ifr_name);
  if (ioctl(socket_.number(), SIOCGIFFLAGS, &request) == 0 && (request.ifr_flags & IFF_UP) == 0)
    throw LinkError(fmt::format("{}: the interface is down; bring it up: {}", interface_,
                                words_for_bringing_up(interface_)));
}

void SocketCan::set_filters() {
  if (options_.filters.empty()) return;
  std::vector<can_filter> filters;
  for (const CanFilter& filter : options_.filters)
    filters.push_back({filter.identifier, (filter.mask & CAN_SFF_MASK) | CAN_EFF_FLAG | CAN_RTR_FLAG});
  if (setsockopt(socket_.number(), SOL_CAN_RAW, CAN_RAW_FILTER, filters.data(),
                 static_cast<socklen_t>(filters.size() * sizeof(can_filter))) != 0)
    fail("cannot set filters", errno);
}

void SocketCan::send(const drivers::CanFrame& frame) {
  const can_frame kernel = to_kernel(frame);
  const auto deadline = Clock::now() + options_.send_patience;
  bool waited = false;
  for (;;) {
    if (write(socket_.number(), &kernel, sizeof kernel) == static_cast<ssize_t>(sizeof kernel)) {
      ++counters_.sent;
      return;
    }
    const int error = errno;
    if (error == EINTR) continue;
    if (error != ENOBUFS && error != EAGAIN) fail("cannot send", error);
    if (Clock::now() >= deadline) {
      const std::string reason = trouble();
      throw SendQueueFull(fmt::format(
          "{}: the interface took no frame for {} ms (its queue is full): {}", interface_,
          options_.send_patience.count(),
          reason.empty()
              ? "probably nobody acknowledges frames; check that the device is powered, the wiring "
                "and the bit rate; if the bus is only busy, 'sudo ip link set " +
                    interface_ + " txqueuelen 1000' makes the queue longer"
              : reason));
    }
    if (!waited) ++counters_.send_waits;
    waited = true;
    // Room in the socket (POLLOUT) is not room in the interface's queue, which cannot be waited for: a frame
    // takes at least 47 bit times, about 50 us at 1 Mbit/s.
    base::wait_for(socket_.number(), POLLOUT, microseconds(1000));
    std::this_thread::sleep_for(microseconds(200));
  }
}

bool SocketCan::fetch(can_frame& frame, nanoseconds& time) {
  iovec data{&frame, sizeof frame};
  alignas(cmsghdr) std::array<char, CMSG_SPACE(sizeof(timespec)) + CMSG_SPACE(sizeof(std::uint32_t))> control;
  msghdr message{};
  message.msg_iov = &data;
  message.msg_iovlen = 1;
  message.msg_control = control.data();
  message.msg_controllen = control.size();
  const ssize_t got = recvmsg(socket_.number(), &message, MSG_DONTWAIT);
  if (got < 0) {
    if (errno == EAGAIN || errno == EINTR) return false;
    fail("cannot receive", errno);
  }
  // No frame is empty: the socket has come to its end, and would give nothing for ever.
  if (got == 0) fail("cannot receive", ENODEV);
  time = std::chrono::system_clock::now().time_since_epoch();
  for (cmsghdr* header = CMSG_FIRSTHDR(&message); header != nullptr; header = CMSG_NXTHDR(&message, header)) {
    if (header->cmsg_level != SOL_SOCKET) continue;
    if (header->cmsg_type == SCM_TIMESTAMPNS) {
      timespec stamp{};
      std::memcpy(&stamp, CMSG_DATA(header), sizeof stamp);
      time = std::chrono::seconds(stamp.tv_sec) + nanoseconds(stamp.tv_nsec);
    } else if (header->cmsg_type == SO_RXQ_OVFL) {
      std::uint32_t lost = 0;  // since the socket was opened
      std::memcpy(&lost, CMSG_DATA(header), sizeof lost);
      counters_.lost = lost;
    }
  }
  if (got != static_cast<ssize_t>(sizeof frame)) frame.can_dlc = 0xFF;  // counted as malformed
  return true;
}

std::optional<Received> SocketCan::receive(microseconds wait) {
  const auto deadline = Clock::now() + wait;
  for (;;) {
    can_frame kernel{};
    Received received;
    while (fetch(kernel, received.time)) {
      const bool error = (kernel.can_id & CAN_ERR_FLAG) != 0;
      const auto frame = error ? std::nullopt : from_kernel(kernel);
      if (error) {
        ++counters_.error_frames;
        faults_.take(kernel);
      } else if (!frame) {
        ++counters_.malformed;
      }
      if (!frame) {
        // A disturbed bus must not hold the caller.
        if (wait > microseconds(0) && Clock::now() >= deadline) return std::nullopt;
        continue;
      }
      faults_.frame_received();
      ++counters_.received;
      received.frame = *frame;
      return received;
    }
    const auto left = std::chrono::duration_cast<microseconds>(deadline - Clock::now());
    if (left <= microseconds(0)) return std::nullopt;
    base::wait_for(socket_.number(), POLLIN, left);
  }
}

void SocketCan::fail(const char* doing, int error) const {
  std::string words = std::strerror(error);
  switch (error) {
    case EAFNOSUPPORT:
    case EPROTONOSUPPORT:
      words = words_for_no_can;
      break;
    case ENETDOWN:
      words = fmt::format("the interface is down; bring it up: {}", words_for_bringing_up(interface_));
      break;
    case ENODEV:
    case ENXIO:
      words = "the interface vanished; check the adapter and try again";
      break;
    case EPERM:
    case EACCES:
      words = "not allowed; the interface may be in listen-only mode ('sudo ip link set " + interface_ +
              " type can listen-only off'), or a security policy forbids CAN sockets";
      break;
    default:
      break;
  }
  throw LinkError(fmt::format("{}: {}: {}", interface_, doing, words));
}

}  // namespace kmax::device
