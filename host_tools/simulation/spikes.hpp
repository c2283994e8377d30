#pragma once
// Pulses that the bridges' switching couples into lines without a filter: the indexes, the emergency stop,
// the gate drivers' fault line, A and B of the encoders. While a bridge switches.
//
// How wide and how frequent they are on a real board is a guess: ODrive's users report both, and nobody gives
// numbers. A pulse on A and B counts four edges in one direction if it is longer than what the timer's input
// filter takes out.

#include <array>

#include "host_tools/simulation/model_field.hpp"

namespace kmax::simulation {

struct SpikesConfig {
  double width = 0.5e-6;  // s
  double rate = 100.0;    // 1/s, of each line
  // Where they begin: within 4 us after a conversion, which is when the firmware looks and where the other
  // axis' edges are at a duty near 0 or 1; else at an edge of the present duties.
  bool at_samples = false;
  bool index = true, emergency_stop = true, fault_line = true, encoder = true;
};

inline constexpr std::array spikes_fields{
    ModelField<SpikesConfig>{"width", &SpikesConfig::width, 10e-9, 1e-3, "s", "length of a pulse"},
    ModelField<SpikesConfig>{"rate", &SpikesConfig::rate, 0.0, 20e3, "1/s", "pulses per second on each line"},
};

}  // namespace kmax::simulation
