#include "host_tools/bench/power_stage.hpp"

#include <fmt/format.h>

#include <array>
#include <string>

#include "board/odrive_v3/description.hpp"

namespace kmax::bench {

namespace {
struct KnownBoard {
  std::string_view name;
  const board::BoardDescription* power_stage;
};
// A board with a bridge needs a row here for calibration and the offsets of its amplifiers. What is flashed
// of it is in flash/board_profile.cpp; the stages of bring_up are written for these boards alone.
constexpr std::array<KnownBoard, 2> known_boards = {{
    {board::odrive_v3::description.name, &board::odrive_v3::description},
    // Simulated, it has the same power stage (simulated_board/simulated_power_hardware.hpp).
    {"native", &board::odrive_v3::description},
}};
}  // namespace

const board::BoardDescription* power_stage_of_board(std::string_view board) {
  for (const KnownBoard& known : known_boards) {
    if (known.name == board) return known.power_stage;
  }
  return nullptr;
}

const board::BoardDescription& power_stage_of(device::Device& device) {
  const auto texts = device.identify();
  const auto found = texts.find("model_name");
  const std::string board = found == texts.end() ? "" : found->second;
  if (const board::BoardDescription* power_stage = power_stage_of_board(board)) return *power_stage;
  std::string known;
  for (const KnownBoard& one : known_boards)
    known += fmt::format("{}{}", known.empty() ? "" : ", ", one.name);
  throw base::DeviceError(fmt::format(
      "the device {}, and what its power stage is (shunts, dead time, PWM) is not known here; known are {}: "
      "take the tools that were built with the device's firmware. A board without a bridge has no current to "
      "measure",
      board.empty() ? "does not say which board it is" : fmt::format("says that it is the board '{}'", board),
      known));
}

}  // namespace kmax::bench
