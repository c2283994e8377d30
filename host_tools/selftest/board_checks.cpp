// The link, the supply, the emergency stop, the gate driver and the temperature: what the board can say.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>

#include "host_tools/selftest/checks.hpp"

namespace kmax::selftest {

using firmware::Fault;
using firmware::Refusal;

CheckResult check_link(const Evidence& evidence) {
  const LinkTrial& link = evidence.link;
  CheckResult result{"link"};
  result.values = {{"exchanges", static_cast<double>(link.exchanges), ""},
                   {"lost", static_cast<double>(link.lost), "", 0.0, 0.0},
                   {"mean_round_trip", link.mean_round_trip, "s"},
                   {"longest_round_trip", link.longest_round_trip, "s"}};
  std::string risen;
  for (const LinkTrial::Counter& counter : link.risen) {
    result.values.push_back({counter.name, counter.rise, "", 0.0, 0.0});
    risen += fmt::format("; {} rose by {}", counter.name, counter.rise);
  }
  const std::string measured = fmt::format(
      "{} exchanges, {} lost, round trip {:.1f} ms on average and {:.1f} ms at most{}", link.exchanges,
      link.lost, link.mean_round_trip * 1e3, link.longest_round_trip * 1e3, risen);
  if (link.lost == 0 && link.risen.empty()) return result.pass(measured + "; no error counter rose");
  if (link.lost == 0 && link.risen.size() == 1 && link.risen.front().name == "counters.missed_ticks")
    return result.fail("controller (ticks lost)",
                       measured + "; none is allowed: report it as a defect of the firmware");
  return result.fail(
      "link",
      measured + "; none is allowed: check the cable, its shield and ground, " +
          (link.over_can
               ? "the bit rate, the termination (120 ohm at both ends), and what else talks on the bus"
               : "the baud rate, and what else talks on the line"));
}

namespace {
/// How the supply follows what the swing takes: with the bus capacitor C,  (E - V)/R - C dV/dt = i,  whose
/// integral is fitted for 1/R and C. A short swing charges the capacitor only, and a long one shows R.
struct Sag {
  double lowest = 0.0;                    ///< V
  bool seen = false;                      ///< beyond the steps of the converter
  double least_seen = 0.0;                ///< ohm, that would just have been
  std::optional<double> resistance = {};  ///< ohm, of one that was seen; none: it follows no resistance
};

Sag sag_of(const PulseResponse& swing, const AxisFacts& facts) {
  constexpr double step = 0.01;                        // V, of the converter behind its divider
  const double share = facts.synchronous ? 1.5 : 1.0;  // power of three phases by the amplitudes of one
  const auto current = swing.current_along(facts.synchronous);
  const double rest = mean_and_deviation(swing.supply, 0, swing.before).mean;
  Sag sag{.lowest = rest};
  double taken = 0.0, lost = 0.0, ll = 0.0, lf = 0.0, ff = 0.0, lt = 0.0, ft = 0.0;
  for (std::size_t k = swing.before; k < swing.end(); ++k) {
    sag.lowest = std::min(sag.lowest, swing.supply[k]);
    const double fallen = rest - swing.supply[k];
    taken += facts.tick * share * swing.voltage[k] * current[k] / std::max(swing.supply[k], 1.0);
    lost += facts.tick * fallen;
    ll += lost * lost, lf += lost * fallen, ff += fallen * fallen, lt += lost * taken, ft += fallen * taken;
  }
  const double duration = facts.tick * static_cast<double>(swing.end() - swing.before);
  sag.seen = lost > step * duration;
  const double determinant = ll * ff - lf * lf;
  const double conductance = (lt * ff - ft * lf) / determinant;
  sag.least_seen = step * duration / std::max(taken, 1e-9);
  if (sag.seen && conductance > 0.0) sag.resistance = 1.0 / conductance;
  return sag;
}

/// V to which the supply falls while the motor stands at current.limit; 0: it cannot give that at all.
double supply_at_limit(double rest, double source, double winding, const AxisFacts& facts) {
  const double power = (facts.synchronous ? 1.5 : 1.0) * winding * facts.current_limit * facts.current_limit;
  const double square = 0.25 * rest * rest - power * source;
  return square > 0.0 ? 0.5 * rest + std::sqrt(square) : 0.0;
}
}  // namespace

CheckResult check_supply(const Evidence& evidence) {
  CheckResult result{"supply"};
  const AxisFacts& facts = evidence.facts;
  if (!evidence.measures_currents()) return result.not_judged("this board does not measure its supply");
  const MeanAndDeviation rest = mean_and_deviation(evidence.supply, 0, evidence.supply.size());
  const auto [low, high] = std::minmax_element(evidence.supply.begin(), evidence.supply.end());
  const double lowest = low == evidence.supply.end() ? 0.0 : *low;
  const double highest = high == evidence.supply.end() ? 0.0 : *high;
  result.values = {{"voltage", rest.mean, "V", facts.supply_min, facts.supply_max},
                   {"lowest", lowest, "V", facts.supply_min, facts.supply_max},
                   {"highest", highest, "V", facts.supply_min, facts.supply_max}};
  const std::string allowed =
      fmt::format("allowed is {:.1f} .. {:.1f} V (supply.voltage_min, supply.voltage_max)", facts.supply_min,
                  facts.supply_max);
  if (rest.mean < 1.0)
    return result.fail(
        "supply",
        fmt::format("{:.2f} V: the power stage has no supply; switch it on, check its cable, fuse and "
                    "polarity; {}",
                    rest.mean, allowed));
  if (lowest < facts.supply_min)
    return result.fail(
        "supply",
        fmt::format("{:.2f} V is too low; {}; set or charge the supply, or lower supply.voltage_min if "
                    "it is meant to be so",
                    lowest, allowed));
  if (highest > facts.supply_max)
    return result.fail(
        "supply",
        fmt::format("{:.2f} V is too high; {}; set the supply, or raise supply.voltage_max if board and "
                    "motor bear it",
                    highest, allowed));
  if (evidence.pulse_fault == Fault::under_voltage || evidence.pulse_fault == Fault::over_voltage)
    return result.fail(
        "supply",
        fmt::format("{:.2f} V at rest, but {:.2f} V under part of the load; {}; the supply or its cable is "
                    "too weak",
                    rest.mean, evidence.pulse_fault_value, allowed));
  const std::string at_rest =
      fmt::format("{:.2f} V ({:.2f} .. {:.2f} V at rest); {}", rest.mean, lowest, highest, allowed);
  if (!evidence.under_load || evidence.under_load->supply.empty())
    return result.pass(at_rest + "; not loaded, since no pulse could be given");
  const Sag sag = sag_of(*evidence.under_load, facts);
  result.values.push_back({"lowest_under_load", sag.lowest, "V", 0.9 * rest.mean});
  std::string under_load = fmt::format("{:.2f} V at rest falls to {:.2f} V in a swing at part of the current",
                                       rest.mean, sag.lowest);
  if (sag.resistance || !sag.seen) {
    const double resistance = sag.resistance.value_or(sag.least_seen);
    result.values.push_back({"source_resistance", resistance, "ohm"});
    under_load += fmt::format("; source resistance {} {:.2g} ohm", sag.seen ? "about" : "below", resistance);
  }
  const std::string advice =
      "check the supply's current limit, the cable and its plugs, or lower current.limit";
  if (sag.lowest < 0.9 * rest.mean)
    return result.fail("supply", fmt::format("{}; allowed is a tenth; {}", under_load, advice));
  if (!sag.seen) return result.pass(under_load);
  if (!sag.resistance)
    return result.not_judged(under_load +
                             ", and not as it does behind a resistance: what it has left at current.limit is "
                             "not known; look whether it is switched on and gives current at all");
  if (!evidence.phases || !(evidence.phases->admittance > 0.0)) return result.pass(under_load);
  const double winding = evidence.phases->judged_resistance / evidence.phases->admittance;
  const double at_limit = supply_at_limit(rest.mean, *sag.resistance, winding, facts);
  result.values.push_back({"at_current_limit", at_limit, "V", facts.supply_min});
  const std::string computed =
      fmt::format("{}; with the motor held at current.limit it would fall to {:.1f} V; {}", under_load,
                  at_limit, allowed);
  if (at_limit < facts.supply_min) return result.fail("supply", computed + "; " + advice);
  return result.pass(computed);
}

CheckResult check_emergency_stop(const Evidence& evidence) {
  CheckResult result{"emergency stop"};
  const ArmingTrial& arming = evidence.arming;
  if (arming.refusal == Refusal::emergency_stop || arming.fault == Fault::emergency_stop ||
      evidence.pulse_fault == Fault::emergency_stop)
    return result.fail(
        "emergency stop",
        "the line is open: release the button; if it is released, check its contact, plug and cable. What "
        "needs force cannot be tested meanwhile");
  if (arming.armed) return result.pass("the line is closed (whether it opens shows 'kmax selftest --hand')");
  return result.not_judged(fmt::format("the device names another obstacle first: {}", arming.words()));
}

CheckResult check_gate_driver(const Evidence& evidence) {
  CheckResult result{"gate driver"};
  const ArmingTrial& arming = evidence.arming;
  if (!evidence.measures_currents()) return result.not_judged(reason_without_pulses(evidence));
  const auto is = [&](Refusal refusal, Fault fault) {
    return arming.refusal == refusal || arming.fault == fault || evidence.pulse_fault == fault;
  };
  const bool reports = is(Refusal::gate_driver_fault, Fault::gate_driver);
  const bool silent = is(Refusal::power_stage_not_ready, Fault::power_stage);
  if (reports || silent) {
    if (check_supply(evidence).verdict == Verdict::fail)
      return result.not_judged("it needs the supply to answer");
    return result.fail(
        "gate driver",
        reports
            ? "it pulls its fault line: look for a short between phases, to ground or to the supply with the "
              "motor unplugged; if the fault stays, the driver or a transistor is broken"
            : "the power stage does not become ready although the supply is there: a gate driver does not "
              "answer or does not keep its settings. Let the motor stand, which keeps it from starting while "
              "it is turned fast; switch the board off and on, then replace it");
  }
  if (!arming.armed) return result.not_judged(fmt::format("the axis cannot be armed: {}", arming.words()));
  return result.pass("ready, no fault, before and during the pulses");
}

CheckResult check_temperature(const Evidence& evidence) {
  constexpr double coldest = 0.0, hottest_plausible = 150.0;
  CheckResult result{"temperature"};
  const double temperature = evidence.temperature;
  const double limit = evidence.facts.temperature_limit;
  result.values = {{"power_stage", temperature, "degC", coldest, limit}, {"limit", limit, "degC"}};
  if (!evidence.measures_currents()) return result.not_judged(reason_without_pulses(evidence));
  if (!(temperature >= coldest && temperature <= hottest_plausible))
    return result.fail(
        "temperature sensor",
        fmt::format("the power stage reads {:.1f} degC; plausible is {:.0f} .. {:.0f} degC: the sensor or "
                    "its line is broken or shorted",
                    temperature, coldest, hottest_plausible));
  if (temperature > limit)
    return result.fail(
        "power stage (too hot)",
        fmt::format("the power stage has {:.1f} degC; allowed is {:.0f} degC (temperature.limit): let it "
                    "cool down, check its cooling",
                    temperature, limit));
  return result.pass(fmt::format("the power stage has {:.1f} degC; allowed is {:.0f} .. {:.0f} degC",
                                 temperature, coldest, limit));
}

}  // namespace kmax::selftest
