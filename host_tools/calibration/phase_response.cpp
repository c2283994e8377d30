#include "host_tools/calibration/phase_response.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>

namespace kmax::calibration {

namespace {
using bench::Circuit;

std::string cause_of(Circuit circuit) {
  switch (circuit) {
    case Circuit::healthy:
      return "";
    case Circuit::open_a:
      return "phase_a_open";
    case Circuit::open_b:
      return "phase_b_open";
    case Circuit::open_c:
      return "phase_c_open";
    case Circuit::sense_b_inverted:
      return "current_b_inverted";
    case Circuit::sense_c_inverted:
      return "current_c_inverted";
    case Circuit::both_inverted:
      return "current_b_and_c_inverted";
    case Circuit::sense_b_dead:
      return "current_b_dead";
    case Circuit::sense_c_dead:
      return "current_c_dead";
    default:
      return "phases_unbalanced";
  }
}

std::string advice_for(const std::string& cause) {
  if (cause.starts_with("phase_")) return "check that wire of the motor, its connector and its solder joints";
  if (cause.ends_with("inverted"))
    return "that sensor shows current against its real direction: check the shunt's sense wires or the "
           "amplifier";
  return "that sensor shows no current while the other does: check its shunt, amplifier and converter pin";
}
}  // namespace

SensorAnswer phase_response(std::span<const double> voltage, std::span<const double> current_b,
                            std::span<const double> current_c, int half_period, std::size_t from) {
  // The last quarter of a half wave: there a slow current, too, has the sign of its voltage.
  const auto settled = static_cast<std::size_t>(std::max(1, half_period * 3 / 4));
  SensorAnswer sum_high, sum_low;
  std::size_t high = 0, low = 0, run = 0;
  for (std::size_t k = 1; k < voltage.size(); ++k) {
    const bool positive = voltage[k - 1] > 0.0;
    run = k >= 2 && positive == (voltage[k - 2] > 0.0) ? run + 1 : 1;
    if (run < settled || k < from) continue;
    SensorAnswer& sum = positive ? sum_high : sum_low;
    sum.b += current_b[k];
    sum.c += current_c[k];
    ++(positive ? high : low);
  }
  if (high == 0 || low == 0) return {};
  const auto h = static_cast<double>(high), l = static_cast<double>(low);
  return {0.5 * (sum_high.b / h - sum_low.b / l), 0.5 * (sum_high.c / h - sum_low.c / l)};
}

double magnitude_of(const SensorAnswer& along_0, const SensorAnswer& along_90) {
  return std::max({std::abs(along_0.b), std::abs(along_0.c), std::abs(along_90.b), std::abs(along_90.c)});
}

std::optional<Diagnosis> diagnose_phases(bool brushed, const SensorAnswer& along_0,
                                         const SensorAnswer& along_90) {
  constexpr double directions[] = {0.0, 0.5 * std::numbers::pi};
  const SensorAnswer seen[] = {along_0, along_90};
  const bench::CircuitMatch match =
      bench::match_circuit(brushed, directions, std::span(seen).first(brushed ? 1 : 2));
  const std::string numbers =
      brushed ? fmt::format("a voltage from B to C drives {:+.3f} A in B and {:+.3f} A in C", along_0.b,
                            along_0.c)
              : fmt::format(
                    "a voltage along phase A drives {:+.3f} A in B and {:+.3f} A in C, a quarter turn ahead "
                    "{:+.3f} A and {:+.3f} A",
                    along_0.b, along_0.c, along_90.b, along_90.c);
  constexpr double least_cosine = 0.9;  // of the angle between what is seen and the pattern
  if (!(match.residual <= 1.0 - least_cosine * least_cosine))
    return Diagnosis{"phases_unbalanced", numbers + ": no healthy motor and no single defect looks like this",
                     "check the motor's wires against each other and to ground"};
  const std::string cause = cause_of(match.circuit);
  if (cause.empty()) return std::nullopt;
  return Diagnosis{cause, numbers, advice_for(cause)};
}

}  // namespace kmax::calibration
