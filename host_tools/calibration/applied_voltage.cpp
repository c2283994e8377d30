#include "host_tools/calibration/applied_voltage.hpp"

#include <algorithm>
#include <cmath>

namespace kmax::calibration {
namespace {

double rounded(double duty, double timer_steps) {
  return std::floor(std::clamp(duty, 0.0, 1.0) * timer_steps + 0.5) / timer_steps;
}

}  // namespace

double applied_brushed_voltage(const board::BoardDescription& board, double asked, double supply) {
  if (!(supply > 0.0)) return 0.0;
  const double share = 0.5 * asked / supply;
  return (rounded(0.5 + share, board.half_period_ticks) - rounded(0.5 - share, board.half_period_ticks)) *
         supply;
}

VoltageVector applied_vector(const board::BoardDescription& board, const VoltageVector& asked, double angle,
                             double supply) {
  if (!(supply > 0.0)) return {};
  const double half_root_three = 0.5 * std::sqrt(3.0);
  const double cosine = std::cos(angle), sine = std::sin(angle);
  const double alpha = (asked.d * cosine - asked.q * sine) / supply;
  const double beta = (asked.d * sine + asked.q * cosine) / supply;
  const double b = half_root_three * beta - 0.5 * alpha;
  const double c = -half_root_three * beta - 0.5 * alpha;
  const double centre = 0.5 - 0.5 * (std::max({alpha, b, c}) + std::min({alpha, b, c}));
  const double duty_a = rounded(centre + alpha, board.half_period_ticks);
  const double duty_b = rounded(centre + b, board.half_period_ticks);
  const double duty_c = rounded(centre + c, board.half_period_ticks);
  const double given_alpha = supply * (2.0 * duty_a - duty_b - duty_c) / 3.0;
  const double given_beta = supply * (duty_b - duty_c) / std::sqrt(3.0);
  return {given_alpha * cosine + given_beta * sine, given_beta * cosine - given_alpha * sine};
}

}  // namespace kmax::calibration
