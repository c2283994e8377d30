#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cstddef>
#include <fstream>
#include <nlohmann/json.hpp>
#include <stdexcept>
#include <string>

#include "board/odrive_v3/description.hpp"
#include "host_tools/plot/figure.hpp"
#include "tests/benchmarks/speed_and_error/sections.hpp"

namespace kmax::benchmark {
namespace {

constexpr double clock_frequency = board::odrive_v3::description.core_clock_hz;

// Of a tick's steps, those that are HapticLoop::tick().
constexpr std::array haptic_steps{"re-sampling",  "velocity (FOAW)", "adaptive wall",
                                  "interference", "force limiter",   "haptic loop, the rest"};

struct Cost {
  double instructions = 0.0, worst_instructions = 0.0, cycles = 0.0, worst_cycles = 0.0;
  Cost& operator+=(const Cost& other) {
    instructions += other.instructions;
    worst_instructions += other.worst_instructions;
    cycles += other.cycles;
    worst_cycles += other.worst_cycles;
    return *this;
  }
};

std::string microseconds(double cycles) {
  return fmt::format("{:.2f}", 1e6 * cycles / clock_frequency);
}

std::vector<std::string> row_of(const std::string& name, const Cost& cost) {
  return {name,
          fmt::format("{:.0f}", cost.instructions),
          fmt::format("{:.0f}", cost.worst_instructions),
          fmt::format("{:.0f}", cost.cycles),
          fmt::format("{:.0f}", cost.worst_cycles),
          microseconds(cost.cycles)};
}

}  // namespace

report::Section image_section(const std::filesystem::path& pictures, const std::filesystem::path& budget) {
  std::ifstream file(budget);
  if (!file) throw std::runtime_error(fmt::format("{}: cannot be read", budget.string()));
  nlohmann::json read;
  Cost haptic;
  std::size_t found = 0;
  report::Section section;
  section.heading = "Native against image";
  report::Table steps{"The image, per tick of one axis, by step:",
                      {"step", "instructions, mean", "instructions, worst", "cycles, mean", "cycles, worst",
                       "mean at 168 MHz (us)"},
                      {}};
  plot::Figure figure;
  figure.title = "The image's tick: cycles against instructions, by step";
  figure.x_label = "instructions, mean";
  figure.log_x = figure.legend_beside = true;
  figure.panels = {{"cycles, mean (modelled)", {}, {}, std::nullopt, true}};
  plot::Series others{"other steps", {}, {}, false, true}, loops{"of the haptic loop", {}, {}, false, true},
      whole{"whole ticks", {}, {}, false, true};
  try {
    file >> read;
    for (const auto& step : read.at("steps")) {
      const auto name = step.at("name").get<std::string>();
      const Cost cost{step.at("mean_instructions").get<double>(), step.at("worst_instructions").get<double>(),
                      step.at("mean_cycles").get<double>(), step.at("worst_cycles").get<double>()};
      steps.rows.push_back(row_of(name, cost));
      const bool is_haptic = std::find(haptic_steps.begin(), haptic_steps.end(), name) != haptic_steps.end();
      if (is_haptic) {
        haptic += cost;
        ++found;
      }
      plot::Series& series = is_haptic ? loops : name.starts_with("whole tick") ? whole : others;
      // A gap between two points: no line joins what is no sequence.
      for (const double gap : {0.0, 1.0}) {
        series.x.push_back(gap * cost.instructions);
        series.y.push_back(gap * cost.cycles);
      }
    }
  } catch (const nlohmann::json::exception& error) {
    throw std::runtime_error(fmt::format("{}: not what 'kmax-board ELF --budget --json' prints: {}",
                                         budget.string(), error.what()));
  }
  if (found != haptic_steps.size())
    throw std::runtime_error(fmt::format("{}: holds {} of the {} steps of the haptic loop", budget.string(),
                                         found, haptic_steps.size()));
  figure.panels[0].series = {loops, others, whole};
  plot::write_figure(figure, pictures / "speed_image.svg");

  const double native = native_haptic_tick();
  section.paragraphs = {
      "Compared: the same haptic loop (adaptive wall, FOAW with 16 intervals, every tick at 20 kHz) compiled "
      "for this computer and in the flashed image on the virtual board, which counts the image's "
      "instructions and models the cycles of each (host_tools/virtual_board/cortex_m/instruction.hpp; wait "
      "states of the flash are left out). The input differs, the code does not.",
      "The values are equal bit for bit: tests/image/parity_test.cpp repeats every call of the axis' tick in "
      "the image on this side with the very bytes that it was given, and allows no difference. So there is "
      "no error to weigh against the speed here."};
  report::Table loop{"HapticLoop::tick(), one call:", {"where", "instructions", "cycles", "time (us)"}, {}};
  loop.rows.push_back({"image, Cortex-M4F at 168 MHz", fmt::format("{:.0f}", haptic.instructions),
                       fmt::format("{:.0f}", haptic.cycles), microseconds(haptic.cycles)});
  loop.rows.push_back({"native, this computer", "", "", fmt::format("{:.3f}", 1e-3 * native)});
  loop.rows.push_back({"image's time / native's", "", "",
                       fmt::format("{:.0f}", 1e9 * haptic.cycles / clock_frequency / native)});
  section.tables = {loop, steps};
  section.pictures = {{figure.title, pictures / "speed_image.svg"}};
  return section;
}

}  // namespace kmax::benchmark
