#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "drivers/stm32f4/interrupts.hpp"
#include "host_tools/base/elf_image.hpp"
#include "host_tools/virtual_board/cortex_m/core_peripherals.hpp"
#include "host_tools/virtual_board/cortex_m/processor.hpp"
#include "host_tools/virtual_board/event_loop.hpp"
#include "host_tools/virtual_board/odrive_v3/as5047p_chip.hpp"
#include "host_tools/virtual_board/odrive_v3/board_world.hpp"
#include "host_tools/virtual_board/odrive_v3/brake_driver.hpp"
#include "host_tools/virtual_board/odrive_v3/drv8301_chip.hpp"
#include "host_tools/virtual_board/odrive_v3/line_spikes.hpp"
#include "host_tools/virtual_board/stm32f4/adc.hpp"
#include "host_tools/virtual_board/stm32f4/advanced_timer.hpp"
#include "host_tools/virtual_board/stm32f4/can_bus.hpp"
#include "host_tools/virtual_board/stm32f4/can_controller.hpp"
#include "host_tools/virtual_board/stm32f4/device_identity.hpp"
#include "host_tools/virtual_board/stm32f4/dma.hpp"
#include "host_tools/virtual_board/stm32f4/exti_and_syscfg.hpp"
#include "host_tools/virtual_board/stm32f4/flash_interface.hpp"
#include "host_tools/virtual_board/stm32f4/general_timer.hpp"
#include "host_tools/virtual_board/stm32f4/gpio_port.hpp"
#include "host_tools/virtual_board/stm32f4/iwdg.hpp"
#include "host_tools/virtual_board/stm32f4/one_pulse_timer.hpp"
#include "host_tools/virtual_board/stm32f4/otg_fs.hpp"
#include "host_tools/virtual_board/stm32f4/rcc.hpp"
#include "host_tools/virtual_board/stm32f4/spi.hpp"
#include "host_tools/virtual_board/stm32f4/usart.hpp"
#include "host_tools/virtual_board/stm32f4/usb_host_port.hpp"

namespace kmax::virtual_board {

struct VirtualBoardConfig {
  Identity identity{};
  /// Processor's own settings, for tests that count instructions.
  ProcessorConfig processor{};
  std::uint32_t watchdog_oscillator_hz = 32'000;
  FrozenOutputs frozen_outputs = FrozenOutputs::off;
  /// What the timers' BKIN reads, to which no pin is mapped. RM0090 does not say.
  bool break_inputs_high = false;
  BootstrapConfig bootstrap{};
  std::uint32_t brown_out_level = 0;  ///< BOR_LEV; 3 as the part leaves the factory
};

/// Something with events of its own in the board's order of time that is not on the bus.
class OffTheBus : public Peripheral {
 public:
  std::uint32_t read(const Access& access) override { refuse(access, "off the bus", "it has no registers"); }
  void write(const Access& access, std::uint32_t /*value*/) override {
    refuse(access, "off the bus", "it has no registers");
  }
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

/// Stops the processor as soon as the flash has become busy, at the end of the block that did it.
class FlashStall final : public OffTheBus {
 public:
  FlashStall(const FlashInterface& flash, Processor& processor) : flash_(flash), processor_(processor) {}
  void advance(BoardTime /*now*/) override {
    served_ = flash_.busy_until();
    pending_ = true;
    processor_.stop();
  }
  BoardTime next_event() const override { return flash_.busy_until() > served_ ? processor_.now() : never; }
  void reset(BoardTime /*now*/) override { served_ = flash_.busy_until(); }

  /// The flash has become busy since the last call.
  bool take() { return std::exchange(pending_, false); }

 private:
  const FlashInterface& flash_;
  Processor& processor_;
  BoardTime served_ = 0;
  bool pending_ = false;
};

/// An ODrive v3.6 with an STM32F405 that runs a firmware image: the processor, its peripherals, the chips
/// around it and the lines of connector J3, wired as pins.hpp of the board says. What the connectors lead to
/// is a BoardWorld.
///
/// Everything happens in board time; the same image, world and calls give the same bits. Whoever wants real
/// time calls run_until() at the pace of a clock.
class VirtualBoard {
 public:
  /// The image is flashed into an erased part and the power is switched on. The world must outlive the board;
  /// without one the connectors are open. Throws std::runtime_error when the image cannot run.
  VirtualBoard(const base::ElfImage& image, BoardWorld* world, const VirtualBoardConfig& config = {});
  VirtualBoard(const VirtualBoard&) = delete;
  VirtualBoard& operator=(const VirtualBoard&) = delete;

  /// Runs to `time`; resets that the firmware or the watchdog ask for happen on the way. Throws
  /// std::runtime_error, with the place and the function, when the firmware does what is refused.
  void run_until(BoardTime time);
  void run_for(double duration_s);
  BoardTime now() const { return processor_.now(); }

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
  void pull_reset();
  /// Off and on again: RAM is lost, flash stays. Also after the flash has cut the power
  /// (FlashInterface::cut_power_after), until when run_until() returns at once.
  void cycle_power();
  /// The gate drivers' wired fault line, pulled low from outside.
  void hold_fault_line(bool low);
  /// Its level; low is a fault.
  bool fault_line() const;

  /// A debugger halts the core, between two blocks of instructions: SysTick and what DBGMCU says stand with
  /// it, all else goes on. run_until() lets the time pass until it is resumed; a reset ends it too.
  void halt();
  void resume();

  bool bridge_armed(std::size_t axis) const { return pwm_[axis].moe(); }
  /// A gate signal of an axis is active or will be within the PWM period: its bridge drives the motor's
  /// wires.
  bool gates_active(std::size_t axis) const;
  /// Since power-up, on all lines.
  std::uint64_t spikes() const { return spikes_.begun(); }
  /// The brake's driver.
  const BrakeDriver& brake() const { return brake_; }
  std::uint64_t resets() const { return resets_; }
  /// What the processor is about to execute, in words.
  std::string where() const;

  // For tools and tests.
  Processor& processor() { return processor_; }
  Bus& bus() { return bus_; }
  CorePeripherals& core() { return core_; }
  FlashInterface& flash() { return flash_; }
  RccModel& rcc() { return rcc_; }
  UsartModel& usart() { return usart2_; }
  /// GPIO1 and GPIO2 of J3; the image of today does not use it.
  UsartModel& uart4() { return uart4_; }
  CanBus& can_bus() { return can_bus_; }
  /// The host at the other end of the USB cable; the cable is unplugged when the board is made.
  UsbHostPort& usb() { return usb_port_; }
  const CanBusNode& can_node() const { return *can1_.node(); }
  AdvancedTimerModel& pwm(std::size_t axis) { return pwm_[axis]; }
  GeneralTimerModel& encoder_timer(std::size_t axis) { return encoders_[axis]; }
  AdcModel& adc() { return adc_; }
  DmaModel& dma() { return dma2_; }
  const As5047pChip& serial_encoder() const { return serial_encoder_; }
  Drv8301Chip& gate_driver(std::size_t axis) { return gate_drivers_[axis]; }
  GpioPortModel& port(drivers::stm32f4::GpioPort port) { return ports_[static_cast<std::size_t>(port)]; }

 private:
  void attach_peripherals(const VirtualBoardConfig& config);
  void wire();
  void wire_pins();
  void set_board_resistors();
  void reset(drivers::stm32f4::ResetCause cause);
  void stand_still_until(BoardTime time);
  void wire_chips();
  double logic_supply() const;
  void look_at_logic_supply();
  void sit_brown_out_out(BoardTime time);
  void set_frozen(bool halted, BoardTime now);
  void show_bridge(std::size_t axis, BoardTime now);
  void show_brake(BoardTime now);
  void show_fault_line(BoardTime now);
  void show_emergency_stop(BoardTime now);
  void show_index(std::size_t axis, BoardTime now);
  void show_spike(LineSpikes::Line line, BoardTime now);
  void draw_spikes(BoardTime now);
  std::uint16_t exchange(std::uint16_t word, BoardTime now);
  void look_at_world(BoardTime now);
  [[noreturn]] void fail() const;

  base::ElfImage image_;
  BoardWorld* world_;
  BoardClocks clocks_;
  Bus bus_;
  CorePeripherals core_;
  Processor processor_;
  EventLoop events_;

  FlashInterface flash_{clocks_, bus_.flash()};
  PwrModel pwr_{clocks_};
  RccModel rcc_{clocks_, flash_, pwr_};
  IwdgModel iwdg_;
  std::array<GpioPortModel, 4> ports_{
      GpioPortModel{drivers::stm32f4::GpioPort::a}, GpioPortModel{drivers::stm32f4::GpioPort::b},
      GpioPortModel{drivers::stm32f4::GpioPort::c}, GpioPortModel{drivers::stm32f4::GpioPort::d}};
  SyscfgModel syscfg_;
  ExtiModel exti_{syscfg_, core_.nvic};
  std::array<AdvancedTimerModel, 2> pwm_{AdvancedTimerModel{AdvancedTimer::tim1, clocks_},
                                         AdvancedTimerModel{AdvancedTimer::tim8, clocks_}};
  std::array<GeneralTimerModel, 2> encoders_{GeneralTimerModel{GeneralTimer::tim3, clocks_},
                                             GeneralTimerModel{GeneralTimer::tim4, clocks_}};
  OnePulseTimerModel brake_timer_{clocks_};
  DmaModel dma2_{bus_};
  DbgmcuModel dbgmcu_;
  AdcModel adc_{clocks_, core_.nvic, [this](unsigned channel, BoardTime at) {
                  return world_ != nullptr ? world_->analogue(channel, at) : 0.0;
                }};
  UsartModel usart2_{clocks_, core_.nvic, drivers::stm32f4::Interrupt::usart2};
  UsartModel uart4_{clocks_, core_.nvic, drivers::stm32f4::Interrupt::uart4};
  CanBus can_bus_;
  CanController can1_{clocks_, core_.nvic, can_bus_};
  UsbHostPort usb_port_;
  OtgFsModel otg_fs_{clocks_, core_.nvic, usb_port_, [this](BoardTime at) { return rcc_.usb_clock(at); },
                     [this] { return has_usb_pins(ports_[0]); }};
  SpiModel spi3_{clocks_};
  std::vector<std::unique_ptr<Peripheral>> others_;  ///< on the bus, and of no concern to the board's wiring
  std::array<Drv8301Chip, 2> gate_drivers_;
  As5047pChip serial_encoder_{
      [this](BoardTime now) { return world_ != nullptr ? world_->serial_encoder(now).angle : 0; }};
  BrakeDriver brake_;
  LineSpikes spikes_;
  ChipEvents chip_events_{gate_drivers_, brake_, spikes_};
  FlashStall flash_stall_{flash_, processor_};
  std::vector<Peripheral*> peripherals_;  ///< all but the core's

  std::vector<std::uint8_t> transmitted_;
  FrozenOutputs frozen_outputs_ = FrozenOutputs::off;
  bool halted_ = false;
  bool browned_out_ = false;
  bool watchdog_fired_ = false;
  bool fault_line_held_ = false;
  bool emergency_stop_open_ = false;
  std::array<bool, 2> index_{};                ///< levels that the encoders give
  std::array<std::int64_t, 2> false_edges_{};  ///< counted by spikes
  bool supply_was_low_ = false;
  std::uint64_t resets_ = 0;
};

}  // namespace kmax::virtual_board
