#include "host_tools/serve/can_connection.hpp"

#include <fmt/format.h>

#include "host_tools/device/link.hpp"

namespace kmax::serve {

using std::chrono::microseconds;

namespace {
/// A full queue must not hold the simulation.
const device::CanPortOptions options{.send_patience = std::chrono::milliseconds(0)};
}  // namespace

CanConnection::CanConnection(const std::string& name) : name_(name) {
  if (device::is_socket_path(name)) {
    hub_ = std::make_unique<device::UnixCanHub>(name);
  } else {
    port_ = device::open_can_port(name, options);
  }
}

bool CanConnection::connected() {
  if (hub_ || port_) return true;
  const auto now = std::chrono::steady_clock::now();
  if (now < next_attempt_) return false;
  next_attempt_ = now + std::chrono::milliseconds(200);
  try {
    port_ = device::open_can_port(name_, options);
  } catch (const device::LinkError&) {
  }
  return port_ != nullptr;
}

std::vector<drivers::CanFrame> CanConnection::received() {
  if (hub_) return hub_->poll();
  std::vector<drivers::CanFrame> frames;
  if (!connected()) return frames;
  try {
    while (frames.size() < device::UnixCanHub::frames_per_client) {
      const auto received = port_->receive(microseconds(0));
      if (!received) break;
      frames.push_back(received->frame);
    }
  } catch (const device::LinkError&) {
    port_.reset();
  }
  return frames;
}

void CanConnection::send(const drivers::CanFrame& frame) {
  if (hub_) return hub_->send(frame);
  if (!connected()) return;
  try {
    port_->send(frame);
  } catch (const device::SendQueueFull&) {
    ++lost_;
  } catch (const device::LinkError&) {
    port_.reset();
  }
}

int CanConnection::descriptor() const {
  if (hub_) return hub_->descriptor();
  return port_ ? port_->descriptor() : -1;
}

std::string CanConnection::address(unsigned node_id) const {
  return fmt::format("can:{}?node={}", name_, node_id);
}

}  // namespace kmax::serve
