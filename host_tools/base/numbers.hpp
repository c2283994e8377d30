#pragma once

#include <string>

namespace kmax::device {

/// The double whose shortest text is also the shortest text that reads back as this float32: 2.4f gives
/// 2.4, not 2.4000000953674316. For JSON, whose numbers are doubles.
double shortest_double(float value);

/// Shortest text that reads back as the same number. Plain decimals from 0.0001 up to a million; beyond
/// that a power of ten where it is shorter ("1e6", "-2.5e-7").
std::string number_text(double value);
inline std::string number_text(float value) {
  return number_text(shortest_double(value));
}

}  // namespace kmax::device
