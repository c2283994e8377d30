#include "host_tools/virtual_board/run/budget.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <initializer_list>
#include <map>
#include <nlohmann/json.hpp>
#include <set>
#include <stdexcept>
#include <utility>

#include "board/odrive_v3/description.hpp"
#include "firmware/application.hpp"
#include "host_tools/simulated_board/scene_parameters.hpp"
#include "host_tools/virtual_board/cortex_m/instruction.hpp"
#include "host_tools/virtual_board/odrive_v3/scene_world.hpp"
#include "host_tools/virtual_board/run/board_link.hpp"
#include "host_tools/virtual_board/run/full_bus.hpp"
#include "host_tools/virtual_board/run/inline_frames.hpp"
#include "host_tools/virtual_board/run/memory_waits.hpp"
#include "host_tools/virtual_board/run/parameter_sectors.hpp"
#include "host_tools/virtual_board/run/tick_recorder.hpp"

namespace kmax::virtual_board {
namespace {

/// Innermost first: the first function of an instruction's frames that one of these names are part of
/// decides.
struct StepPattern {
  const char* step;
  const char* function;
};
constexpr StepPattern patterns[] = {
    {"position", "CountExtender<"},
    {"position", "Axis::position_of"},
    {"re-sampling", "Resampler::"},
    {"velocity (FOAW)", "FoawVelocity"},
    {"velocity (FOAW)", "ChordWindow"},
    {"velocity (FOAW)", "VelocityEstimator<"},
    {"adaptive wall", "WallLaw<"},
    {"adaptive wall", "AdaptiveCoefficient<"},
    {"interference", "control::Interference<"},
    {"force limiter", "ForceLimiter<"},
    {"instability watch", "InstabilityDetector<"},
    {"instability watch", "WallSoftening<"},
    {"instability watch", "HapticLoop<float>::watch"},
    {"instability watch", "HapticLoop<float>::act_on_instability"},
    {"haptic loop, the rest", "HapticLoop<"},
    {"force to current", "MotorTransmission<"},
    {"DC current", "DcCurrentController<"},
    {"PMSM current", "FieldOrientedController<"},
    {"PMSM current", "sine_cosine"},
    {"phase watch", "PhaseWatch<"},
    {"excitation", "Excitation::"},
    {"force compensation", "ForceCompensation<"},
    {"spin-out watch", "MotionPlausibility<"},
    {"capture", "::ISR_capture"},
    {"capture", "Capture::"},
    {"motor control, the rest", "MotorControl::"},
    {"report to the main loop", "ISR_fill"},
    {"axis, trips", "firmware::Axis::"},
    {"application", "firmware::Application::"},
    {"application", "firmware::AxesTick<"},
    {"application", "firmware::TangentialInterference<"},
    {"current sampling", "CurrentSampling<"},
    {"PWM", "ThreePhasePwm<"},
    {"encoder, index", "ISR_read_count"},
    {"encoder, index", "QuadratureIndexWatch"},
    {"encoder, index", "ReferencedQuadratureCounter"},
    {"encoder, index", "SerialEncoder"},
};
constexpr const char* other_step = "board: conversion, housekeeping";

std::string step_of(const std::vector<std::string>& frames) {
  for (const std::string& function : frames) {
    for (const StepPattern& pattern : patterns) {
      // Not in the types of its arguments.
      if (function.substr(0, function.find('(')).find(pattern.function) != std::string::npos)
        return pattern.step;
    }
  }
  return other_step;
}

/// Entry, exit and the FP frame, PM0214; not part of what instructions cost.
constexpr std::uint32_t exception_cycles = 12 + 12 + 2 * 17;

struct StepSum {
  std::uint64_t ticks = 0, instructions = 0, cycles = 0, waits = 0;
  std::uint32_t worst = 0, worst_cycles = 0;
};

/// Of a step in one tick; waits are those for flash.
struct StepInTick {
  std::uint32_t instructions = 0, cycles = 0;
  std::uint64_t waits = 0;
};

constexpr double measured = 0.3;  // s

/// Both axes stay armed.
TrafficReport under_traffic(VirtualBoard& board, BoardLink& link, TickRecorder& recorder, double round_s) {
  FullBus bus(board);
  recorder.start();
  const std::uint64_t answers = bus.answers(), telemetry = bus.telemetry();
  const double begin = seconds(board.now()), busy = seconds(board.can_bus().busy_time());
  double lasted = 0.0;
  std::uint64_t replies = 0;
  for (; lasted < measured; lasted = seconds(board.now()) - begin) {
    (void)link.read_input(firmware::trace_window, 124);
    ++replies;
  }
  (void)recorder.take();
  const double load = (seconds(board.can_bus().busy_time()) - busy) / lasted;
  const double pdos = static_cast<double>(bus.telemetry() - telemetry) / lasted;
  if (bus.refusals() != 0 || load < 0.99 || pdos < 3'800)
    throw std::runtime_error(
        fmt::format("the CAN bus was {:.0f} % full, with {:.0f} PDOs a second instead of 4000 and {} "
                    "refusals",
                    100.0 * load, pdos, bus.refusals()));
  return {static_cast<double>(recorder.main_loop()) * round_s / lasted,
          static_cast<double>(bus.answers() - answers) / lasted, static_cast<double>(replies) / lasted};
}

void require_armed(VirtualBoard& board) {
  for (std::size_t axis = 0; axis < firmware::axis_count; ++axis) {
    if (!board.bridge_armed(axis))
      throw std::runtime_error(fmt::format("axis {} has tripped during the measurement", axis));
  }
}

}  // namespace

void require_all_ticks(const std::array<std::uint64_t, firmware::axis_count>& ticks, double seconds) {
  const double due = seconds * board::odrive_v3::description.pwm_hz();
  for (std::size_t axis = 0; axis < ticks.size(); ++axis) {
    if (static_cast<double>(ticks[axis]) < due - 2.0)
      throw std::runtime_error(fmt::format("axis {} has ticked {} times in {} s instead of {:.0f}", axis,
                                           ticks[axis], seconds, due));
  }
}

bool BudgetReport::kept() const {
  return std::all_of(lines.begin(), lines.end(), [](const BudgetLine& line) { return line.kept(); });
}

BudgetReport measure_budget(const std::string& elf_path, simulation::Scene scene,
                            const VirtualBoardConfig& config) {
  for (std::size_t axis = 0; axis < firmware::axis_count; ++axis) {
    const auto add = [&scene, axis](const char* name, simulation::ParameterValue value) {
      scene.parameters.push_back({fmt::format("axis{}.{}", axis, name), std::move(value), "budget"});
    };
    add("wall.law", std::string("adaptive"));
    add("velocity.estimator", std::string("foaw"));
    add("velocity.window", std::int64_t{16});
  }
  const base::ElfImage image = base::ElfImage::load(elf_path);
  SceneWorld world(scene);
  VirtualBoard board(image, &world, config);
  store_parameters(board, simulated_board::assignments_of(scene));
  TickRecorder recorder(image, board);
  board.run_for(0.3);
  BoardLink link(board);
  for (std::size_t axis = 0; axis < firmware::axis_count; ++axis) link.arm(axis);
  recorder.start();
  // The approach, the contact and some of the hold.
  board.run_for(measured);
  require_armed(board);
  std::vector<RecordedTick> ticks = recorder.take();
  const std::uint64_t main_loop = recorder.main_loop();
  if (!ticks.empty()) ticks.pop_back();  // not over
  std::array<std::uint64_t, firmware::axis_count> ticks_of{};
  for (const RecordedTick& tick : ticks) ++ticks_of.at(tick.axis);
  require_all_ticks(ticks_of, measured);

  constexpr const board::BoardDescription& of_board = board::odrive_v3::description;
  const double round_s = firmware::Application::Tick::round_ticks / of_board.pwm_hz();
  BudgetReport report;
  report.with_traffic = under_traffic(board, link, recorder, round_s);
  require_armed(board);

  std::set<std::uint32_t> unique;
  for (const RecordedTick& tick : ticks) unique.insert(tick.addresses.begin(), tick.addresses.end());
  const auto frames = inline_frames(elf_path, {unique.begin(), unique.end()});
  struct Place {
    std::string step;
    Instruction instruction;
  };
  std::map<std::uint32_t, Place> places;
  for (const std::uint32_t address : unique) {
    const std::uint32_t code = board.chip().bus().load(address).value_or(0);
    places[address] = {step_of(frames.at(address)), decode(static_cast<std::uint16_t>(code),
                                                           static_cast<std::uint16_t>(code >> 16), address)};
  }

  std::map<std::string, StepSum> sums;
  std::array<StepSum, 2> totals{};
  struct Waits {
    std::uint64_t flash = 0, flash_if_all_kept = 0, sram = 0, buses = 0, worst = 0;
  };
  std::array<Waits, 2> waits{};
  std::uint64_t flash_reads = 0;
  std::uint32_t estimate_worst = 0, motor_worst = 0, without_io_worst = 0;
  for (const RecordedTick& tick : ticks) {
    std::map<std::string, StepInTick> in_tick;
    MemoryWaits memory;
    std::uint64_t cycles_so_far = 0;
    std::size_t next_access = 0;
    const Place* previous = nullptr;
    for (std::size_t i = 0; i < tick.addresses.size(); ++i) {
      const Place& place = places.at(tick.addresses[i]);
      const bool taken = i + 1 < tick.addresses.size() &&
                         tick.addresses[i + 1] != tick.addresses[i] + place.instruction.bytes;
      StepInTick& step = in_tick[place.step];
      ++step.instructions;
      const bool in_line =
          previous != nullptr && tick.addresses[i] == tick.addresses[i - 1] + previous->instruction.bytes;
      const std::uint32_t its_cycles =
          place.instruction.cycles + (taken ? place.instruction.cycles_if_taken : 0U) -
          (in_line ? cycles_saved_behind(previous->instruction, place.instruction) : 0U);
      previous = &place;
      step.cycles += its_cycles;
      const std::uint64_t waits_before = memory.for_flash();
      const std::uint32_t fetched = tick.addresses[i];
      memory.fetch(fetched, place.instruction.bytes, cycles_so_far);
      for (; next_access < tick.accesses.size() && tick.accesses[next_access].at == i + 1; ++next_access)
        memory.access(tick.accesses[next_access].address, fetched, cycles_so_far);
      step.waits += memory.for_flash() - waits_before;
      cycles_so_far += its_cycles;
    }
    std::uint32_t cycles_of_tick = exception_cycles;
    for (const auto& [step, cost] : in_tick) {
      cycles_of_tick += cost.cycles;
      StepSum& sum = sums[step];
      ++sum.ticks;
      sum.instructions += cost.instructions;
      sum.cycles += cost.cycles;
      sum.waits += cost.waits;
      sum.worst = std::max(sum.worst, cost.instructions);
      sum.worst_cycles = std::max(sum.worst_cycles, cost.cycles);
    }
    const std::size_t axis = tick.axis & 1U;
    const auto instructions_of = [&in_tick](std::initializer_list<const char*> steps) {
      std::uint32_t sum = 0;
      for (const char* step : steps) {
        if (const auto found = in_tick.find(step); found != in_tick.end()) sum += found->second.instructions;
      }
      return sum;
    };
    estimate_worst =
        std::max(estimate_worst, instructions_of({"position", "re-sampling", "velocity (FOAW)"}));
    if (axis == 1) {
      motor_worst = std::max(motor_worst, instructions_of({"force to current", "PMSM current", "phase watch",
                                                           "motor control, the rest"}));
      without_io_worst =
          std::max(without_io_worst, static_cast<std::uint32_t>(tick.addresses.size()) -
                                         instructions_of({"encoder, index", "current sampling", "PWM"}));
    }
    flash_reads += memory.flash_reads();
    waits[axis].flash += memory.for_flash();
    waits[axis].flash_if_all_kept += memory.for_flash_if_all_kept();
    waits[axis].sram += memory.for_sram();
    waits[axis].buses += tick.register_waits;
    const std::uint64_t all_waits = memory.for_flash() + memory.for_sram() + tick.register_waits;
    waits[axis].worst = std::max(waits[axis].worst, cycles_of_tick + all_waits);
    StepSum& total = totals[axis];
    ++total.ticks;
    total.instructions += tick.addresses.size();
    total.cycles += cycles_of_tick;
    total.waits += all_waits;
    total.worst = std::max(total.worst, static_cast<std::uint32_t>(tick.addresses.size()));
    total.worst_cycles = std::max(total.worst_cycles, cycles_of_tick);
  }

  report.ticks = ticks.size();
  const auto add = [&report](const std::string& name, const StepSum& sum) {
    const auto count = static_cast<double>(std::max<std::uint64_t>(1, sum.ticks));
    report.steps.push_back({name, sum.ticks, sum.worst, static_cast<double>(sum.instructions) / count,
                            static_cast<double>(sum.cycles) / count, sum.worst_cycles,
                            static_cast<double>(sum.waits) / count});
  };
  std::set<std::string> shown;
  for (const StepPattern& pattern : patterns) {
    if (sums.contains(pattern.step) && shown.insert(pattern.step).second)
      add(pattern.step, sums[pattern.step]);
  }
  if (sums.contains(other_step)) add(other_step, sums[other_step]);
  add("whole tick, axis 0 (DC motor)", totals[0]);
  add("whole tick, axis 1 (PMSM)", totals[1]);

  const auto worst = [&sums](const char* step) { return static_cast<double>(sums[step].worst); };
  const double tick_cycles = of_board.core_clock_hz / of_board.pwm_hz();
  report.lines = {
      {"adaptive wall", worst("adaptive wall"), 90, "instructions", ""},
      {"position, FOAW (window 16) and re-sampling", static_cast<double>(estimate_worst), 220, "instructions",
       ""},
      {"DC current step", worst("DC current"), 45, "instructions", "lean reference 35"},
      {"PMSM current step", worst("PMSM current"), 150, "instructions",
       "lean reference 138, moteus core 202 and whole 420, ODrive 3.x 453, VESC 531, SimpleFOC 807"},
      // Theirs counted once, for the same core by the same compiler.
      {"PMSM: force to current, current, phases, heat", static_cast<double>(motor_worst), 230, "instructions",
       "ODrive 3.x 453: Clarke, sine table twice, PI, SVM; moteus ISR_DoCurrent 420: limits, feed-forward, "
       "anti-windup, PWM"},
      {"PMSM tick but for encoder, converters, PWM", static_cast<double>(without_io_worst), 950,
       "instructions", "moteus 1038: its position mode's whole tick without the encoder"},
      {"worst tick, axis 0 (DC motor)", static_cast<double>(totals[0].worst), 550, "instructions", ""},
      {"worst tick, axis 1 (PMSM)", static_cast<double>(totals[1].worst), 650, "instructions", ""},
      {"both axes, both worst ticks",
       100.0 * static_cast<double>(totals[0].worst_cycles + totals[1].worst_cycles) / tick_cycles, 25,
       fmt::format("% of {:.0f} MHz", of_board.core_clock_hz * 1e-6),
       "moteus 1559 cycles for one axis without encoder; ours is both worst ticks together"},
      {fmt::format("main loop without traffic, {:.0f} us", round_s * 1e6),
       static_cast<double>(main_loop) * round_s / measured, 1200, "instructions", ""},
  };
  for (std::size_t axis = 0; axis < totals.size(); ++axis) {
    const auto share = [&](std::uint64_t of_all) {
      return 100.0 * static_cast<double>(of_all) /
             static_cast<double>(std::max<std::uint64_t>(1, totals[axis].ticks)) / tick_cycles;
    };
    report.with_waits.mean +=
        share(totals[axis].cycles + waits[axis].flash + waits[axis].sram + waits[axis].buses);
    report.with_waits.flash += share(waits[axis].flash);
    report.with_waits.flash_if_all_kept += share(waits[axis].flash_if_all_kept);
    report.with_waits.sram += share(waits[axis].sram);
    report.with_waits.buses += share(waits[axis].buses);
    report.with_waits.worst += 100.0 * static_cast<double>(waits[axis].worst) / tick_cycles;
  }
  report.lines.push_back({"both axes with all waits, on average", report.with_waits.mean, 30,
                          fmt::format("% of {:.0f} MHz", of_board.core_clock_hz * 1e-6), ""});
  report.lines.push_back({"the tick reads from flash", static_cast<double>(flash_reads), 0, "times", ""});
  return report;
}

std::string budget_table(const BudgetReport& report) {
  std::string text = fmt::format("{:<31} {:>6} {:>6} {:>7} {:>7} {:>6} {:>8}\n", "step of the tick", "ticks",
                                 "worst", "mean", "cycles", "worst", "waits");
  text += fmt::format("{:<31} {:>6} {:>14} {:>14} {:>8}\n", "", "", "instructions", "without waits", "mean");
  for (const StepCost& step : report.steps) {
    text += fmt::format("{:<31} {:>6} {:>6} {:>7.1f} {:>7.1f} {:>6} {:>8.1f}\n", step.name, step.ticks,
                        step.worst, step.mean, step.mean_cycles, step.worst_cycles, step.mean_waits);
  }
  text += "\nbudget\n";
  for (const BudgetLine& line : report.lines) {
    text += fmt::format("  {:<6} {:<44} {:>7.1f} of {:>5.0f} {}\n", line.kept() ? "kept" : "BROKEN",
                        line.name, line.value, line.bound, line.unit);
    if (!line.peers.empty()) text += fmt::format("         peers: {}\n", line.peers);
  }
  text += fmt::format(
      "\nwith the waits for flash and buses: both axes {:.1f} % of the core's time on average, of which "
      "{:.1f} for flash\n"
      "({:.1f} if the cache keeps prefetched lines as well), {:.1f} for data where the code is fetched from "
      "and {:.1f} for\n"
      "register accesses; {:.1f} % with both worst ticks together\n",
      report.with_waits.mean, report.with_waits.flash, report.with_waits.flash_if_all_kept,
      report.with_waits.sram, report.with_waits.buses, report.with_waits.worst);
  text += fmt::format(
      "\nmain loop with the CAN bus full and one Modbus master that asks: {:.0f} instructions in a round's "
      "time; "
      "{:.0f} SDO\nanswers and {:.0f} serial replies of 124 registers a second\n",
      report.with_traffic.instructions, report.with_traffic.sdo_answers, report.with_traffic.serial_replies);
  text +=
      "\nInstructions are exact; one that an IT block skips counts as executed. Cycles are a model (no wait "
      "states, but where it says so) that no\n"
      "board has confirmed.\n";
  return text;
}

std::string budget_json(const BudgetReport& report) {
  nlohmann::json document;
  document["kept"] = report.kept();
  document["ticks"] = report.ticks;
  document["with_waits"] = {{"mean_percent", report.with_waits.mean},
                            {"worst_percent", report.with_waits.worst},
                            {"flash_percent", report.with_waits.flash},
                            {"flash_percent_if_all_kept", report.with_waits.flash_if_all_kept},
                            {"sram_percent", report.with_waits.sram},
                            {"buses_percent", report.with_waits.buses}};
  document["with_traffic"] = {{"main_loop_instructions", report.with_traffic.instructions},
                              {"sdo_answers_per_second", report.with_traffic.sdo_answers},
                              {"serial_replies_per_second", report.with_traffic.serial_replies}};
  for (const StepCost& step : report.steps) {
    document["steps"].push_back({{"name", step.name},
                                 {"ticks", step.ticks},
                                 {"worst_instructions", step.worst},
                                 {"mean_instructions", step.mean},
                                 {"mean_cycles", step.mean_cycles},
                                 {"worst_cycles", step.worst_cycles},
                                 {"mean_waits", step.mean_waits}});
  }
  for (const BudgetLine& line : report.lines) {
    document["budget"].push_back({{"name", line.name},
                                  {"value", line.value},
                                  {"bound", line.bound},
                                  {"unit", line.unit},
                                  {"kept", line.kept()},
                                  {"peers", line.peers}});
  }
  return document.dump(2) + "\n";
}

}  // namespace kmax::virtual_board
