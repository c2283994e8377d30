#pragma once

#include <fcntl.h>
#include <poll.h>
#include <unistd.h>

#include <functional>
#include <map>
#include <mutex>
#include <optional>
#include <stdexcept>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "host_tools/device/can/unix_can_hub.hpp"
#include "tests/host_tools/device/can/fake_sdo_server.hpp"
#include "tests/host_tools/temporary_folder.hpp"

namespace kmax::host_tools_test {

inline drivers::CanFrame frame_of(std::uint32_t identifier, std::vector<std::uint8_t> data) {
  drivers::CanFrame frame{.identifier = identifier, .length = static_cast<std::uint8_t>(data.size())};
  std::copy(data.begin(), data.end(), frame.data.begin());
  return frame;
}

/// A bus at a Unix socket with nodes whose SDO servers answer, served by a thread. `misbehave` may replace
/// what is sent: it gets each answer with its number from 1 on, and returns what goes on the bus instead.
/// After a frame with the identifier `hang_up` the bus is closed.
class FakeSdoNode {
 public:
  using Frames = std::vector<drivers::CanFrame>;
  using Misbehave = std::function<Frames(int number, drivers::CanFrame answer)>;
  using Object = FakeSdoServer::Object;
  using Bytes = FakeSdoServer::Bytes;
  using Abort = FakeSdoServer::Abort;
  static constexpr std::uint32_t hang_up = 0x1FFF'FFFF;

  explicit FakeSdoNode(Misbehave misbehave = {}, std::vector<std::uint8_t> nodes = {5})
      : misbehave_(std::move(misbehave)), path_((folder_ / "bus").string()) {
    hub_.emplace(path_);
    for (const std::uint8_t node : nodes) {
      FakeSdoServer& server = servers_[node];
      server.read = [this](Object object) { return read(object); };
      server.write = [this](Object object, const Bytes& value) { return write(object, value); };
    }
    put({0x1000, 0}, {0x92, 0x01, 0xFF, 0xFF});
    put({0x1001, 0}, {0});
    put({0x1018, 0}, {4});
    put({0x1018, 1}, {0, 0, 0, 0});
    if (pipe(wake_) != 0) throw std::runtime_error("pipe failed");
  }

  ~FakeSdoNode() {
    close(wake_[1]);
    if (thread_.joinable()) thread_.join();
    close(wake_[0]);
  }

  /// Begins to serve. Until then the objects and servers may be set up.
  void start() {
    thread_ = std::thread([this] { serve(); });
  }

  const std::string& path() const { return path_; }
  FakeSdoServer& server(std::uint8_t node = 5) { return servers_.at(node); }

  void put(Object object, Bytes value) {
    const std::lock_guard guard(mutex_);
    values_[key_of(object)] = std::move(value);
  }
  Bytes get(Object object) {
    const std::lock_guard guard(mutex_);
    return values_[key_of(object)];
  }
  /// Answers reading, or writing, this object with an abort.
  void refuse(Object object, Abort code) {
    const std::lock_guard guard(mutex_);
    refused_[key_of(object)] = code;
  }
  std::vector<Object> written() {
    const std::lock_guard guard(mutex_);
    return written_;
  }
  /// Requests to SDO servers, first bytes.
  std::vector<std::uint8_t> commands() {
    const std::lock_guard guard(mutex_);
    return commands_;
  }
  std::size_t count(std::uint8_t command) {
    const auto all = commands();
    return static_cast<std::size_t>(std::count(all.begin(), all.end(), command));
  }

  /// Instead of the values, when set before start().
  std::function<std::variant<Bytes, Abort>(Object)> on_read;
  std::function<Abort(Object, const Bytes&)> on_write;
  /// Called for every frame on the bus; what it returns is sent.
  std::function<Frames(const drivers::CanFrame&)> on_frame;

 private:
  static std::pair<std::uint16_t, std::uint8_t> key_of(Object object) {
    return {object.index, object.subindex};
  }

  std::variant<Bytes, Abort> read(Object object) {
    if (on_read) return on_read(object);
    const std::lock_guard guard(mutex_);
    if (const auto refused = refused_.find(key_of(object)); refused != refused_.end()) return refused->second;
    const auto found = values_.find(key_of(object));
    if (found == values_.end()) return Abort::no_object;
    return found->second;
  }
  Abort write(Object object, const Bytes& value) {
    if (on_write) return on_write(object, value);
    const std::lock_guard guard(mutex_);
    if (const auto refused = refused_.find(key_of(object)); refused != refused_.end()) return refused->second;
    values_[key_of(object)] = value;
    written_.push_back(object);
    return Abort::none;
  }

  bool send(const Frames& frames) {
    for (const auto& frame : frames) {
      if (frame.identifier == hang_up) {
        hub_.reset();
        return false;
      }
      hub_->send(frame);
    }
    return true;
  }

  void serve() {
    for (;;) {
      std::array<pollfd, 2> sources{{{hub_->descriptor(), POLLIN, 0}, {wake_[0], POLLIN, 0}}};
      if (poll(sources.data(), sources.size(), -1) < 0 || sources[1].revents != 0) return;
      for (const auto& frame : hub_->poll()) {
        if (on_frame && !send(on_frame(frame))) return;
        const auto node = static_cast<std::uint8_t>(frame.identifier & 0x7F);
        if ((frame.identifier & 0x780) != 0x600 || !servers_.contains(node)) continue;
        {
          const std::lock_guard guard(mutex_);
          commands_.push_back(frame.data[0]);
        }
        for (const auto& data : servers_[node].handle(frame.data)) {
          const auto answer = frame_of(0x580u + node, {data.begin(), data.end()});
          const int number = ++answers_;
          if (!send(misbehave_ ? misbehave_(number, answer) : Frames{answer})) return;
        }
      }
    }
  }

  TemporaryFolder folder_;
  Misbehave misbehave_;
  std::string path_;
  std::optional<device::UnixCanHub> hub_;
  std::map<std::uint8_t, FakeSdoServer> servers_;
  std::mutex mutex_;
  std::map<std::pair<std::uint16_t, std::uint8_t>, Bytes> values_;
  std::map<std::pair<std::uint16_t, std::uint8_t>, Abort> refused_;
  std::vector<Object> written_;
  std::vector<std::uint8_t> commands_;
  int answers_ = 0;
  int wake_[2] = {-1, -1};
  std::thread thread_;
};

}  // namespace kmax::host_tools_test
