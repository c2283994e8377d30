#pragma once

#include <algorithm>
#include <cstdint>
#include <memory>
#include <random>
#include <vector>

#include "firmware/modbus/rtu_port.hpp"
#include "host_tools/device/serial/tagged_exchange.hpp"
#include "tests/host_tools/fake_device.hpp"

namespace kmax::host_tools_test {

/// A man in the middle of a serial line, in virtual time: between a client and the firmware's own Modbus port
/// at 115,200 baud. In both directions he delays, doubles, drops, truncates, corrupts and reorders frames,
/// each with `share` of probability, late by up to `latest`.
class HostileLine final : public device::ByteLine {
 public:
  using Bytes = std::vector<std::uint8_t>;
  struct Disturbances {
    bool delay = false, twice = false, drop = false, truncate = false, corrupt = false, reorder = false;
    double share = 0.2;
  };

  HostileLine(Disturbances disturbances, unsigned seed, Time latest)
      : disturbances_(disturbances), latest_(latest), random_(seed) {}

  FakeDevice& device() { return *device_; }
  int disturbed() const { return disturbed_; }

  Time now() const override { return now_; }
  void send(std::span<const std::uint8_t> frame) override { carry(to_device_, {frame.begin(), frame.end()}); }
  Bytes receive(Time until) override {
    for (;;) {
      const Time next = std::min(first(to_device_), first(to_client_));
      if (next > until) {
        now_ = std::max(now_, until);
        return {};
      }
      now_ = std::max(now_, next);
      if (first(to_client_) <= next) return take(to_client_);
      serve(take(to_device_));
    }
  }

 private:
  struct Frame {
    Time at;  ///< when its last character is there
    Bytes bytes;
  };
  using Way = std::vector<Frame>;

  static Time first(const Way& way) {
    Time earliest = Time::max();
    for (const Frame& frame : way) earliest = std::min(earliest, frame.at);
    return earliest;
  }
  static Bytes take(Way& way) {
    const auto frame =
        std::min_element(way.begin(), way.end(), [](const Frame& a, const Frame& b) { return a.at < b.at; });
    Bytes bytes = std::move(frame->bytes);
    way.erase(frame);
    return bytes;
  }

  bool happens(bool possible) {
    const bool now = possible && std::uniform_real_distribution<>(0, 1)(random_) < disturbances_.share;
    disturbed_ += now ? 1 : 0;
    return now;
  }
  Time up_to(Time most) { return Time(std::uniform_int_distribution<Time::rep>(0, most.count())(random_)); }

  void carry(Way& way, Bytes bytes) {
    if (happens(disturbances_.drop)) return;
    if (happens(disturbances_.truncate))
      bytes.resize(static_cast<std::size_t>(up_to(Time(static_cast<Time::rep>(bytes.size()) - 1)).count()));
    if (happens(disturbances_.corrupt) && !bytes.empty())
      bytes[static_cast<std::size_t>(up_to(Time(static_cast<Time::rep>(bytes.size()) - 1)).count())] ^= 0x10;
    if (bytes.empty()) return;
    Time at = now_ + transmission(bytes);
    // On a line that keeps the order nothing overtakes what is late.
    if (happens(disturbances_.delay)) at += up_to(latest_);
    if (!disturbances_.reorder)
      for (const Frame& frame : way) at = std::max(at, frame.at + transmission(bytes));
    else if (happens(true))
      at += up_to(latest_);
    way.push_back({at, bytes});
    if (!happens(disturbances_.twice)) return;
    const Time later = at + transmission(bytes) + up_to(latest_);
    way.push_back({later, bytes});
  }

  static Time transmission(const Bytes& bytes) {
    return Time(95 * static_cast<Time::rep>(bytes.size()) + 2000);
  }

  /// The frame's last character is there; the silence after it follows.
  void serve(const Bytes& request) {
    auto clock = static_cast<std::uint32_t>(now_.count());
    std::uint32_t end = clock - static_cast<std::uint32_t>(95 * request.size());
    for (const std::uint8_t byte : request) port_.receive(byte, false, end += 95);
    clock += 2500;
    port_.poll(clock);
    const auto reply = port_.reply_due(clock);
    if (reply.empty()) return;
    carry(to_client_, {reply.begin(), reply.end()});
    port_.reply_sent();
  }

  Disturbances disturbances_;
  Time latest_;
  std::mt19937 random_;
  std::shared_ptr<FakeDevice> device_ = std::make_shared<FakeDevice>();
  firmware::modbus::RtuPort<FakeDevice> port_{*device_};
  Time now_{1'000'000};
  Way to_device_, to_client_;
  int disturbed_ = 0;
};

}  // namespace kmax::host_tools_test
