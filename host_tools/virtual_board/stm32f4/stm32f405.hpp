#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "host_tools/base/elf_image.hpp"
#include "host_tools/virtual_board/cortex_m/core_peripherals.hpp"
#include "host_tools/virtual_board/cortex_m/processor.hpp"
#include "host_tools/virtual_board/event_loop.hpp"
#include "host_tools/virtual_board/stm32f4/peripherals.hpp"

namespace kmax::virtual_board {

struct Stm32f405Config {
  Identity identity{};
  /// Processor's own settings, for tests that count instructions.
  ProcessorConfig processor{};
  std::uint32_t watchdog_oscillator_hz = 32'000;
  FrozenOutputs frozen_outputs = FrozenOutputs::off;
  /// What the timers' BKIN reads, to which no pin is mapped. RM0090 does not say.
  bool break_inputs_high = false;
  std::uint32_t brown_out_level = 0;  ///< BOR_LEV; 3 as the part leaves the factory
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

/// The chip that runs a firmware image: the processor, its peripherals, and what connects them inside.
///
/// Everything happens in board time; the same image, surroundings and calls give the same bits.
class Stm32f405 {
 public:
  /// The image is flashed into an erased part, which waits for its first reset. Throws std::runtime_error
  /// when the image cannot run.
  Stm32f405(const base::ElfImage& image, const Stm32f405Config& config, Surroundings around);
  Stm32f405(const Stm32f405&) = delete;
  Stm32f405& operator=(const Stm32f405&) = delete;

  /// Runs to `time`; resets that the firmware or the watchdog ask for happen on the way. Throws
  /// std::runtime_error, with the place and the function, when the firmware does what is refused.
  void run_until(BoardTime time);
  BoardTime now() const { return processor_.now(); }
  void reset(drivers::stm32f4::ResetCause cause);
  /// Off and on again: RAM is lost, flash stays. Also after the flash has cut the power
  /// (FlashInterface::cut_power_after), until when run_until() returns at once.
  void cycle_power();
  std::uint64_t resets() const { return resets_; }

  /// A debugger halts the core, between two blocks of instructions: SysTick and what DBGMCU says stand with
  /// it, all else goes on. run_until() lets the time pass until it is resumed; a reset ends it too.
  void halt();
  void resume();

  /// What the processor is about to execute, in words.
  std::string where() const;

  Processor& processor() { return processor_; }
  Bus& bus() { return bus_; }
  CorePeripherals& core() { return core_; }
  Peripherals& peripherals() { return peripherals_; }
  const Peripherals& peripherals() const { return peripherals_; }
  /// Something beside the chip has its events in the same order of time.
  void add_events(OffTheBus& events) { events_.add(events); }

 private:
  void attach_peripherals(const Stm32f405Config& config);
  void connect_peripherals();
  void stand_still_until(BoardTime time);
  void look_at_supply();
  void sit_brown_out_out(BoardTime time);
  void set_frozen(bool halted);
  [[noreturn]] void fail() const;

  base::ElfImage image_;
  Surroundings around_;
  BoardClocks clocks_;
  Bus bus_;
  CorePeripherals core_;
  Processor processor_;
  EventLoop events_;
  Peripherals peripherals_{clocks_, bus_, core_, around_};
  std::vector<std::unique_ptr<Peripheral>> others_;  ///< on the bus, and connected to nothing else
  FlashStall flash_stall_{peripherals_.flash, processor_};
  std::vector<Peripheral*> resettable_;  ///< all but the core's

  FrozenOutputs frozen_outputs_;
  bool halted_ = false;
  bool browned_out_ = false;
  bool watchdog_fired_ = false;
  std::uint64_t resets_ = 0;
};

}  // namespace kmax::virtual_board
