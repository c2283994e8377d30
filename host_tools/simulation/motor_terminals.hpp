#pragma once
// How a power stage and a motor meet: three terminals A, B, C in this order, each with a voltage against the
// supply's negative rail and a current that is positive into the motor. A brushed DC motor has only B and C.

#include <array>
#include <cstddef>

namespace kmax::simulation {

inline constexpr std::size_t terminal_count = 3;
inline constexpr std::size_t terminal_a = 0, terminal_b = 1, terminal_c = 2;

using TerminalValues = std::array<double, terminal_count>;

// What the power stage does to the motor for a while.
struct TerminalDrive {
  TerminalValues voltage{};                       // V, constant; read where `conducting` only
  std::array<bool, terminal_count> conducting{};  // false: no current can flow there
  double leg_resistance = 0.0;                    // ohm in series with every terminal
};

// The shaft during that while: it turns with constant speed.
struct ShaftMotion {
  double angle = 0.0;  // rad, mechanical, at the beginning
  double speed = 0.0;  // rad/s
};

}  // namespace kmax::simulation
