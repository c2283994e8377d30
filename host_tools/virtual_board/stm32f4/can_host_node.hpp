#pragma once

#include <cstdint>
#include <deque>
#include <functional>
#include <optional>

#include "host_tools/virtual_board/stm32f4/can_bus.hpp"

namespace kmax::virtual_board {

/// A node of the host on a virtual bus: sends what it is given, in order, and hands on what it hears. For
/// tests, and for a bridge to a real CAN interface.
class CanHostNode final : public CanBusNode {
 public:
  using Receiver = std::function<void(const drivers::CanFrame& frame, BoardTime now)>;

  CanHostNode(CanBus& bus, std::uint32_t bit_rate) : bus_(bus), bit_time_(units_per_second / bit_rate) {
    bus_.attach(*this);
  }
  ~CanHostNode() { bus_.detach(*this); }

  void send(const drivers::CanFrame& frame, BoardTime now) {
    queue_.push_back(frame);
    bus_.request(now);
  }
  /// Sends this frame for ever, in front of what is queued; none: stops.
  void babble(std::optional<drivers::CanFrame> frame, BoardTime now) {
    babble_ = frame;
    bus_.request(now);
  }
  void on_frame(Receiver receiver) { receiver_ = std::move(receiver); }

  /// False: hears without acknowledging.
  void set_listen_only(bool listen_only) { listen_only_ = listen_only; }
  /// False: as if unplugged.
  void set_connected(bool connected, BoardTime now) {
    connected_ = connected;
    bus_.request(now);
  }
  void set_bit_time(BoardTime bit_time, BoardTime now) {
    if (bit_time == bit_time_) return;
    bit_time_ = bit_time;
    bus_.request(now);
  }
  /// Back from bus-off, at once.
  void restart(BoardTime now) {
    errors_.reset();
    bus_.request(now);
  }

  std::size_t waiting() const { return queue_.size(); }
  std::uint64_t sent() const { return sent_; }
  std::uint64_t lost_arbitrations() const { return lost_; }
  const CanFaultConfinement& errors() const { return errors_; }

  BoardTime bit_time() const override { return connected_ && !errors_.bus_off() ? bit_time_ : 0; }
  bool drives_dominant() const override { return !listen_only_; }
  bool error_passive() const override { return errors_.passive(); }
  std::optional<drivers::CanFrame> next_frame(BoardTime) override {
    if (listen_only_) return std::nullopt;
    if (babble_) return babble_;
    return queue_.empty() ? std::nullopt : std::optional(queue_.front());
  }
  void on_result(CanOutcome outcome, BoardTime /*now*/) override {
    if (outcome == CanOutcome::arbitration_lost) {
      ++lost_;
      return;
    }
    if (outcome != CanOutcome::sent) {
      errors_.transmit_error(outcome == CanOutcome::not_acknowledged);
      return;
    }
    errors_.sent();
    ++sent_;
    if (babble_ || queue_.empty()) return;
    queue_.pop_front();
  }
  void on_received(const drivers::CanFrame& frame, BoardTime now) override {
    errors_.received();
    if (receiver_) receiver_(frame, now);
  }
  void on_receive_error(CanOutcome, BoardTime) override { errors_.receive_error(); }

 private:
  CanBus& bus_;
  BoardTime bit_time_;
  std::deque<drivers::CanFrame> queue_;
  std::optional<drivers::CanFrame> babble_;
  Receiver receiver_;
  bool listen_only_ = false, connected_ = true;
  CanFaultConfinement errors_;
  std::uint64_t sent_ = 0, lost_ = 0;
};

}  // namespace kmax::virtual_board
