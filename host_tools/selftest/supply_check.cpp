// Is the supply within its limits, at rest and while the motor draws on it?
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "host_tools/selftest/evidence.hpp"

namespace kmax::selftest {

namespace {
/// Source resistance from how the supply follows the power that the pulse takes: V = E - R i, i = v i_m / V.
struct Sag {
  double lowest = 0.0, resistance = 0.0, deviation = 0.0;
};

Sag sag_of(const Recording& recording, bool synchronous) {
  const auto current = current_along(recording, synchronous);
  const double share = synchronous ? 1.5 : 1.0;  // power of three phases by the amplitudes of one
  double drawn = 0.0, seen = 0.0, square = 0.0;
  Sag sag;
  const MeanAndDeviation rest = mean_and_deviation(recording.supply, 0, recording.before);
  sag.lowest = rest.mean;
  const std::size_t end = end_of_pulse(recording);
  for (std::size_t k = recording.before; k < end; ++k) {
    sag.lowest = std::min(sag.lowest, recording.supply[k]);
    const double taken = share * recording.voltage[k] * current[k] / std::max(recording.supply[k], 1.0);
    drawn += taken;
    seen += (rest.mean - recording.supply[k]) * taken;
    square += taken * taken;
  }
  if (square > 0.0 && drawn > 0.0) {
    sag.resistance = seen / square;
    sag.deviation = rest.deviation / std::sqrt(square);
  }
  return sag;
}
}  // namespace

CheckResult check_supply(const Evidence& evidence) {
  CheckResult result{"supply", Verdict::pass, "", {}, ""};
  const AxisFacts& facts = evidence.facts;
  if (!evidence.measures_currents()) {
    result.verdict = Verdict::not_judged;
    result.message = "this board does not measure its supply";
    return result;
  }
  const MeanAndDeviation rest = mean_and_deviation(evidence.supply, 0, evidence.supply.size());
  const auto [low, high] = std::minmax_element(evidence.supply.begin(), evidence.supply.end());
  const double lowest = low == evidence.supply.end() ? 0.0 : *low;
  const double highest = high == evidence.supply.end() ? 0.0 : *high;
  result.values = {{"voltage", rest.mean, "V"}, {"lowest", lowest, "V"}, {"highest", highest, "V"}};
  const std::string allowed =
      fmt::format("allowed is {:.1f} .. {:.1f} V (supply.voltage_min, supply.voltage_max)", facts.supply_min,
                  facts.supply_max);
  const auto fail = [&](const std::string& message) {
    result.verdict = Verdict::fail;
    result.part = "supply";
    result.message = message;
    return result;
  };
  if (rest.mean < 1.0)
    return fail(
        fmt::format("{:.2f} V: the power stage has no supply; switch it on, check its cable, fuse and "
                    "polarity; {}",
                    rest.mean, allowed));
  if (lowest < facts.supply_min)
    return fail(
        fmt::format("{:.2f} V is too low; {}; set or charge the supply, or lower supply.voltage_min if "
                    "it is meant to be so",
                    lowest, allowed));
  if (highest > facts.supply_max)
    return fail(
        fmt::format("{:.2f} V is too high; {}; set the supply, or raise supply.voltage_max if board and "
                    "motor bear it",
                    highest, allowed));
  if (evidence.pulse_fault == firmware::Fault::under_voltage ||
      evidence.pulse_fault == firmware::Fault::over_voltage)
    return fail(
        fmt::format("{:.2f} V at rest, but {:.2f} V under a small load; {}; the supply or its cable is "
                    "too weak",
                    rest.mean, evidence.pulse_fault_value, allowed));
  result.message =
      fmt::format("{:.2f} V ({:.2f} .. {:.2f} V at rest); {}", rest.mean, lowest, highest, allowed);
  if (!evidence.under_load || evidence.under_load->supply.empty()) {
    result.message += "; not loaded, since no pulse could be given";
    return result;
  }
  const Sag sag = sag_of(*evidence.under_load, facts.synchronous);
  result.values.push_back({"lowest_under_load", sag.lowest, "V"});
  if (sag.lowest < 0.9 * rest.mean)
    return fail(
        fmt::format("{:.2f} V at rest falls to {:.2f} V under a small pulse; allowed is a tenth; check "
                    "the supply's current limit and the cable",
                    rest.mean, sag.lowest));
  if (sag.deviation > 0.0) {
    result.values.push_back({"source_resistance", sag.resistance, "ohm"});
    result.values.push_back({"source_resistance_deviation", sag.deviation, "ohm"});
    result.message +=
        sag.resistance > 3.0 * sag.deviation
            ? fmt::format("; under a pulse not below {:.2f} V, source resistance about {:.2f} ohm",
                          sag.lowest, sag.resistance)
            : fmt::format("; under a pulse not below {:.2f} V, source resistance below {:.2g} ohm",
                          sag.lowest, std::abs(sag.resistance) + 3.0 * sag.deviation);
  }
  return result;
}

}  // namespace kmax::selftest
