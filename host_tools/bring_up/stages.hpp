#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string_view>

namespace kmax::bring_up {

/// How far a new board has been taken, in this order: each adds one thing that can go wrong, at the smallest
/// force and current that shows it.
enum class Stage : std::uint8_t { logic, gate_drivers, load, motor, calibration, wall, stiffer };

struct StageText {
  Stage stage;
  std::string_view name;     ///< for the command line and the report
  std::string_view title;    ///< what is looked at
  std::string_view connect;  ///< what must be connected, by the board's own print
  std::string_view does;     ///< what will be done, and within which limits
};

/// In their order.
std::span<const StageText> all_stages();
const StageText& text_of(Stage stage);
std::optional<Stage> stage_named(std::string_view name);

}  // namespace kmax::bring_up
