#include "host_tools/selftest/selftest.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "host_tools/selftest/probe.hpp"

namespace kmax::selftest {

namespace {
// m, of a free handle; see plan_swing().
constexpr double swing_budget_dc = 0.25e-3, swing_budget_synchronous = 0.15e-3;
constexpr int most_sets = 4;                // of swings, until the encoder's scale is known well enough
constexpr double weak_budget = 0.03e-3;     // m, likewise, of what is given before the circuit is known
constexpr double test_current_share = 0.4;  // of current.limit
constexpr double strong_current_share = 0.8;

class PulseSequence {
 public:
  PulseSequence(Probe& probe, Evidence& evidence)
      : probe_(probe), evidence_(evidence), plan_(evidence.facts) {
    const MeanAndDeviation supply = mean_and_deviation(evidence.supply, 0, evidence.supply.size());
    supply_ = supply.mean;
  }

  void run() {
    const double limit = evidence_.facts.current_limit;
    const bool climbed = climb(test_current_share * limit);
    look_at_circuit();
    if (!climbed || !worth_going_on()) return;
    for (const double share : {test_current_share, strong_current_share}) {
      swing(share * limit);
      if (!worth_going_on()) return;
      if (moved()) break;
    }
    evidence_.under_load = probe_.give(evidence_.swings.front().pulse, Probe::Observe::supply);
    note_trip(*evidence_.under_load);
  }

 private:
  /// The ladder. False: it has ended in a trip, or no current came up to the highest voltage.
  bool climb(double wanted) {
    const AxisFacts& facts = evidence_.facts;
    double voltage = facts.calibrated ? 0.1 * wanted * facts.resistance : 0.05;
    const double highest = 0.4 * supply_;
    double sign = 1.0;
    for (;;) {
      voltage = std::min(voltage, highest);
      Pulse pulse = plan_pulse(plan_, wanted, weak_budget, supply_);
      pulse.voltage = sign * voltage;
      // Here the voltage between any two phases is at least half of the largest: one may be open.
      pulse.angle = std::numbers::pi / 6.0;
      const double start = probe_.displacement();
      const PulseResponse response = probe_.give(pulse);
      note_trip(response);
      const WindingEstimate seen = estimate_winding(response, facts.tick);
      last_voltage_ = voltage;
      const bool visible = seen.amplitude > 5.0 * seen.noise / std::sqrt(0.25 * pulse.duration);
      if (visible) {
        slope_ = amplitude_ > 0.0 && seen.amplitude > amplitude_
                     ? (voltage - ladder_voltage_) / (seen.amplitude - amplitude_)
                     : voltage / seen.amplitude;
        ladder_voltage_ = voltage;
        amplitude_ = seen.amplitude;
        plan_.resistance = voltage / seen.amplitude;
        time_constant_ = seen.time_constant;
        plan_.inductance = plan_.resistance * std::max(seen.time_constant, 0.1 * facts.tick);
      }
      if (response.tripped()) return false;
      learn_mobility(response, pulse, seen.amplitude);
      if (seen.amplitude >= 0.5 * wanted) return true;
      // Something moves although no current is seen: no more voltage into that.
      if (!visible && std::abs(probe_.displacement() - start) > 10.0 * facts.count_length) return false;
      if (voltage >= highest) return visible;
      voltage = visible ? std::clamp(voltage_for(wanted), 1.2 * voltage, 2.0 * voltage) : 2.0 * voltage;
      sign = -sign;
    }
  }

  double voltage_for(double current) const {
    if (!(amplitude_ > 0.0)) return last_voltage_;
    const double voltage = ladder_voltage_ + slope_ * (current - amplitude_);
    const double proportional = ladder_voltage_ * current / amplitude_;
    return std::clamp(voltage, std::min(ladder_voltage_, proportional),
                      std::min(0.4 * supply_, std::max(ladder_voltage_, proportional)));
  }

  /// A weak pulse along each phase.
  void look_at_circuit() {
    const AxisFacts& facts = evidence_.facts;
    Pulse pulse = plan_pulse(plan_, test_current_share * facts.current_limit, weak_budget, supply_);
    pulse.voltage = last_voltage_;
    std::vector<PulseResponse> pulses;
    for (int phase = 0; phase < (facts.synchronous ? 3 : 1); ++phase) {
      pulse.angle = phase * 2.0 * std::numbers::pi / 3.0;
      pulses.push_back(probe_.give(pulse));
      note_trip(pulses.back());
    }
    evidence_.largest_pulse_voltage = last_voltage_;
    evidence_.phases = judge_phases(pulses, judged_winding());
  }

  void swing(double current) {
    const AxisFacts& facts = evidence_.facts;
    Pulse pulse =
        plan_swing(plan_, current, facts.synchronous ? swing_budget_synchronous : swing_budget_dc, supply_);
    // Of the current that fits, at the voltage that the ladder has found for it.
    pulse.voltage = voltage_for(std::min(current, pulse.voltage / plan_.resistance));
    evidence_.swings.clear();
    for (int set = 0; set < most_sets; ++set) {
      for (int direction = 0; direction < (facts.synchronous ? 2 : 1); ++direction) {
        pulse.angle = direction * 0.5 * std::numbers::pi;
        const PulseResponse response = probe_.give(pulse);
        note_trip(response);
        if (response.tripped()) return;
        evidence_.swings.push_back(response);
      }
      evidence_.motion = motion_evidence(evidence_.swings, facts);
      pulse.voltage = -pulse.voltage;
      if (!another_set_would_decide()) return;
    }
  }

  bool another_set_would_decide() const {
    if (!evidence_.motion) return false;
    const MotionEvidence& motion = *evidence_.motion;
    if (motion.encoder_moved())
      return evidence_.facts.calibrated && motion.back_emf_moved() && encoder_scale(motion).doubtful();
    return evidence_.facts.calibrated && !motion.back_emf_moved() && !motion.back_emf_would_show();
  }

  /// The claimed resistance decides what a short is; the shape of the current is the measured one.
  AxisFacts judged_winding() const {
    AxisFacts winding = evidence_.facts;
    if (!winding.calibrated && amplitude_ > 0.0) winding.resistance = plan_.resistance;
    if (time_constant_ > 0.0) winding.inductance = winding.resistance * time_constant_;
    return winding;
  }

  /// A trip ends it, unless motion was seen before.
  bool worth_going_on() const {
    return evidence_.pulse_fault == firmware::Fault::none && evidence_.phases &&
           evidence_.phases->circuit == Circuit::healthy;
  }

  bool moved() const {
    return evidence_.motion && (evidence_.motion->encoder_moved() || evidence_.motion->back_emf_moved());
  }

  /// A handle that is lighter, or a motor that is stronger than claimed, gets smaller pulses.
  void learn_mobility(const PulseResponse& response, const Pulse& pulse, double current) {
    double excursion = 0.0;
    for (std::size_t k = response.before; k < response.position.size(); ++k)
      excursion = std::max(excursion, std::abs(response.position[k] - response.position[response.before]));
    const double claimed = bound_on_displacement(plan_, pulse, current);
    // A few counts may be noise.
    if (excursion < 4.0 * plan_.count_length || !(claimed > 0.0) || excursion <= claimed) return;
    plan_.torque_constant *= excursion / claimed;
  }

  void note_trip(const PulseResponse& response) {
    if (!response.tripped() || evidence_.pulse_fault != firmware::Fault::none) return;
    evidence_.pulse_fault = response.fault;
    evidence_.pulse_fault_value = response.fault_value;
  }

  Probe& probe_;
  Evidence& evidence_;
  AxisFacts plan_;  ///< what pulses are planned with: corrected by what has been seen
  double supply_ = 0.0;
  double last_voltage_ = 0.0;
  double ladder_voltage_ = 0.0, amplitude_ = 0.0, slope_ = 0.0, time_constant_ = 0.0;
};
}  // namespace

Evidence gather_evidence(Probe& probe, const SelfTestSettings& settings) {
  bench::Bench& bench = probe.bench();
  Evidence evidence;
  evidence.facts = read_facts(probe.device(), settings.axis);
  evidence.link = probe.try_link(settings.link_exchanges);
  evidence.fault_at_start = probe.clear_fault_at_start();
  bench.progress("supply and temperature");
  evidence.supply = probe.read_supply(20);
  evidence.temperature = bench.number("measured.temperature");
  evidence.rest = probe.watch_at_rest(400);
  evidence.arming = probe.try_arming();
  const bool left_alone = evidence.arming.fault == firmware::Fault::none;
  if (evidence.arming.armed && left_alone && evidence.measures_currents()) {
    try {
      PulseSequence(probe, evidence).run();
    } catch (const HandleMoved&) {
      evidence.pulse_withheld = true;
    }
  }
  probe.displacement();
  evidence.largest_displacement = probe.largest_displacement();
  return evidence;
}

namespace {
Report test(Probe& probe, const SelfTestSettings& settings, const Probe::Progress& progress) {
  const Evidence evidence = gather_evidence(probe, settings);
  Report report{run_checks(evidence), evidence.largest_displacement, evidence.fault_at_start};
  if (settings.hand) {
    const Probe::Progress& say = settings.say ? settings.say : progress;
    report.checks.push_back(check_hand_motion(probe, *settings.hand, say));
    report.checks.push_back(check_hand_stop(probe, *settings.hand, say));
  }
  return report;
}
}  // namespace

Report run_selftest(device::Device& device, const SelfTestSettings& settings,
                    const Probe::Progress& progress) {
  Probe probe(device, settings.axis, progress);
  Report report;
  try {
    report = test(probe, settings, progress);
  } catch (const std::exception& error) {
    throw SelfTestEnded(fmt::format("{}; {}", error.what(), probe.restore().words));
  }
  const Restored restored = probe.restore();
  if (!restored.in_order) throw SelfTestEnded(fmt::format("the test is done, but {}", restored.words));
  return report;
}

}  // namespace kmax::selftest
