#pragma once

#include <algorithm>
#include <array>
#include <atomic>
#include <cstdint>
#include <optional>
#include <span>

#include "firmware/exchange/interrupt_queue.hpp"
#include "firmware/exchange/queue_to_interrupt.hpp"
#include "firmware/usb/descriptors.hpp"
#include "firmware/usb/endpoint_controller.hpp"
#include "firmware/usb/gs_usb.hpp"

namespace kmax::firmware::usb {

/// The channels of the CAN adapter, in the order in which a host names them.
enum class CanChannel : std::uint8_t {
  node = 0,  ///< between the host and the board's own node alone: no bus is needed, and none is touched
  bus = 1,   ///< the bus at the board's connector, on which the board's node is as well
};
inline constexpr std::size_t can_channels = 2;

/// The CAN adapter (gs_usb) between the USB interrupt and the main loop.
///
/// A frame from the host is handed to the main loop, which says when it is done; then the host has its echo.
/// While the main loop has many of them, or the host does not take what it has, the endpoint answers NAK, and
/// the host waits. Frames to the host beyond those that are kept are lost, and the next one says so.
///
/// Opening a channel begins a session of it, and so does closing it. What is under way for the session
/// before, either way, is nobody's any more: its frames do not reach the node, and whoever opens the channel
/// next sees none of them, not even the one that the host had not fetched yet.
///
/// Bit timings are looked at, so that a host hears of one that cannot be, and have no effect: the bit rate of
/// the bus is the device's setting can.bit_rate, which every node there depends on, and there is no bit rate
/// between the host and the node. Time stamps, identification and modes of the controller are refused.
template <EndpointController Controller>
class CanFunction {
 public:
  /// `can_clock_hz`: of the controller on the bus, before its prescaler.
  CanFunction(Controller& controller, std::uint32_t can_clock_hz)
      : controller_(controller), can_clock_hz_(can_clock_hz) {}

  /// Main loop: the host has opened the channel, and is there.
  bool is_open(CanChannel channel) const {
    return (open_.load(std::memory_order_relaxed) & bit_of(channel)) != 0;
  }
  /// Main loop: what did not go through, since the start.
  struct Counters {
    std::uint32_t lost = 0;     ///< frames to the host that it was too slow for
    std::uint32_t refused = 0;  ///< packets from it that were no frame, or one for a channel that is closed
  };
  Counters counters() const { return {frames_lost_, refused_.load(std::memory_order_relaxed)}; }

  /// Main loop: the next frame from the host, if there is room for its echo. The caller calls done() for each
  /// one, in the order of its channel; not before has_room_for_echo(), where others have been done meanwhile.
  bool next_from_host(gs::HostFrame& frame) { return has_room_for_echo() && from_host_.pop(frame); }
  bool has_room_for_echo() const { return to_host_.room() != 0; }
  void done(const gs::HostFrame& frame) {
    if (is_current(frame)) static_cast<void>(to_host_.push(frame));
  }
  /// Main loop: the channel that it came by, or is for, is still open, and has been since.
  bool is_current(const gs::HostFrame& frame) const {
    const auto channel = static_cast<CanChannel>(frame.channel);
    return frame.session == session(channel) && is_open(channel);
  }
  /// A frame for the host, of the channel's session as it is now.
  gs::HostFrame to_host(CanChannel channel, const drivers::CanFrame& frame) const {
    gs::HostFrame out;
    out.channel = static_cast<std::uint8_t>(channel);
    out.session = session(channel);
    out.frame = frame;
    return out;
  }
  /// Main loop: what the node sends, as the host sees it on an open channel. As many as `kept_for_echoes`
  /// more must fit.
  void show(CanChannel channel, const drivers::CanFrame& frame) {
    if (is_open(channel)) show(to_host(channel, frame), kept_for_echoes);
  }
  /// What others say on the bus, which has waited since to_host(): it does not keep out what the node says.
  void show_of_others(const gs::HostFrame& frame) { show(frame, kept_for_echoes + kept_for_node); }
  /// Some of those were lost before they came here: the next frame on the channel says so.
  void note_loss(CanChannel channel) { loss_[static_cast<std::size_t>(channel)] = {true, session(channel)}; }
  /// Main loop: show() would take one of the node's, on both channels.
  bool has_room() const { return to_host_.room() > kept_for_echoes + 1; }
  /// Main loop: rises with what the host fetches; and nothing waits for it.
  std::uint32_t fetched() const { return fetched_.load(std::memory_order_relaxed); }
  bool nothing_waits() const { return to_host_.room() == frames_to_host; }

  void ISR_start() {
    ISR_forget();
    running_ = true;
    ISR_serve();
  }
  void ISR_stop() {
    running_ = false;
    ISR_forget();
  }
  /// What the main loop has left: frames, or room for more.
  void ISR_serve() {
    if (!running_) return;
    gs::HostFrame next;
    if (in_flight_ == nothing && ISR_next_to_host(next)) {
      in_flight_ = next.channel;
      controller_.ISR_send(number_of(can_to_host.address), gs::encoded(next));
    }
    if (!receiving_ && from_host_.ISR_has_room()) {
      receiving_ = true;
      controller_.ISR_receive(number_of(can_from_host.address));
    }
  }

  std::optional<std::span<const std::uint8_t>> ISR_answer(const SetupPacket& setup,
                                                          std::span<std::uint8_t, full_packet> room) const {
    switch (static_cast<gs::Request>(setup.request)) {
      case gs::Request::device_configuration: {
        std::fill_n(room.begin(), gs::configuration_bytes, std::uint8_t{0});
        room[3] = can_channels - 1;
        gs::put_word(room, 4, software_version);
        gs::put_word(room, 8, hardware_version);
        return room.first(gs::configuration_bytes);
      }
      case gs::Request::bit_timing_constants: {
        if (setup.value >= can_channels) return std::nullopt;
        constexpr gs::TimingLimits l;
        const std::array words{gs::features,    can_clock_hz_,   l.segment_1_min, l.segment_1_max,
                               l.segment_2_min, l.segment_2_max, l.jump_max,      l.prescaler_min,
                               l.prescaler_max, l.prescaler_step};
        for (std::size_t i = 0; i < words.size(); ++i) gs::put_word(room, 4 * i, words[i]);
        return room.first(gs::constants_bytes);
      }
      default:
        return std::nullopt;
    }
  }
  bool ISR_accepts(const SetupPacket& setup) const {
    switch (static_cast<gs::Request>(setup.request)) {
      case gs::Request::host_format:
        return setup.length == gs::host_format_bytes;
      case gs::Request::bit_timing:
        return setup.length == gs::bit_timing_bytes && setup.value < can_channels;
      case gs::Request::mode:
        return setup.length == gs::mode_bytes && setup.value < can_channels;
      default:
        return false;
    }
  }
  bool ISR_take(const SetupPacket& setup, std::span<const std::uint8_t> data) {
    if (data.empty()) return false;  // each of them has some
    switch (static_cast<gs::Request>(setup.request)) {
      case gs::Request::host_format:
        return gs::word_at(data, 0) == gs::little_endian_host;
      case gs::Request::bit_timing:
        return gs::within({}, data);
      case gs::Request::mode:
        return ISR_set_mode(static_cast<CanChannel>(setup.value), gs::word_at(data, 0), gs::word_at(data, 4));
      default:
        return false;
    }
  }

  /// What is no frame, or is for a channel that is not open, is nothing.
  void ISR_received(std::span<const std::uint8_t> data) {
    receiving_ = false;
    bool taken = false;
    if (data.size() >= gs::frame_bytes) {
      gs::HostFrame frame = gs::decoded(data);
      frame.flags = 0;
      const bool open = frame.channel < can_channels && is_open(static_cast<CanChannel>(frame.channel));
      taken = open && frame.frame.valid();
      if (taken) {
        frame.session = session(static_cast<CanChannel>(frame.channel));
        from_host_.ISR_push(frame);
      }
    }
    if (!taken) refused_.store(refused_.load(std::memory_order_relaxed) + 1, std::memory_order_relaxed);
    ISR_serve();
  }
  void ISR_sent() {
    fetched_.store(fetched_.load(std::memory_order_relaxed) + 1, std::memory_order_relaxed);
    in_flight_ = nothing;
    ISR_serve();
  }
  void ISR_reopened(std::uint8_t address) {
    if (address == can_to_host.address) in_flight_ = nothing;
    if (address == can_from_host.address) receiving_ = false;
    ISR_serve();
  }

 private:
  static constexpr std::uint32_t software_version = 2, hardware_version = 1;  ///< as candleLight's
  static constexpr std::size_t frames_from_host = 8, frames_to_host = 64;
  static constexpr std::size_t kept_for_echoes = frames_from_host, kept_for_node = 16;
  static constexpr std::uint8_t nothing = 0xFF;

  struct Loss {
    bool some = false;
    std::uint8_t session = 0;
  };

  static constexpr std::uint8_t bit_of(CanChannel channel) {
    return static_cast<std::uint8_t>(1U << static_cast<unsigned>(channel));
  }

  /// Its number rises with each opening and closing; the interrupt writes it.
  std::uint8_t session(CanChannel channel) const {
    return session_[static_cast<std::size_t>(channel)].load(std::memory_order_relaxed);
  }

  void show(gs::HostFrame frame, std::size_t kept) {
    if (!is_current(frame)) return;
    // The loss of a session is not the next one's.
    Loss& loss = loss_[frame.channel];
    frame.flags = loss.some && loss.session == frame.session ? gs::flag_overflow : std::uint8_t{0};
    loss = {to_host_.room() <= kept || !to_host_.push(frame), frame.session};
    if (loss.some) ++frames_lost_;
  }

  /// Those of a session that has ended are passed over.
  bool ISR_next_to_host(gs::HostFrame& next) {
    for (std::size_t i = 0; i < frames_to_host && to_host_.ISR_pop(next); ++i) {
      if (is_current(next)) return true;
    }
    return false;
  }

  bool ISR_set_mode(CanChannel channel, std::uint32_t mode, std::uint32_t flags) {
    constexpr std::uint32_t reset = 0, start = 1;
    if (mode != reset && (mode != start || (flags & ~gs::features) != 0)) return false;
    ISR_begin_session(channel);
    const std::uint8_t before = open_.load(std::memory_order_relaxed), bit = bit_of(channel);
    open_.store(static_cast<std::uint8_t>(mode == start ? before | bit : before & ~bit),
                std::memory_order_relaxed);
    if (in_flight_ == static_cast<std::uint8_t>(channel)) {
      controller_.ISR_take_back(number_of(can_to_host.address));
      in_flight_ = nothing;
    }
    ISR_serve();
    return true;
  }

  /// What waits from before belongs to nobody any more.
  void ISR_begin_session(CanChannel channel) {
    auto& session = session_[static_cast<std::size_t>(channel)];
    session.store(static_cast<std::uint8_t>(session.load(std::memory_order_relaxed) + 1),
                  std::memory_order_relaxed);
  }

  void ISR_forget() {
    in_flight_ = nothing;
    receiving_ = false;
    open_.store(0, std::memory_order_relaxed);
    ISR_begin_session(CanChannel::node);
    ISR_begin_session(CanChannel::bus);
    to_host_.ISR_clear();
  }

  Controller& controller_;
  const std::uint32_t can_clock_hz_;
  InterruptQueue<gs::HostFrame, frames_from_host> from_host_;
  QueueToInterrupt<gs::HostFrame, frames_to_host> to_host_;
  std::atomic<std::uint8_t> open_{0};  ///< a bit for each channel; the interrupt writes it
  std::array<std::atomic<std::uint8_t>, can_channels> session_{};
  std::array<Loss, can_channels> loss_{};  ///< the main loop's alone, with the next
  std::uint32_t frames_lost_ = 0;
  std::atomic<std::uint32_t> refused_{0}, fetched_{0};  ///< the interrupt writes them
  std::uint8_t in_flight_ = nothing;                    ///< of which channel a frame waits for the host
  bool running_ = false, receiving_ = false;
};

}  // namespace kmax::firmware::usb
