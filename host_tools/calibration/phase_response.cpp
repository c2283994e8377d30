#include "host_tools/calibration/phase_response.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <string>

namespace kmax::calibration {

namespace {
struct Pattern {
  const char* cause;  // empty: healthy
  std::array<double, 4> currents;
};

// B and C along 0, B and C along 90 degrees, in units of voltage / phase resistance.
constexpr double half = 0.5, root = 0.8660254037844386, third = 0.75, shared = 0.4330127018922193;
constexpr std::array patterns = {
    Pattern{"", {-half, -half, root, -root}},
    Pattern{"phase_a_open", {0, 0, root, -root}},
    Pattern{"phase_b_open", {0, -third, 0, -shared}},
    Pattern{"phase_c_open", {-third, 0, shared, 0}},
    Pattern{"current_b_inverted", {half, -half, -root, -root}},
    Pattern{"current_c_inverted", {-half, half, root, root}},
    Pattern{"current_b_and_c_inverted", {half, half, -root, root}},
    Pattern{"current_b_dead", {0, -half, 0, -root}},
    Pattern{"current_c_dead", {-half, 0, root, 0}},
};
constexpr std::array brushed_patterns = {
    Pattern{"", {1, -1, 0, 0}},
    Pattern{"current_b_inverted", {-1, -1, 0, 0}},
    Pattern{"current_c_inverted", {1, 1, 0, 0}},
    Pattern{"current_b_and_c_inverted", {-1, 1, 0, 0}},
    Pattern{"current_b_dead", {0, -1, 0, 0}},
    Pattern{"current_c_dead", {1, 0, 0, 0}},
};

double cosine(const std::array<double, 4>& a, const std::array<double, 4>& b) {
  double product = 0.0, of_a = 0.0, of_b = 0.0;
  for (std::size_t i = 0; i < a.size(); ++i) {
    product += a[i] * b[i];
    of_a += a[i] * a[i];
    of_b += b[i] * b[i];
  }
  return of_a > 0.0 && of_b > 0.0 ? product / std::sqrt(of_a * of_b) : 0.0;
}

std::string advice_for(const std::string& cause) {
  if (cause.starts_with("phase_")) return "check that wire of the motor, its connector and its solder joints";
  if (cause.ends_with("inverted"))
    return "that sensor shows current against its real direction: check the shunt's sense wires or the "
           "amplifier";
  return "that sensor shows no current while the other does: check its shunt, amplifier and converter pin";
}
}  // namespace

PhaseResponse phase_response(std::span<const double> voltage, std::span<const double> current_b,
                             std::span<const double> current_c, int half_period, std::size_t from) {
  // The last quarter of a half wave: there a slow current, too, has the sign of its voltage.
  const auto settled = static_cast<std::size_t>(std::max(1, half_period * 3 / 4));
  PhaseResponse sum_high, sum_low;
  std::size_t high = 0, low = 0, run = 0;
  for (std::size_t k = 1; k < voltage.size(); ++k) {
    const bool positive = voltage[k - 1] > 0.0;
    run = k >= 2 && positive == (voltage[k - 2] > 0.0) ? run + 1 : 1;
    if (run < settled || k < from) continue;
    PhaseResponse& sum = positive ? sum_high : sum_low;
    sum.b += current_b[k];
    sum.c += current_c[k];
    ++(positive ? high : low);
  }
  if (high == 0 || low == 0) return {};
  const auto h = static_cast<double>(high), l = static_cast<double>(low);
  return {0.5 * (sum_high.b / h - sum_low.b / l), 0.5 * (sum_high.c / h - sum_low.c / l)};
}

double magnitude_of(const PhaseResponse& along_0, const PhaseResponse& along_90) {
  return std::max({std::abs(along_0.b), std::abs(along_0.c), std::abs(along_90.b), std::abs(along_90.c)});
}

std::optional<Diagnosis> diagnose_phases(bool brushed, const PhaseResponse& along_0,
                                         const PhaseResponse& along_90) {
  const std::array<double, 4> seen = {along_0.b, along_0.c, brushed ? 0.0 : along_90.b,
                                      brushed ? 0.0 : along_90.c};
  const std::span<const Pattern> all = brushed ? std::span<const Pattern>(brushed_patterns) : patterns;
  const Pattern* best = &all.front();
  for (const Pattern& pattern : all) {
    if (cosine(seen, pattern.currents) > cosine(seen, best->currents)) best = &pattern;
  }
  const std::string numbers =
      brushed
          ? fmt::format("a voltage from B to C drives {:+.3f} A in B and {:+.3f} A in C", seen[0], seen[1])
          : fmt::format(
                "a voltage along phase A drives {:+.3f} A in B and {:+.3f} A in C, a quarter turn ahead "
                "{:+.3f} A and {:+.3f} A",
                seen[0], seen[1], seen[2], seen[3]);
  constexpr double least_cosine = 0.9;
  if (cosine(seen, best->currents) < least_cosine)
    return Diagnosis{"phases_unbalanced", numbers + ": no healthy motor and no single defect looks like this",
                     "check the motor's wires against each other and to ground"};
  const std::string cause = best->cause;
  if (cause.empty()) return std::nullopt;
  return Diagnosis{cause, numbers, advice_for(cause)};
}

}  // namespace kmax::calibration
