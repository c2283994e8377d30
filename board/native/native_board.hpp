#pragma once

#include <algorithm>
#include <concepts>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <functional>
#include <optional>
#include <span>
#include <vector>

#include "firmware/application.hpp"
#include "firmware/modbus/rtu_timing.hpp"

namespace kmax::board {

/// What moves instead of a real handle. Given from above, so that this floor knows no simulation.
template <typename Device>
concept SimulatedDevice = requires(Device device, std::size_t axis, const firmware::AxisOutput& output,
                                   double s) {
  /// Encoder counter of an axis, free-running, wraps at 2^32; and whether the encoder answers.
  { device.count(axis) } -> std::same_as<std::uint32_t>;
  { device.count_valid(axis) } -> std::same_as<bool>;
  /// The force held over the coming interval.
  {device.drive(axis, output)};
  /// Lets the time pass, in s.
  {device.advance(s)};
};

/// A device behind a power stage: what the board samples of it, and what its main loop does for it.
template <typename Device>
concept PoweredDevice = SimulatedDevice<Device> &&
    requires(Device device, std::size_t axis, const firmware::Application& application,
             std::uint32_t now_us) {
  /// All that the board samples of an axis in this tick, by this call.
  { device.sample(axis) } -> std::same_as<firmware::AxisInput>;
  { device.readings() } -> std::same_as<firmware::BoardReadings>;
  {device.poll(application, now_us)};
};

/// A device that a person holds, who answers to the background force (N, outwards) behind the rendered one.
template <typename Device>
concept HeldDevice = requires(Device device, std::size_t axis, float force) {
  {device.set_background_force(axis, force)};
};

/// A device of which, at times, nothing but its mechanics passes between two haptic samples.
template <typename Device>
concept HoldingDevice = SimulatedDevice<Device> && requires(Device device, double s, std::uint32_t times) {
  /// No currents, and no encoder whose every look shows something else: no look is missed.
  { device.only_moves() } -> std::same_as<bool>;
  /// Axes beyond these stand still.
  { device.axis_count() } -> std::same_as<std::size_t>;
  /// advance(s), so many times, under what drives it now.
  {device.advance(s, times)};
};

/// The firmware on x86: the same Application, fed by a simulated device, in virtual time.
///
/// Time passes only in advance(), in ticks of 50 us, and everything in it is deterministic: the same calls
/// give the same bits. Serial characters take their time on the line, so replies come as late as they would
/// on a wire of modbus.baud_rate, and so do CAN frames, each as long as on a bus without other traffic;
/// whoever wants real time calls advance() at the pace of a clock.
///
/// A restart that a host asks for (NMT reset node) makes a new Application in the place of the old one, over
/// the same memories.
template <SimulatedDevice Device>
class NativeBoard {
 public:
  static constexpr std::uint32_t tick_us = 1'000'000 / firmware::tick_rate_hz;

  /// `prepare` is called with the application at the start and at each restart, before the first tick. The
  /// clock begins at `now_us`: its low 32 bits are the firmware's.
  explicit NativeBoard(Device& device, std::function<void(firmware::Application&)> prepare = {},
                       std::uint64_t now_us = 0)
      : device_(device),
        capture_memory_(firmware::capture_words),
        prepare_(std::move(prepare)),
        now_us_(now_us) {
    start(firmware::ResetCause::native);
  }

  firmware::Application& application() { return *application_; }

  /// Somebody else is on the CAN bus, or nobody: then nothing is sent.
  void connect_can(bool connected) {
    can_.state = connected ? firmware::CanState::active : firmware::CanState::absent;
  }
  /// Frames from the bus, all of which arrive in the next tick.
  void receive_can(std::span<const drivers::CanFrame> frames) {
    can_incoming_.insert(can_incoming_.end(), frames.begin(), frames.end());
  }
  /// Frames that have left since the last call.
  std::vector<drivers::CanFrame> transmitted_can() {
    std::vector<drivers::CanFrame> out;
    out.swap(can_outgoing_);
    return out;
  }

  /// Bytes from the host; each takes its character time from now on, one after the other. `line_error`: of
  /// another form than 8E1.
  void receive(std::span<const std::uint8_t> bytes, bool line_error = false) {
    const std::uint64_t character = character_us();
    for (const std::uint8_t byte : bytes) {
      line_free_us_ = (line_free_us_ > now_us_ ? line_free_us_ : now_us_) + character;
      incoming_.push_back({line_free_us_, byte, line_error});
    }
  }

  /// A transfer from a host over USB, which takes no time: in the next tick it is there, as far as there is
  /// room for its packets, and the rest in the ticks after.
  void receive_usb(std::span<const std::uint8_t> bytes) {
    constexpr std::size_t full = firmware::modbus::TransferReceiver::packet_bytes;
    for (std::size_t at = 0; at <= bytes.size(); at += full) {
      const auto packet = bytes.subspan(at, std::min(full, bytes.size() - at));
      usb_incoming_.emplace_back(packet.begin(), packet.end());
    }
  }
  /// Bytes for that host since the last call.
  std::vector<std::uint8_t> transmitted_usb() {
    std::vector<std::uint8_t> out;
    out.swap(usb_outgoing_);
    return out;
  }

  /// Bytes for the host that have left the line since the last call.
  std::vector<std::uint8_t> transmitted() {
    std::vector<std::uint8_t> out;
    out.swap(outgoing_);
    return out;
  }

  /// Runs `ticks` ticks.
  void advance(std::uint64_t ticks) {
    for (std::uint64_t i = 0; i < ticks; ++i) tick();
  }

  /// Lets pass, of the next `most` ticks, those that would only hold the force between two haptic samples,
  /// without running them: the device moves through each of them all the same, so that every number is the
  /// one that advance() would have given, to the last bit. The main loop runs again in the next tick. Returns
  /// how many passed: none unless nobody speaks to the board, its device only moves, and the axes are as they
  /// were in the tick before.
  std::uint64_t advance_held(std::uint64_t most) {
    if constexpr (HoldingDevice<Device>) {
      if (!device_.only_moves() || somebody_speaks()) return 0;
      const std::uint64_t held = application_->ISR_axes().ISR_held_ticks(device_.axis_count());
      const auto ticks = static_cast<std::uint32_t>(held < most ? held : most);
      if (ticks == 0) return 0;
      device_.advance(static_cast<double>(tick_us) * 1e-6, ticks);
      now_us_ += std::uint64_t{tick_us} * ticks;
      application_->ISR_axes().ISR_pass_held(ticks);
      return ticks;
    } else {
      return 0;
    }
  }

  std::uint64_t now_us() const { return now_us_; }
  const firmware::TickOutput& output() const { return output_; }

 private:
  struct TimedByte {
    std::uint64_t time_us;
    std::uint8_t byte;
    bool line_error;
  };

  std::uint64_t character_us() const {
    return firmware::modbus::rtu_timing(application_->serial().settings().baud_rate, {}).character_us;
  }

  bool somebody_speaks() const {
    return !incoming_.empty() || !usb_incoming_.empty() || sending_until_us_ != 0 || !can_incoming_.empty() ||
           can_.state == firmware::CanState::active;
  }

  firmware::AxisInput sample(std::size_t axis) {
    if constexpr (PoweredDevice<Device>) {
      return device_.sample(axis);
    } else {
      firmware::AxisInput input{};
      input.count = device_.count(axis);
      input.count_valid = device_.count_valid(axis);
      return input;
    }
  }

  float supply_ceiling() const {
    if constexpr (requires { device_.supply_ceiling(); }) return device_.supply_ceiling();
    return 0.0f;
  }

  void start(firmware::ResetCause cause) {
    application_.emplace(firmware::BoardIdentity{.board_name = "native",
                                                 .serial_number = 1,
                                                 .core_clock_hz = 0,
                                                 .clock_source = 4,
                                                 .reset_cause = cause,
                                                 .supply_ceiling = supply_ceiling()},
                         capture_memory_, log_memory_);
    if (prepare_) prepare_(*application_);
  }

  void exchange_can() {
    for (const drivers::CanFrame& frame : can_incoming_) {
      if (frame.extended || frame.remote) continue;  // as the controller's filters
      ++can_.received;
      application_->can().ISR_frame(frame);
    }
    can_incoming_.clear();
    application_->can().set_readings(can_);
  }

  void send_can() {
    drivers::CanFrame frame;
    while (can_.state == firmware::CanState::active && can_free_us_ <= now_us_ &&
           application_->can().next_frame(frame)) {
      // 47 bits around the data, and a stuff bit for every ten or so.
      const std::uint64_t bits = (47U + 8U * frame.length) * 11U / 10U;
      can_free_us_ = now_us_ + bits * 1'000'000U / application_->can().settings().bit_rate;
      ++can_.sent;
      can_outgoing_.push_back(frame);
    }
  }

  void exchange_usb() {
    if (usb_incoming_.empty()) return;
    firmware::UsbModbusEdge& link = application_->usb();
    while (!usb_incoming_.empty() && link.ISR_has_room()) {
      link.ISR_packet(usb_incoming_.front(), static_cast<std::uint32_t>(now_us_));
      usb_incoming_.pop_front();
    }
    static_cast<void>(link.poll());
    const auto reply = link.reply_due();
    usb_outgoing_.insert(usb_outgoing_.end(), reply.begin(), reply.end());
    link.reply_sent();
  }

  void tick() {
    firmware::TickInput input;
    for (std::size_t axis = 0; axis < firmware::axis_count; ++axis) input.axis[axis] = sample(axis);
    output_ = application_->ISR_tick(input);
    for (std::size_t axis = 0; axis < firmware::axis_count; ++axis) {
      if constexpr (HeldDevice<Device>)
        device_.set_background_force(axis, application_->ISR_background_force(axis));
      device_.drive(axis, output_.axis[axis]);
    }
    device_.advance(static_cast<double>(tick_us) * 1e-6);
    now_us_ += tick_us;

    const auto now = static_cast<std::uint32_t>(now_us_);
    while (!incoming_.empty() && incoming_.front().time_us <= now_us_) {
      application_->serial().ISR_byte(incoming_.front().byte, incoming_.front().line_error,
                                      static_cast<std::uint32_t>(incoming_.front().time_us));
      incoming_.pop_front();
    }
    if constexpr (PoweredDevice<Device>) application_->set_readings(device_.readings());
    exchange_can();
    application_->poll(now);
    exchange_usb();
    send_can();
    if (application_->can().restart_wanted()) {
      sending_until_us_ = 0;
      start(firmware::ResetCause::software);
    }
    if constexpr (PoweredDevice<Device>) device_.poll(*application_, now);
    if (sending_until_us_ != 0) {
      if (now_us_ < sending_until_us_) return;
      outgoing_.insert(outgoing_.end(), reply_.begin(), reply_.end());
      application_->serial().reply_sent();
      sending_until_us_ = 0;
    }
    const auto reply = application_->serial().reply_due(now);
    if (reply.empty()) return;
    reply_.assign(reply.begin(), reply.end());
    sending_until_us_ = now_us_ + reply.size() * character_us();
  }

  Device& device_;
  std::vector<std::uint32_t> capture_memory_;
  firmware::FaultLogMemory log_memory_{};
  std::function<void(firmware::Application&)> prepare_;
  std::optional<firmware::Application> application_;
  firmware::TickOutput output_{};
  std::uint64_t now_us_, line_free_us_ = 0, sending_until_us_ = 0;
  std::deque<TimedByte> incoming_;
  std::vector<std::uint8_t> reply_, outgoing_, usb_outgoing_;
  std::deque<std::vector<std::uint8_t>> usb_incoming_;
  firmware::CanReadings can_;
  std::vector<drivers::CanFrame> can_incoming_, can_outgoing_;
  std::uint64_t can_free_us_ = 0;
};

}  // namespace kmax::board
