#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cstddef>
#include <fstream>
#include <nlohmann/json.hpp>
#include <stdexcept>
#include <string>

#include "board/odrive_v3/description.hpp"
#include "tests/benchmarks/speed_and_error/sections.hpp"

namespace kmax::benchmark {
namespace {

constexpr double clock_frequency = board::odrive_v3::description.core_clock_hz;

// Of a tick's steps, those that are HapticLoop::tick().
constexpr std::array haptic_steps{"re-sampling",          "velocity (FOAW)", "adaptive wall",
                                  "interference",         "force limiter",   "instability watch",
                                  "haptic loop, the rest"};

std::string microseconds(double cycles) {
  return fmt::format("{:.2f}", 1e6 * cycles / clock_frequency);
}

}  // namespace

report::Section image_section(const std::filesystem::path& budget) {
  std::ifstream file(budget);
  if (!file) throw std::runtime_error(fmt::format("{}: cannot be read", budget.string()));
  nlohmann::json read;
  double instructions = 0.0, cycles = 0.0;
  std::size_t found = 0;
  report::Section section;
  section.heading = "Native against image";
  try {
    file >> read;
    for (const auto& step : read.at("steps")) {
      const auto name = step.at("name").get<std::string>();
      if (std::find(haptic_steps.begin(), haptic_steps.end(), name) == haptic_steps.end()) continue;
      instructions += step.at("mean_instructions").get<double>();
      cycles += step.at("mean_cycles").get<double>();
      ++found;
    }
  } catch (const nlohmann::json::exception& error) {
    throw std::runtime_error(fmt::format("{}: not what 'kmax-board ELF --budget --json' prints: {}",
                                         budget.string(), error.what()));
  }
  if (found != haptic_steps.size())
    throw std::runtime_error(fmt::format("{}: holds {} of the {} steps of the haptic loop", budget.string(),
                                         found, haptic_steps.size()));
  const double native = native_haptic_tick();
  section.paragraphs = {
      "Compared: the same haptic loop (adaptive wall, FOAW with 16 intervals of two ticks, every tick at "
      "20 kHz) compiled for this computer and in the flashed image on the virtual board, which counts the "
      "image's instructions and models the cycles of each "
      "(host_tools/virtual_board/cortex_m/instruction.hpp; wait states of the flash are left out). The "
      "input differs, the code does not.",
      "The values are equal bit for bit: tests/image/parity/parity_test.cpp repeats every call of the axis' "
      "tick in the image on this side with the very bytes that it was given, and allows no difference. So "
      "there is no error to weigh against the speed here. What the other steps of the image's tick cost "
      "stands in [virtual_board.md](virtual_board.md)."};
  report::Table loop{"HapticLoop::tick(), one call:", {"where", "instructions", "cycles", "time (us)"}, {}};
  loop.rows.push_back({"image, Cortex-M4F at 168 MHz", fmt::format("{:.0f}", instructions),
                       fmt::format("{:.0f}", cycles), microseconds(cycles)});
  loop.rows.push_back({"native, this computer", "", "", fmt::format("{:.3f}", 1e-3 * native)});
  loop.rows.push_back(
      {"image's time / native's", "", "", fmt::format("{:.0f}", 1e9 * cycles / clock_frequency / native)});
  section.tables = {loop};
  return section;
}

}  // namespace kmax::benchmark
