#pragma once

#include <deque>
#include <random>
#include <vector>

#include "host_tools/device/can/can_port.hpp"
#include "host_tools/device/can/sdo_client.hpp"
#include "host_tools/virtual_board/stm32f4/can_bus.hpp"
#include "host_tools/virtual_board/stm32f4/can_host_node.hpp"
#include "tests/image/image_bench.hpp"

namespace kmax::tests {

/// A host on the virtual board's CAN bus: the host tools' own port, in board time. Waiting runs the board.
class BoardCanPort final : public device::CanPort {
 public:
  explicit BoardCanPort(virtual_board::VirtualBoard& board, std::uint32_t bit_rate = 1'000'000)
      : board_(board), node_(board.can_bus(), bit_rate) {
    node_.on_frame([this](const drivers::CanFrame& frame, virtual_board::BoardTime now) {
      received_.push_back({frame, nanoseconds(now)});
    });
  }

  void send(const drivers::CanFrame& frame) override {
    node_.send(frame, board_.now());
    ++counters_.sent;
  }
  /// Frames carry board time, at which their last bit was over.
  std::optional<device::Received> receive(std::chrono::microseconds wait) override {
    const virtual_board::BoardTime end = board_.now() + static_cast<virtual_board::BoardTime>(wait.count()) *
                                                            (virtual_board::units_per_second / 1'000'000);
    while (received_.empty() && board_.now() < end) board_.run_for(10e-6);
    if (received_.empty()) return std::nullopt;
    const device::Received first = received_.front();
    received_.pop_front();
    ++counters_.received;
    return first;
  }
  int descriptor() const override { return -1; }
  std::string description() const override { return "the virtual board's bus"; }

  virtual_board::CanHostNode& node() { return node_; }
  void forget() { received_.clear(); }

 private:
  static std::chrono::nanoseconds nanoseconds(virtual_board::BoardTime time) {
    return std::chrono::nanoseconds(static_cast<std::int64_t>(virtual_board::seconds(time) * 1e9));
  }

  virtual_board::VirtualBoard& board_;
  virtual_board::CanHostNode node_;
  std::deque<device::Received> received_;
};

/// The client's own clock is the real one, which a busy machine makes short.
inline device::SdoSettings patient_sdo() {
  device::SdoSettings settings;
  settings.response_timeout = std::chrono::seconds(20);
  settings.block_silence = std::chrono::seconds(10);
  settings.attempts = 1;
  return settings;
}

inline drivers::CanFrame upload_request(firmware::canopen::ObjectAddress object) {
  return {.identifier = 0x601,
          .length = 8,
          .data = {0x40, static_cast<std::uint8_t>(object.index),
                   static_cast<std::uint8_t>(object.index >> 8), object.subindex}};
}

/// On the bus at 1 Mbit/s.
inline double frame_us(const drivers::CanFrame& frame) {
  return static_cast<double>(virtual_board::can_frame_bits(frame).bits.size());
}

/// ImageBench with a CANopen host beside the serial one.
class CanBench : public ImageBench {
 public:
  explicit CanBench(const Parameters& parameters = {}, double push = 0.0,
                    const std::string& scene_name = "motor_axes")
      : ImageBench(parameters, push, scene_name), port(*board), sdo(port, 1, patient_sdo()) {}

  void nmt(std::uint8_t command, std::uint8_t node = 1) {
    port.send({.identifier = firmware::canopen::cob_id::nmt, .length = 2, .data = {command, node}});
  }

  /// The next frame with this identifier within `wait_s` of board time.
  std::optional<device::Received> next(std::uint32_t identifier, double wait_s) {
    const double end = virtual_board::seconds(board->now()) + wait_s;
    while (true) {
      const double left = end - virtual_board::seconds(board->now());
      const auto received = port.receive(std::chrono::microseconds(static_cast<std::int64_t>(left * 1e6)));
      if (!received) return std::nullopt;
      if (received->frame.identifier == identifier) return received;
    }
  }

  using ImageBench::number;  // by way of the serial line, which has nothing to do with the bus
  std::uint32_t number(std::uint16_t index, std::uint8_t subindex) {
    std::uint32_t value = 0;
    const auto bytes = sdo.upload({index, subindex});
    for (std::size_t i = 0; i < bytes.size() && i < 4; ++i) value |= std::uint32_t{bytes[i]} << (8 * i);
    return value;
  }
  void write(std::uint16_t index, std::uint8_t subindex, std::uint32_t value, std::size_t size) {
    std::vector<std::uint8_t> bytes;
    for (std::size_t i = 0; i < size; ++i) bytes.push_back(static_cast<std::uint8_t>(value >> (8 * i)));
    sdo.download({index, subindex}, bytes, true);
  }
  /// All four TPDOs every millisecond.
  void ask_for_telemetry() {
    for (std::uint16_t tpdo = 0x1800; tpdo < 0x1804; ++tpdo) write(tpdo, 5, 1, 2);
  }
  /// Through the three states; the last statusword.
  std::uint32_t arm(std::size_t axis = 0) {
    const auto index = static_cast<std::uint16_t>(0x6040 + 0x800 * axis);
    for (const std::uint32_t word : {0x06U, 0x07U, 0x0FU}) {
      write(index, 0, word, 2);
      board->run_for(0.005);
    }
    return number(static_cast<std::uint16_t>(index + 1), 0);
  }

  struct RoundTrip {
    double us;      ///< from the request's first bit to the answer's last
    double own_us;  ///< of the two frames alone
  };
  /// Expedited uploads at random phases of the tick; those that were answered.
  std::vector<RoundTrip> round_trips(firmware::canopen::ObjectAddress object, std::size_t rounds) {
    std::minstd_rand random(1);
    std::vector<RoundTrip> answered;
    const drivers::CanFrame request = upload_request(object);
    double begin = 0.0;
    bool waits = false;
    virtual_board::CanHostNode host(board->can_bus(), 1'000'000);
    host.on_frame([&](const drivers::CanFrame& frame, virtual_board::BoardTime now) {
      if (!waits || frame.identifier != 0x581) return;
      waits = false;
      answered.push_back({1e6 * (virtual_board::seconds(now) - begin), frame_us(request) + frame_us(frame)});
    });
    for (std::size_t i = 0; i < rounds; ++i) {
      board->run_for(1e-3 + 50e-6 * static_cast<double>(random() % 1000) / 1000.0);
      begin = virtual_board::seconds(board->now());
      waits = true;
      host.send(request, board->now());
      for (int step = 0; step < 100 && waits; ++step) board->run_for(20e-6);
    }
    return answered;
  }

  BoardCanPort port;
  device::SdoClient sdo;
};

}  // namespace kmax::tests
