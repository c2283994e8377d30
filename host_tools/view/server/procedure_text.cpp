#include "host_tools/view/server/procedure_text.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <vector>

#include "host_tools/base/errors.hpp"

namespace kmax::view {
namespace {

constexpr ProcedureText texts[] = {
    {"self_test", "Self-test",
     "Arms the axis with small voltages, which move the handle by well under 1 mm. Keep the handle free. The "
     "axis is disarmed afterwards, and every parameter is as it was.",
     "move the handle and press the emergency stop when asked to", 0},
    {"calibration", "Calibration",
     "Arms the axis: the handle trembles, and moves by up to 20 mm to either side. Nobody may hold it. "
     "Before: motor.kind, encoder.kind, encoder.counts_per_turn, device.transmission and current.limit must "
     "be right.",
     "move the handle by hand when asked to, which shows where positive is", 0},
    {"contact", "Contact with a stiff wall",
     "Arms the axis for each touch. Some of these walls oscillate under the hand: that is what is measured. "
     "Approach at 0.2 m/s or so, and hold the handle firmly. Forces stay below 3.3 N.",
     "", 3},
};

}  // namespace

std::span<const ProcedureText> procedure_texts() {
  return texts;
}

const ProcedureText& procedure_named(std::string_view name) {
  std::vector<std::string_view> names;
  for (const ProcedureText& text : texts) {
    if (text.name == name) return text;
    names.push_back(text.name);
  }
  throw base::ValueError(
      fmt::format("there is no procedure '{}'; procedures are {}", name, fmt::join(names, ", ")));
}

}  // namespace kmax::view
