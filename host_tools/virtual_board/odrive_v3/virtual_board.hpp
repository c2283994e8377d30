#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <functional>
#include <span>
#include <utility>
#include <vector>

#include "host_tools/virtual_board/odrive_v3/as5047p_chip.hpp"
#include "host_tools/virtual_board/odrive_v3/board_world.hpp"
#include "host_tools/virtual_board/odrive_v3/brake_driver.hpp"
#include "host_tools/virtual_board/odrive_v3/drv8301_chip.hpp"
#include "host_tools/virtual_board/odrive_v3/line_spikes.hpp"
#include "host_tools/virtual_board/stm32f4/stm32f405.hpp"

namespace kmax::virtual_board {

/// What the maker wrote about the board into the one-time programmable bytes.
struct MakerRecord {
  std::uint8_t version_major = 3;
  std::uint8_t version_minor = 6;
  std::uint8_t volts = 56;
};

struct VirtualBoardConfig : Stm32f405Config {
  MakerRecord maker_record{};
  BootstrapConfig bootstrap{};
};

/// The gate drivers wake some time after EN_GATE; the brake's driver starves; spikes begin and end.
class ChipEvents final : public OffTheBus {
 public:
  ChipEvents(std::array<Drv8301Chip, 2>& chips, BrakeDriver& brake, LineSpikes& spikes)
      : chips_(chips), brake_(brake), spikes_(spikes) {}
  void advance(BoardTime now) override {
    for (Drv8301Chip& chip : chips_) chip.advance(now);
    if (brake_.advance(now) && brake_change_) brake_change_(now);
    spikes_.advance(now);
  }
  BoardTime next_event() const override {
    return std::min(
        {chips_[0].next_event(), chips_[1].next_event(), brake_.next_event(), spikes_.next_event()});
  }
  void reset(BoardTime /*now*/) override {}
  void on_brake_change(std::function<void(BoardTime)> listener) { brake_change_ = std::move(listener); }

 private:
  std::array<Drv8301Chip, 2>& chips_;
  BrakeDriver& brake_;
  LineSpikes& spikes_;
  std::function<void(BoardTime)> brake_change_;
};

/// An ODrive v3.6 that runs a firmware image: the chip, the chips around it and the lines of connector J3,
/// wired as pins.hpp of the board says. What the connectors lead to is a BoardWorld.
///
/// Whoever wants real time calls run_until() at the pace of a clock.
class VirtualBoard {
 public:
  /// The image is flashed into an erased part and the power is switched on. The world must outlive the board;
  /// without one the connectors are open. Throws std::runtime_error when the image cannot run.
  VirtualBoard(const base::ElfImage& image, BoardWorld* world, const VirtualBoardConfig& config = {});
  VirtualBoard(const VirtualBoard&) = delete;
  VirtualBoard& operator=(const VirtualBoard&) = delete;

  /// As Stm32f405 says.
  void run_until(BoardTime time) { chip_.run_until(time); }
  void run_for(double duration_s);
  BoardTime now() const { return chip_.now(); }
  std::uint64_t resets() const { return chip_.resets(); }

  // USART2, on GPIO3 and GPIO4 of J3.
  void receive(std::span<const std::uint8_t> bytes);
  /// What has left the pin since the last call.
  std::vector<std::uint8_t> transmitted();

  // Lines.
  /// The contact at GPIO5; open is "stop". It is closed when the board is made.
  void open_emergency_stop(bool open);
  /// GPIO8 as a listener with a pull-down sees it.
  bool healthy() const;
  /// The reset line, pulled low for a moment.
  void pull_reset() { chip_.reset(drivers::stm32f4::ResetCause::pin); }
  /// Off and on again.
  void cycle_power() { chip_.cycle_power(); }
  /// The gate drivers' wired fault line, pulled low from outside.
  void hold_fault_line(bool low);
  /// Its level; low is a fault.
  bool fault_line() const;

  bool bridge_armed(std::size_t axis) const { return pwm(axis).moe(); }
  /// A gate signal of an axis is active or will be within the PWM period: its bridge drives the motor's
  /// wires.
  bool gates_active(std::size_t axis) const;
  /// Since power-up, on all lines.
  std::uint64_t spikes() const { return spikes_.begun(); }
  /// The brake's driver.
  const BrakeDriver& brake() const { return brake_; }

  // For tools and tests.
  Stm32f405& chip() { return chip_; }
  CanBus& can_bus() { return can_bus_; }
  /// The host at the other end of the USB cable; the cable is unplugged when the board is made.
  UsbHostPort& usb() { return usb_port_; }
  const As5047pChip& serial_encoder() const { return serial_encoder_; }
  Drv8301Chip& gate_driver(std::size_t axis) { return gate_drivers_[axis]; }

 private:
  AdvancedTimerModel& pwm(std::size_t axis) { return chip_.peripherals().advanced_timers[axis]; }
  const AdvancedTimerModel& pwm(std::size_t axis) const { return chip_.peripherals().advanced_timers[axis]; }
  void connect_chips();
  void connect_pins();
  void set_board_resistors();
  double logic_supply() const;
  void show_bridge(std::size_t axis, BoardTime now);
  void show_brake(BoardTime now);
  void show_fault_line(BoardTime now);
  void show_emergency_stop(BoardTime now);
  void show_index(std::size_t axis, BoardTime now);
  void show_spike(LineSpikes::Line line, BoardTime now);
  void draw_spikes(BoardTime now);
  std::uint16_t exchange(std::uint16_t word, BoardTime now);
  void look_at_world(BoardTime now);

  BoardWorld* world_;
  CanBus can_bus_;
  UsbHostPort usb_port_;
  Stm32f405 chip_;
  std::array<Drv8301Chip, 2> gate_drivers_;
  As5047pChip serial_encoder_{
      [this](BoardTime now) { return world_ != nullptr ? world_->serial_encoder(now).angle : 0; }};
  BrakeDriver brake_;
  LineSpikes spikes_;
  ChipEvents chip_events_{gate_drivers_, brake_, spikes_};

  std::vector<std::uint8_t> transmitted_;
  bool fault_line_held_ = false;
  bool emergency_stop_open_ = false;
  std::array<bool, 2> index_{};                ///< levels that the encoders give
  std::array<std::int64_t, 2> false_edges_{};  ///< counted by spikes
  bool supply_was_low_ = false;
};

}  // namespace kmax::virtual_board
