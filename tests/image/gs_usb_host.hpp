#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <vector>

#include "drivers/can_frame.hpp"
#include "firmware/usb/gs_usb.hpp"
#include "tests/image/usb_bench.hpp"

namespace kmax::tests {

/// A PC at the CAN adapter, as Linux' gs_usb is one (drivers/net/can/usb/gs_usb.c): reads are outstanding all
/// the time, and of each channel at most ten frames are sent before their echoes have come.
class GsUsbHost {
 public:
  using Receiver =
      std::function<void(std::uint8_t channel, const drivers::CanFrame& frame, virtual_board::BoardTime now)>;
  static constexpr std::size_t channels = 2, frames_before_echo = 10, reads_outstanding = 8;

  /// What a channel has come to.
  struct Counts {
    std::uint64_t sent = 0;    ///< frames that the endpoint has taken
    std::uint64_t echoes = 0;  ///< of them
    std::uint64_t seen = 0;    ///< frames of others
    std::uint64_t strays = 0;  ///< echoes that nobody waits for, or that are not what was sent
    std::uint64_t losses = 0;  ///< times that frames before were lost
  };

  explicit GsUsbHost(UsbBench& bench) : bench_(bench) {}
  ~GsUsbHost() {
    stop_reading();
    for (auto& writes : writes_) cancel_all(writes);
  }
  GsUsbHost(const GsUsbHost&) = delete;
  GsUsbHost& operator=(const GsUsbHost&) = delete;

  /// A driver's first requests, behind SET_CONFIGURATION.
  bool bind() {
    for (std::uint8_t channel = 0; channel < channels; ++channel) forget(channel);
    const bool configured = bench_.configure();
    ending_ = {};
    return configured && is_done(bench_.control({0x41, 0, 1, 0, 0, 0, 4, 0}, little_endian({0xBEEF})));
  }
  /// 1 Mbit/s, as a PC would have it.
  bool open(std::uint8_t channel) {
    forget(channel);
    return is_done(bench_.control({0x41, 1, channel, 0, 0, 0, 20, 0}, little_endian({5, 8, 7, 1, 2}))) &&
           set_mode(channel, 1);
  }
  /// The device keeps none of it; what has no echo yet will have none.
  bool close(std::uint8_t channel) {
    forget(channel);
    return set_mode(channel, 0);
  }
  bool set_mode(std::uint8_t channel, std::uint32_t mode) {
    const bool done = is_done(bench_.control({0x41, 2, channel, 0, 0, 0, 8, 0}, little_endian({mode, 0})));
    ending_[channel] = false;
    return done;
  }

  void start_reading() {
    reading_ = true;
    for (std::size_t i = reads_.size(); i < reads_outstanding; ++i) read();
  }
  void stop_reading() {
    reading_ = false;
    cancel_all(reads_);
  }
  /// Frames of others, not echoes.
  void on_frame(Receiver receiver) { receiver_ = std::move(receiver); }

  /// Goes when fewer than ten of its channel are without their echo.
  void send(std::uint8_t channel, const drivers::CanFrame& frame) {
    waiting_[channel].push_back(frame);
    send_waiting(channel);
  }
  std::size_t waiting(std::uint8_t channel) const { return waiting_[channel].size(); }
  std::size_t without_echo(std::uint8_t channel) const { return under_way_[channel].size(); }
  /// Called when a frame has its echo: for who sends without end.
  void on_echo(std::function<void(std::uint8_t channel)> listener) { on_echo_ = std::move(listener); }
  const Counts& counts(std::uint8_t channel) const { return counts_[channel]; }

  /// s from a request to the answer of the node's SDO server; nothing: none within `most`.
  std::optional<double> sdo_round_trip(std::uint8_t channel, const drivers::CanFrame& request,
                                       double most = 0.2) {
    std::optional<double> took;
    const double begin = virtual_board::seconds(bench_.board->now());
    const Receiver others = receiver_;
    receiver_ = [&](std::uint8_t of, const drivers::CanFrame& frame, virtual_board::BoardTime now) {
      const bool answers =
          of == channel && frame.identifier == request.identifier - 0x80 &&
          std::equal(frame.data.begin() + 1, frame.data.begin() + 4, request.data.begin() + 1);
      if (answers && !took) {
        took = virtual_board::seconds(now) - begin;
        answer_ = frame;
      }
      if (others) others(of, frame, now);
    };
    send(channel, request);
    for (double waited = 0.0; !took && waited < most; waited += 20e-6) bench_.board->run_for(20e-6);
    receiver_ = others;
    return took;
  }
  /// The last one's.
  const drivers::CanFrame& answer() const { return answer_; }

 private:
  static bool is_done(const virtual_board::UsbTransferResult& result) {
    return result.end == virtual_board::UsbTransferEnd::done;
  }

  /// Kept among those under way until it ends, which may be at once.
  void submit(virtual_board::UsbTransfer wanted, std::set<std::uint64_t>& under_way,
              std::function<void(const virtual_board::UsbTransferResult&, virtual_board::BoardTime)> on_end) {
    struct State {
      std::uint64_t number = 0;
      bool ended = false;
    };
    const auto state = std::make_shared<State>();
    wanted.address = bench_.address;
    wanted.on_end = [state, &under_way, on_end = std::move(on_end)](
                        const virtual_board::UsbTransferResult& result, virtual_board::BoardTime now) {
      state->ended = true;
      under_way.erase(state->number);
      on_end(result, now);
    };
    state->number = bench_.port().submit(std::move(wanted), bench_.board->now());
    if (!state->ended) under_way.insert(state->number);
  }
  void cancel_all(std::set<std::uint64_t>& under_way) {
    while (!under_way.empty()) bench_.port().cancel(*under_way.begin(), bench_.board->now());
  }

  void read() {
    submit({.endpoint = UsbBench::can_in, .in = true, .length = 64}, reads_,
           [this](const virtual_board::UsbTransferResult& result, virtual_board::BoardTime now) {
             if (!is_done(result)) return;
             take(result.data, now);
             if (reading_) read();
           });
  }

  void take(const Bytes& bytes, virtual_board::BoardTime now) {
    if (bytes.size() != firmware::usb::gs::frame_bytes) {
      ADD_FAILURE() << "a frame of " << bytes.size() << " bytes";
      return;
    }
    const firmware::usb::gs::HostFrame frame = firmware::usb::gs::decoded(bytes);
    if (frame.channel >= channels) {
      ADD_FAILURE() << "a frame of channel " << +frame.channel;
      return;
    }
    Counts& counts = counts_[frame.channel];
    if ((frame.flags & firmware::usb::gs::flag_overflow) != 0) ++counts.losses;
    if (frame.echo == firmware::usb::gs::no_echo) {
      ++counts.seen;
      if (receiver_) receiver_(frame.channel, frame.frame, now);
      return;
    }
    const auto found = under_way_[frame.channel].find(frame.echo);
    if (found == under_way_[frame.channel].end() || !(found->second == frame.frame)) {
      if (!ending_[frame.channel]) ++counts.strays;
      return;
    }
    ++counts.echoes;
    under_way_[frame.channel].erase(found);
    send_waiting(frame.channel);
    if (on_echo_) on_echo_(frame.channel);
  }

  void send_waiting(std::uint8_t channel) {
    while (!waiting_[channel].empty() && under_way_[channel].size() < frames_before_echo) {
      const drivers::CanFrame frame = waiting_[channel].front();
      waiting_[channel].pop_front();
      const std::uint32_t echo = next_echo_++;
      under_way_[channel][echo] = frame;
      const auto bytes = firmware::usb::gs::encoded({.echo = echo, .channel = channel, .frame = frame});
      submit({.endpoint = UsbBench::can_out, .data = Bytes(bytes.begin(), bytes.end())}, writes_[channel],
             [this, channel](const virtual_board::UsbTransferResult& result, virtual_board::BoardTime) {
               if (is_done(result)) ++counts_[channel].sent;
             });
    }
  }

  /// Until the device has heard that the session ends, its echoes may come.
  void forget(std::uint8_t channel) {
    ending_[channel] = true;
    waiting_[channel].clear();
    cancel_all(writes_[channel]);
    under_way_[channel].clear();
  }

  UsbBench& bench_;
  Receiver receiver_;
  std::function<void(std::uint8_t)> on_echo_;
  drivers::CanFrame answer_{};
  std::set<std::uint64_t> reads_;
  std::array<std::set<std::uint64_t>, channels> writes_;
  std::array<std::deque<drivers::CanFrame>, channels> waiting_;
  std::array<std::map<std::uint32_t, drivers::CanFrame>, channels> under_way_;
  std::array<Counts, channels> counts_{};
  std::array<bool, channels> ending_{};
  std::uint32_t next_echo_ = 1;
  bool reading_ = false;
};

}  // namespace kmax::tests
