#include "host_tools/bring_up/bring_up.hpp"

#include <fmt/chrono.h>
#include <fmt/format.h>

#include <chrono>

#include "host_tools/bench/power_stage.hpp"

namespace kmax::bring_up {

namespace {
StageResult run(Stage stage, device::Device& device, const Settings& settings, const Party& party) {
  switch (stage) {
    case Stage::logic:
      return try_logic(device, settings, party);
    case Stage::gate_drivers:
      return try_gate_drivers(device, settings, party);
    case Stage::load:
      return try_load(device, settings, party);
    case Stage::motor:
      return try_motor(device, settings, party);
    case Stage::calibration:
      return try_calibration(device, settings, party);
    case Stage::wall:
      return try_wall(device, settings, party);
    case Stage::stiffer:
      return try_stiffer(device, settings, party);
  }
  throw std::logic_error("there is no such stage");
}

std::string time_now() {
  return fmt::format("{:%Y-%m-%dT%H:%M:%SZ}", fmt::gmtime(std::chrono::system_clock::now()));
}

void require_turn(const Report& report, const Settings& settings) {
  for (const StageText& text : all_stages()) {
    if (text.stage >= *settings.only) return;
    if (!report.passed(settings.axis, text.stage))
      throw OutOfTurn(
          fmt::format("stage '{}' comes after '{}', which has not passed on axis {}: 'kmax bring-up --axis "
                      "{}' goes on there",
                      text_of(*settings.only).name, text.name, settings.axis, settings.axis));
  }
}

/// False: it failed.
bool do_stage(Stage stage, device::Device& device, Report& report, const Settings& settings,
              const Party& party, const std::function<void(const Report&)>& keep) {
  const StageText& text = text_of(stage);
  party.person.ask(
      fmt::format("Stage {}: {}.\nConnect: {}\nThis will happen: {}\nConnect it, look at it once more",
                  text.name, text.title, text.connect, text.does));
  party.begins(text);
  StageResult result = run(stage, device, settings, party);
  if (stage == Stage::stiffer) result.checks.push_back(check_offsets(device, settings.axis, report));
  result.stage = stage;
  result.time = time_now();
  const bool passed = result.passed();
  party.ended(result);
  report.add(settings.axis, std::move(result));
  keep(report);
  return passed;
}
}  // namespace

bool bring_up(device::Device& device, Report& report, const Settings& settings, const Party& party,
              const std::function<void(const Report&)>& keep) {
  // Its dividers, gate drivers and connectors are those that the stages speak of.
  bench::power_stage_of(device);
  if (settings.only) {
    require_turn(report, settings);
    return do_stage(*settings.only, device, report, settings, party, keep);
  }
  while (const auto stage = report.next(settings.axis)) {
    if (!do_stage(*stage, device, report, settings, party, keep)) return false;
  }
  return true;
}

}  // namespace kmax::bring_up
