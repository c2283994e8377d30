#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "firmware/object_dictionary/entry.hpp"
#include "host_tools/simulation/scene.hpp"
#include "host_tools/virtual_board/odrive_v3/virtual_board.hpp"

namespace kmax::virtual_board {

/// What one step of the tick costs, over all ticks of the measurement in which it ran.
struct StepCost {
  std::string name;
  std::uint64_t ticks = 0;
  std::uint32_t worst = 0;         ///< instructions in one tick
  double mean = 0.0;               ///< instructions
  double mean_cycles = 0.0;        ///< modelled; see instruction.hpp
  std::uint32_t worst_cycles = 0;  ///< likewise
  double mean_waits = 0.0;         ///< cycles for flash; of a whole tick for SRAM and the buses as well
};

/// A bound, and what is held against it.
struct BudgetLine {
  std::string name;
  double value = 0.0;
  double bound = 0.0;
  std::string unit;
  std::string peers;  ///< what others need for the same work, in words
  bool kept() const { return value <= bound; }
};

/// Of the whole ticks of both axes, with MemoryWaits, which begin each tick with empty caches because what
/// ran before it was something else, and Bus::register_waits. Left out is the vector, which the core reads
/// from flash while it stacks.
struct WaitReport {
  double mean = 0.0, worst = 0.0;               ///< % of the core's time; worst: both worst ticks together
  double flash = 0.0, sram = 0.0, buses = 0.0;  ///< of the mean
  double flash_if_all_kept = 0.0;  ///< instead of `flash`, where the cache keeps prefetched lines as well
};

/// The main loop while the CAN bus has not a free bit (FullBus) and the serial line is as busy as one Modbus
/// master makes it.
struct TrafficReport {
  double instructions = 0.0;                       ///< in a round's time, interrupts not counted
  double sdo_answers = 0.0, serial_replies = 0.0;  ///< in a second
};

struct BudgetReport {
  std::vector<StepCost> steps;
  std::vector<BudgetLine> lines;
  WaitReport with_waits;
  TrafficReport with_traffic;
  std::uint64_t ticks = 0;
  bool kept() const;
};

/// Runs the image with the scene's two axes, both armed and pressed into an adaptive wall at 20 kHz with the
/// widest FOAW window, and accounts for every instruction of every tick.
///
/// An instruction belongs to the innermost function that names a step, by the debug information of the image:
/// what the compiler has inlined is told apart too, and what it has moved between two functions goes where it
/// says it came from. Needs arm-none-eabi-addr2line. Throws std::runtime_error when that is missing, when the
/// axes cannot be armed, when an axis trips, or when one does not tick as often as it must.
BudgetReport measure_budget(const std::string& elf_path, simulation::Scene scene,
                            const VirtualBoardConfig& config);

/// What was not measured keeps every bound: throws std::runtime_error when an axis has ticked less often than
/// in `seconds` it must.
void require_all_ticks(const std::array<std::uint64_t, firmware::axis_count>& ticks, double seconds);

std::string budget_table(const BudgetReport& report);
std::string budget_json(const BudgetReport& report);

}  // namespace kmax::virtual_board
