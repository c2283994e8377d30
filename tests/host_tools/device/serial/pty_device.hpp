#pragma once

#include <fcntl.h>
#include <poll.h>
#include <pty.h>
#include <sys/socket.h>
#include <termios.h>
#include <unistd.h>

#include <array>
#include <atomic>
#include <functional>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

#include "firmware/modbus/crc.hpp"
#include "firmware/modbus/server.hpp"
#include "tests/host_tools/fake_device.hpp"

namespace kmax::host_tools_test {

/// A device at the other end of a real pseudo-terminal, served by a thread through the firmware's Modbus
/// server. `misbehave` may replace an answer: it gets the number of the request, from 1, and the answer.
class PtyDevice {
 public:
  using Bytes = std::vector<std::uint8_t>;
  struct Answer {
    Bytes bytes;
    bool hang_up = false;
  };

  explicit PtyDevice(std::function<Answer(int request, Bytes answer)> misbehave = {})
      : misbehave_(std::move(misbehave)) {
    std::array<char, 128> name{};
    if (openpty(&master_, &slave_, name.data(), nullptr, nullptr) != 0)
      throw std::runtime_error("openpty failed");
    termios raw{};
    tcgetattr(slave_, &raw);
    cfmakeraw(&raw);
    tcsetattr(slave_, TCSANOW, &raw);
    path_ = name.data();
    if (pipe(wake_) != 0) throw std::runtime_error("pipe failed");
    thread_ = std::thread([this] { serve(); });
  }

  ~PtyDevice() {
    close(wake_[1]);
    thread_.join();
    close(wake_[0]);
    if (master_ >= 0) close(master_);
    close(slave_);
  }

  const std::string& path() const { return path_; }
  int requests() const { return requests_; }
  FakeDevice& device() { return device_; }

 private:
  static std::size_t request_length(const Bytes& bytes) {
    const std::size_t within = bytes.size() > 1 && bytes[1] == 65 ? 3 : 0;
    if (bytes.size() < within + 7) return 0;
    if (bytes[within + 1] == 43) return within + 7;
    if (bytes[within + 1] == 16) return within + 9u + bytes[within + 6];
    return within + 8;
  }

  Bytes answer_to(const Bytes& request) {
    if (firmware::modbus::crc_of(request) != 0 || request[0] != 1) return {};
    firmware::modbus::Server server(device_);
    std::array<std::uint8_t, firmware::modbus::pdu_size_max> response{};
    const auto pdu = std::span(request).subspan(1, request.size() - 3);
    const auto length = server.process(pdu, response);
    Bytes frame{request[0]};
    frame.insert(frame.end(), response.begin(), response.begin() + static_cast<std::ptrdiff_t>(length));
    return device::with_crc(std::move(frame));
  }

  void serve() {
    Bytes received;
    for (;;) {
      std::array<pollfd, 2> sources{{{master_, POLLIN, 0}, {wake_[0], POLLIN, 0}}};
      if (poll(sources.data(), sources.size(), -1) < 0 || sources[1].revents != 0) return;
      std::array<std::uint8_t, 512> bytes{};
      const auto count = read(master_, bytes.data(), bytes.size());
      if (count <= 0) return;
      received.insert(received.end(), bytes.begin(), bytes.begin() + count);
      const auto length = request_length(received);
      if (length == 0 || received.size() < length) continue;
      const Bytes request(received.begin(), received.begin() + static_cast<std::ptrdiff_t>(length));
      received.clear();
      const int number = ++requests_;
      Answer answer{answer_to(request)};
      if (misbehave_) answer = misbehave_(number, answer.bytes);
      if (answer.hang_up) {
        close(master_);
        master_ = -1;
        return;
      }
      if (!answer.bytes.empty() && write(master_, answer.bytes.data(), answer.bytes.size()) < 0) return;
    }
  }

  std::function<Answer(int, Bytes)> misbehave_;
  FakeDevice device_;
  std::string path_;
  int master_ = -1, slave_ = -1;
  int wake_[2] = {-1, -1};
  std::atomic<int> requests_ = 0;
  std::thread thread_;
};

}  // namespace kmax::host_tools_test
