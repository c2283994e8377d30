#include "host_tools/selftest/winding_model.hpp"

#include <cmath>

namespace kmax::selftest {

std::vector<double> lagged_voltage(const std::vector<double>& voltage, double time_constant, double tick) {
  const double half = std::exp(-0.5 * tick / time_constant);
  std::vector<double> out(voltage.size(), 0.0);
  for (std::size_t k = 1; k < out.size(); ++k) {
    const double before = k >= 2 ? voltage[k - 2] : 0.0;
    out[k] = half * half * out[k - 1] + (1.0 - half) * (half * before + voltage[k - 1]);
  }
  return out;
}

std::vector<double> lagged(const std::vector<double>& values, double time_constant, double tick) {
  const double stays = std::exp(-tick / time_constant);
  std::vector<double> out(values.size(), 0.0);
  for (std::size_t k = 1; k < out.size(); ++k)
    out[k] = stays * out[k - 1] + (1.0 - stays) * 0.5 * (values[k - 1] + values[k]);
  return out;
}

}  // namespace kmax::selftest
