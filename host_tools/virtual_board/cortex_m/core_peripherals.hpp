#pragma once

#include <array>
#include <cstdint>
#include <functional>

#include "drivers/cortex_m/registers.hpp"
#include "host_tools/virtual_board/bus.hpp"
#include "host_tools/virtual_board/cortex_m/exception_table.hpp"
#include "host_tools/virtual_board/cortex_m/nvic.hpp"
#include "host_tools/virtual_board/cortex_m/system_control.hpp"
#include "host_tools/virtual_board/cortex_m/system_tick.hpp"
#include "host_tools/virtual_board/register_block.hpp"

namespace kmax::virtual_board {

/// Debug control of the core: TRCENA, which the cycle counter needs, and DHCSR, which says that no debugger
/// is there. All else is a debugger's business and refused.
class CoreDebug final : public RegisterBlock<CoreDebug> {
 public:
  static constexpr std::uint32_t size = sizeof(drivers::cortex_m::CoreDebugRegisters);

  CoreDebug() : RegisterBlock("core debug", registers()) {}
  void reset(BoardTime /*now*/) override {}  // a system reset leaves the debug registers alone

  bool trace_enabled() const { return demcr_ != 0; }

 private:
  static const RegisterTable<CoreDebug>& registers();
  std::uint32_t demcr_ = 0;
};

/// The cycle counter of the data watchpoint and trace unit: ARMv7-M architecture reference manual, C1.8. CTRL
/// and CYCCNT; comparators, sampling and the event counters are refused. System reset does not touch it.
class DwtModel final : public RegisterBlock<DwtModel> {
 public:
  static constexpr std::uint32_t size = sizeof(drivers::cortex_m::DwtRegisters);

  /// `cycles`: core cycles executed since power-up. `trace_enabled`: DEMCR.TRCENA; while it is false all
  /// accesses are refused (unpredictable on silicon) and the counter stands still.
  DwtModel(std::function<std::uint64_t()> cycles, std::function<bool()> trace_enabled);

  void reset(BoardTime /*now*/) override {}

 private:
  static const RegisterTable<DwtModel>& registers();
  void before_access(const Access& access) override;
  std::uint32_t count() const;
  std::uint32_t read_ctrl() const;
  void write_ctrl(std::uint32_t value);
  void after_write() override { since_ = cycles_(); }

  std::function<std::uint64_t()> cycles_;
  std::function<bool()> trace_enabled_;
  bool counting_ = false;
  std::uint32_t count_ = 0;  // at since_
  std::uint64_t since_ = 0;  // in cycles of the source
};

/// FPCCR and its neighbours, PM0214 floating-point unit: how the FP registers survive an exception.
///
/// Automatic preservation (ASPEN, on after reset) cannot be turned off here. Lazy preservation (LSPEN, on
/// after reset) changes the modelled cycles alone: the registers always reach the stack at once, which no
/// program can tell from the later write. FPDSCR other than 0 (round to nearest, no flush to zero) is
/// refused.
class FloatingPointControl final : public RegisterBlock<FloatingPointControl> {
 public:
  static constexpr std::uint32_t size = sizeof(drivers::cortex_m::FloatingPointRegisters);
  /// PM0214: single precision with division and square root, 16 double-word registers; fused multiply-add.
  static constexpr std::uint32_t feature_word_0 = 0x1011'0021;
  static constexpr std::uint32_t feature_word_1 = 0x1100'0011;

  FloatingPointControl() : RegisterBlock("FPU control", registers()) {}
  void reset(BoardTime now) override;

  bool lazy() const { return drivers::cortex_m::floating_point_fpccr::LazyPreservation::of(fpccr_) != 0; }

  /// A frame with room for the registers was made, at this address, and they count as not yet written.
  void begin_lazy_frame(std::uint32_t address);
  void end_lazy_frame() { lazy_active_ = false; }
  bool lazy_active() const { return lazy_active_; }

 private:
  static const RegisterTable<FloatingPointControl>& registers();
  std::uint32_t read_fpccr() const;
  void write_fpccr(const Access& access, std::uint32_t value);

  static constexpr std::uint32_t fpccr_reset =
      drivers::cortex_m::floating_point_fpccr::AutomaticPreservation::mask |
      drivers::cortex_m::floating_point_fpccr::LazyPreservation::mask;

  std::uint32_t fpccr_ = fpccr_reset;
  std::uint32_t fpcar_ = 0;
  bool lazy_active_ = false;
};

/// Memory protection unit, PM0214: eight regions with sub-regions, for privileged code. The processor
/// enforces what allows() says. Refused: the reserved permission, sub-regions of less than 32 bytes, and,
/// once it is enabled, borders inside flash, SRAM or CCM that are no multiples of 1 KiB, the emulator's page.
/// What the memory map itself forbids (no code from CCM, no store to flash, nothing where there is nothing)
/// holds with and without it.
class MemoryProtection final : public RegisterBlock<MemoryProtection> {
 public:
  static constexpr std::uint32_t size = sizeof(drivers::cortex_m::MpuRegisters);

  struct Region {
    std::uint32_t address = 0;
    std::uint32_t attributes = 0;
  };

  MemoryProtection() : RegisterBlock("MPU", registers()) {}
  void reset(BoardTime now) override;

  bool enabled() const;
  /// HFNMIENA: also in handlers of HardFault and NMI.
  bool in_fault_handlers() const;
  const Region& region(unsigned number) const { return regions_[number]; }

  enum class Use : std::uint8_t { load, store, fetch };
  /// What the regions, and the default map where it shows through, permit; whether enabled or not. The core's
  /// own peripherals are always open.
  bool allows(std::uint32_t address, Use use) const;
  /// Another number after each change; never 0.
  std::uint32_t version() const { return version_; }

 private:
  static const RegisterTable<MemoryProtection>& registers();
  void write_control(const Access& access, std::uint32_t value);
  void select(const Access& access, std::uint32_t value);
  std::uint32_t read_address() const;
  void write_address(const Access& access, std::uint32_t value);
  std::uint32_t read_attributes() const { return regions_[selected_].attributes; }
  void write_attributes(const Access& access, std::uint32_t value);
  void refuse_fine_borders(const Access& access) const;
  void after_write() override { ++version_; }

  std::array<Region, drivers::cortex_m::mpu_region_count> regions_{};
  std::uint32_t ctrl_ = 0;
  std::uint32_t selected_ = 0;
  std::uint32_t version_ = 1;
};

/// What the Cortex-M4 keeps at 0xE000E000: all blocks of the system control space, on the bus. PM0214, core
/// peripherals. `system_tick` is the only one with events of its own.
struct CorePeripherals {
  /// `interrupts`: how many the chip has.
  CorePeripherals(Bus& bus, const BoardClocks& clocks, std::size_t interrupts)
      : exceptions(interrupts),
        nvic(exceptions),
        software_trigger(exceptions),
        system_control(exceptions),
        system_tick(clocks, exceptions) {
    namespace chip = drivers::cortex_m;
    bus.attach(chip::nvic_base, Nvic::size, "NVIC", nvic);
    bus.attach(chip::software_trigger_base, sizeof(chip::SoftwareTriggerRegisters), "STIR", software_trigger);
    bus.attach(chip::scb_base, SystemControl::size, "SCB", system_control);
    bus.attach(chip::system_tick_base, SystemTick::size, "SysTick", system_tick);
    bus.attach(chip::mpu_base, MemoryProtection::size, "MPU", memory_protection);
    bus.attach(chip::floating_point_base, FloatingPointControl::size, "FPU control", floating_point);
    bus.attach(chip::core_debug_base, CoreDebug::size, "core debug", core_debug);
  }

  /// System reset of all of them.
  void reset(BoardTime now) {
    exceptions.reset();
    const std::array<Peripheral*, 7> all{&nvic,        &software_trigger,  &system_control,
                                         &system_tick, &memory_protection, &floating_point,
                                         &core_debug};
    for (Peripheral* peripheral : all) peripheral->reset(now);
  }

  ExceptionTable exceptions;
  Nvic nvic;
  SoftwareTrigger software_trigger;
  SystemControl system_control;
  SystemTick system_tick;
  MemoryProtection memory_protection;
  FloatingPointControl floating_point;
  CoreDebug core_debug;
};

}  // namespace kmax::virtual_board
