// The stages in which the board is looked at before anything moves: logic, gate_drivers, load, motor.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "board/odrive_v3/voltage_variant.hpp"
#include "drivers/analog_converter.hpp"
#include "firmware/drive/profile_readings.hpp"
#include "host_tools/bench/power_stage.hpp"
#include "host_tools/bring_up/bring_up.hpp"
#include "host_tools/device/value_text.hpp"
#include "host_tools/selftest/selftest.hpp"

namespace kmax::bring_up {

using bench::Circuit;
using selftest::CheckResult;
using selftest::Evidence;
using selftest::Probe;
using selftest::Verdict;

namespace {
/// Whether the emergency stop's line is open; nothing is armed for it.
bool stop_is_open(device::Device& device, std::size_t axis) {
  return (device.read(device::Parameter::of<"profile.digital_inputs">(axis)) &
          firmware::emergency_stop_input) != 0;
}

template <typename Seen>
bool wait_for(device::Device& device, const Settings& settings, const Party& party, const char* text,
              Seen seen) {
  return bench::wait_for_hand(device.link(), settings.patience, party.progress, text, seen);
}

/// What the probe has changed, as it was.
void put_back(Probe& probe) {
  const selftest::Restored restored = probe.restore();
  if (!restored.in_order) throw base::DeviceError(restored.words);
}

/// The handle counts nothing for 0.3 s.
bool stands(device::Device& device, const Settings& settings, const Party& party) {
  constexpr int looks = 15;
  int still = 0;
  std::uint32_t before = 0;
  return wait_for(device, settings, party, "waiting for the handle to rest", [&] {
    const std::uint32_t count = device.read(device::Parameter::of<"measured.count">(settings.axis));
    still = count == before ? still + 1 : 0;
    before = count;
    return still > looks;
  });
}

/// A line that is loose is pulled up: the index is never passed, and the count is not believed any more.
CheckResult check_index(device::Device& device, const Settings& settings, const Party& party) {
  CheckResult check{"encoder index"};
  party.person.ask(
      "Get ready to move the handle to and fro past the encoder's index: over a whole turn of the shaft, if "
      "it goes that far");
  if (wait_for(device, settings, party, "waiting for the index", [&] {
        return (device.read(device::Parameter::of<"profile.digital_inputs">(settings.axis)) &
                firmware::index_passed_input) != 0;
      }))
    return check.pass("it has been passed");
  return check.fail(
      "encoder index",
      fmt::format("not seen within {:.0f} s although A and B count: check the wire of Z at J4, and its "
                  "supply; see that the travel reaches it; for an encoder without this line set "
                  "encoder.index=none",
                  settings.patience));
}

CheckResult check_stop(device::Device& device, const Settings& settings, const Party& party) {
  CheckResult check{"emergency stop"};
  const auto open = [&] { return stop_is_open(device, settings.axis); };
  if (open())
    return check.fail(
        "emergency stop",
        "its line is open: release the button, or connect GPIO5 with GND of J3 by a wire; if that is done, "
        "check plug and cable");
  if (!settings.has_button) return check.pass("its line is closed, by a wire; nothing can stop the device");
  party.person.ask("Put a hand on the emergency stop, without pressing it yet");
  if (!wait_for(device, settings, party, "press the emergency stop", open))
    return check.fail(
        "emergency stop",
        fmt::format(
            "nothing was seen of it within {:.0f} s: it must be a normally closed contact in series with the "
            "wire from GPIO5 to GND; without a button give --no-button",
            settings.patience));
  if (!wait_for(device, settings, party, "release the emergency stop", [&] { return !open(); }))
    return check.fail("emergency stop", "its line did not close again: release it, check its contact");
  return check.pass("its line opens and closes");
}

CheckResult check_clock(device::Device& device) {
  CheckResult check{"controller"};
  const auto source = device::Parameter::of<"info.clock_source">();
  const auto cause = device::Parameter::of<"info.reset_cause">();
  const std::string clock = device::value_text(source, device.read(source));
  const std::string reset = device::value_text(cause, device.read(cause));
  const double crashes = device.read_number("info.crash_count");
  check.values = {{"crashes", crashes, "", 0.0, 0.0}};
  const std::string seen =
      fmt::format("clock: {}; started because of: {}; {} crashes since then", clock, reset, crashes);
  if (clock != "crystal_pll" && clock != "native")
    return check.fail(
        "crystal of the board",
        seen + "; allowed is crystal_pll: the crystal does not run, and there is no power stage");
  if (crashes > 0)
    return check.fail("controller",
                      seen + "; allowed are none: 'kmax info' and 'kmax faults' say what happened");
  return check.pass(seen);
}

/// The supply as the board measures it against the supply's own meter: two boards differ in their divider. A
/// reading at the end of the converter's range, which follows from the variant's ceiling, is no measurement.
CheckResult check_divider(double measured, std::optional<double> meter, double ceiling) {
  using namespace board::odrive_v3;
  CheckResult check{"supply divider"};
  for (const VoltageVariant variant : {VoltageVariant::v24, VoltageVariant::v56}) {
    const double end = drivers::converter_reference * static_cast<double>(supply_divider_ratio(variant));
    const PartRatings parts = part_ratings(variant);
    if (std::abs(ceiling - static_cast<double>(supply_ceiling(variant))) > 0.01 || measured < 0.995 * end)
      continue;
    check.values = {{"measured", measured, "V", 0.0, ceiling}};
    return check.fail(
        "supply (beyond the range)",
        fmt::format(
            "the board measures {:.1f} V, the end of its range ({:.1f} V): the supply has that or more. "
            "Switch it off at once: the capacitors of a {:.0f} V board are rated for {:.0f} V, and may be "
            "broken already; look for swollen ones. Allowed are {:.0f} V at most. If the supply's own meter "
            "never showed more than that, the divider on the board is open",
            measured, end, parts.supply, parts.capacitors, parts.supply));
  }
  if (!meter) return check.not_judged("give what the supply's own meter shows with --supply VOLT");
  const double shown = *meter, ratio = measured / shown;
  check.values = {{"measured_to_shown", ratio, "", 0.9, 1.1}};
  const std::string seen =
      fmt::format("the board measures {:.2f} V, the supply shows {:.2f} V", measured, shown);
  const double of_56_to_24 =
      supply_divider_ratio(VoltageVariant::v56) / supply_divider_ratio(VoltageVariant::v24);
  const auto near = [ratio](double other) { return std::abs(ratio / other - 1.0) < 0.1; };
  if (near(1.0)) return check.pass(seen);
  if (near(of_56_to_24))
    return check.fail("voltage variant", seen +
                                             ": this is a board for 24 V that the firmware takes for one of "
                                             "56 V, since its memory does not say; build the image with "
                                             "-DKMAX_ODRIVE_VOLTAGE=24");
  if (near(1.0 / of_56_to_24))
    return check.fail("voltage variant", seen +
                                             ": this is a board for 56 V that the firmware takes for one of "
                                             "24 V; build the image with -DKMAX_ODRIVE_VOLTAGE=56");
  return check.fail(
      "supply measurement",
      seen + "; within 10 % is allowed: check the meter, the cable, and the divider on the board");
}

/// The self-test's evidence, with everything put back.
Evidence gather(device::Device& device, const Settings& settings, const Party& party) {
  Probe probe(device, settings.axis, party.progress);
  selftest::SelfTestSettings test;
  test.axis = settings.axis;
  Evidence evidence = gather_evidence(probe, test);
  put_back(probe);
  return evidence;
}

}  // namespace

namespace {
/// `cold`: of a cold board, whose drift is not asked for.
CheckResult offsets(device::Device& device, std::size_t axis, const Report* cold) {
  // The DRV8301's 4 mV, and its drift on the worst board, 15 uV/degC, doubled since the thermistor is not
  // beside it: both guesses, its data sheet was not at hand (drivers/current_sense.hpp).
  constexpr double least_warming = 5.0;
  const double shunt = bench::power_stage_of(device).shunt, largest = 4e-3 / shunt,
               steepest = 2.0 * 15e-6 / shunt;
  CheckResult check{"amplifier offsets"};
  const auto number = [&](const char* name) {
    return device.read_number(fmt::format("axis{}.measured.{}", axis, name));
  };
  const double temperature = number("temperature");
  const auto before = [&](const char* name) {
    return cold == nullptr ? std::nullopt : cold->number(axis, Stage::gate_drivers, check.name, name);
  };
  const double warming = temperature - before("temperature").value_or(temperature);
  bool known = true;
  check.values = {{"temperature", temperature, "degC"}};
  std::string seen = fmt::format("at {:.1f} degC", temperature), wrong;
  for (const char* name : {"offset_b", "offset_c"}) {
    const double offset = number(name);
    check.values.push_back({name, offset, "A", -largest, largest});
    seen += fmt::format(", {} {:+.2f} A", name, offset);
    if (std::abs(offset) > largest) wrong = fmt::format("allowed are {:.0f} A", largest);
    const auto was = before(name);
    known = known && was;
    if (!was || !(std::abs(warming) >= least_warming)) continue;
    const double drift = (offset - *was) / warming;
    check.values.push_back({fmt::format("{}_drift", name), drift, "A/degC", -steepest, steepest});
    seen += fmt::format(" ({:+.3f} A/degC)", drift);
    if (std::abs(drift) > steepest) wrong = fmt::format("allowed are {:.2f} A/degC", steepest);
  }
  if (!wrong.empty())
    return check.fail(
        "current sensors (offset)",
        fmt::format("{}; {}: the amplifier or its reference is bad: the board is broken", seen, wrong));
  if (cold == nullptr || (known && std::abs(warming) >= least_warming)) return check.pass(seen);
  if (!known || !before("temperature"))
    return check.not_judged(seen +
                            "; how they drift is not known: the report has none of the cold board; 'kmax "
                            "bring-up --stage gate_drivers' once it is cold, and then the stages after it");
  return check.not_judged(fmt::format(
      "{}; the drift takes {:.0f} degC more than in stage gate_drivers, and it is {:+.1f}: 'kmax bring-up "
      "--stage stiffer' once more when the board is warm",
      seen, least_warming, warming));
}
}  // namespace

CheckResult check_cold_offsets(device::Device& device, std::size_t axis) {
  return offsets(device, axis, nullptr);
}
CheckResult check_offsets(device::Device& device, std::size_t axis, const Report& cold) {
  return offsets(device, axis, &cold);
}

Evidence test_free_handle(device::Device& device, const Settings& settings, const Party& party) {
  Evidence evidence = gather(device, settings, party);
  constexpr int most_tries = 3;
  for (int tries = 1; tries < most_tries && evidence.handle_was_moved() && stands(device, settings, party);
       ++tries)
    evidence = gather(device, settings, party);
  return evidence;
}

namespace {
CheckResult check_no_motor(const Evidence& evidence) {
  CheckResult check{"nothing connected"};
  if (!evidence.phases) return check.not_judged(reason_without_pulses(evidence));
  check.values = {{"largest_voltage", evidence.largest_pulse_voltage, "V"}};
  if (evidence.phases->circuit == Circuit::nothing_flows)
    return check.pass(
        fmt::format("no current at up to {:.1f} V between the terminals", evidence.largest_pulse_voltage));
  return check.fail("motor terminals",
                    fmt::format("current flows at {:.2f} V although nothing should be connected: unplug the "
                                "motor; if it is, look for a short between the terminals",
                                evidence.largest_pulse_voltage));
}

/// How much more sensor B reads than C. A brushed motor's current flows through both. Of a synchronous motor:
/// what B shows of a voltage along C, and C of one along B, are the same for every winding, whatever its
/// saliency, since its admittance is symmetric.
CheckResult check_gains(const Evidence& evidence) {
  constexpr double allowed = 0.06;  // beyond it currents seem not to add up (phase_watch.hpp)
  CheckResult check{"gain mismatch"};
  if (!evidence.phases || evidence.phases->circuit != Circuit::healthy)
    return check.not_judged("the circuit must be right first");
  const auto& answers = evidence.phases->answers;
  const bool brushed = answers.size() == 1;
  const double b = brushed ? answers[0].b : -answers[2].b;
  const double c = brushed ? -answers[0].c : -answers[1].c;
  const double mismatch = 2.0 * (b - c) / (b + c);
  check.values = {{"mismatch", mismatch, "", -allowed, allowed}};
  const std::string seen = fmt::format("sensor B reads {:+.1f} % of sensor C's; allowed are {:.0f} %",
                                       mismatch * 100.0, allowed * 100.0);
  if (std::abs(mismatch) > allowed)
    return check.fail("current sensors (gain)", seen +
                                                    ": a shunt or an amplifier's resistor is wrong, or the "
                                                    "winding is not equal in its phases: try another motor");
  return check.pass(seen);
}

CheckResult check_brake(const Settings& settings, double brake_voltage, double supply) {
  CheckResult check{"brake resistor"};
  if (!settings.brake)
    return check.not_judged("measure between the terminals of AUX, supply off, and give --brake OHM");
  const double ohm = *settings.brake;
  check.values = {{"on_voltage", brake_voltage, "V"}};
  if (ohm > 0.0) check.values.push_back({"resistance", ohm, "ohm", 0.47, 100.0});
  if (ohm <= 0.0 && brake_voltage > 0.0)
    return check.fail("brake resistor",
                      fmt::format("supply.brake_voltage is {:.1f} V and no resistor is there: connect "
                                  "one, or set supply.brake_voltage=0",
                                  brake_voltage));
  if (ohm <= 0.0)
    return check.pass(
        "none, and none is expected: a handle that is driven back raises the supply until supply.voltage_max "
        "takes the force away");
  if (brake_voltage <= 0.0)
    return check.fail(
        "supply.brake_voltage",
        fmt::format("{:.2f} ohm are connected and supply.brake_voltage is 0, so that it is never "
                    "used: set it a volt or two above {:.1f} V",
                    ohm, supply));
  if (brake_voltage < supply + 0.5)
    return check.fail("supply.brake_voltage",
                      fmt::format("{:.1f} V is not above the supply ({:.1f} V): the resistor "
                                  "would heat up all the time",
                                  brake_voltage, supply));
  if (ohm < 0.47 || ohm > 100.0)
    return check.fail("brake resistor", fmt::format("{:.2f} ohm; 0.47 to 100 ohm are allowed", ohm));
  return check.pass(fmt::format("{:.2f} ohm: {:.0f} W for the moments in which it is on, from {:.1f} V", ohm,
                                brake_voltage * brake_voltage / ohm, brake_voltage));
}
}  // namespace

StageResult try_logic(device::Device& device, const Settings& settings, const Party& party) {
  StageResult result;
  Evidence evidence;
  evidence.facts = selftest::read_facts(device, settings.axis);
  {
    Probe probe(device, settings.axis, party.progress);
    evidence.link = probe.try_link(100);
    party.progress("supply and temperature");
    evidence.supply = probe.read_supply(20);
    evidence.temperature = probe.bench().number("measured.temperature");
    put_back(probe);
  }
  result.checks = {check_link(evidence), check_clock(device)};
  const auto supply = selftest::mean_and_deviation(evidence.supply, 0, evidence.supply.size());
  // With a wrong divider every voltage is wrong: what is allowed is not looked at then.
  if (supply.mean > 1.0)
    result.checks.push_back(
        check_divider(supply.mean, settings.supply, device.read_number("supply.ceiling")));
  if (result.passed()) result.checks.push_back(check_supply(evidence));
  result.checks.push_back(check_temperature(evidence));
  if (result.passed()) result.checks.push_back(check_stop(device, settings, party));
  return result;
}

StageResult try_gate_drivers(device::Device& device, const Settings& settings, const Party& party) {
  StageResult result;
  const Evidence evidence = gather(device, settings, party);
  result.checks = {check_emergency_stop(evidence), check_gate_driver(evidence), check_current_sense(evidence),
                   check_cold_offsets(device, settings.axis), check_no_motor(evidence)};
  if (!result.passed() || !settings.has_button) return result;
  party.person.ask(
      "Next the axis is armed with 0 V: press the emergency stop then, and not before. Put a hand on it");
  Probe probe(device, settings.axis, party.progress);
  result.checks.push_back(check_hand_stop(probe, {.patience = settings.patience}, party.progress));
  put_back(probe);
  return result;
}

StageResult try_load(device::Device& device, const Settings& settings, const Party& party) {
  StageResult result;
  const Evidence evidence = gather(device, settings, party);
  result.checks = {check_supply(evidence), check_gate_driver(evidence), check_current_sense(evidence),
                   check_phases(evidence), check_gains(evidence)};
  if (evidence.handle_was_moved())
    result.checks.push_back(CheckResult{"shaft"}.fail("shaft", "it moved: hold it fast, and begin again"));
  return result;
}

StageResult try_motor(device::Device& device, const Settings& settings, const Party& party) {
  StageResult result;
  const auto index = device::Parameter::of<"encoder.index">(settings.axis);
  const bool has_index =
      device.read(index) != 0 && device.read(device::Parameter::of<"encoder.kind">(settings.axis)) ==
                                     static_cast<std::uint32_t>(firmware::EncoderKind::quadrature);
  {
    Probe probe(device, settings.axis, party.progress);
    // A and B alone first.
    if (has_index) probe.bench().set_temporary({"encoder.index=none"});
    const selftest::HandSettings hand{.patience = settings.patience};
    result.checks.push_back(check_hand_motion(
        probe, hand, [&](const std::string& text) { party.person.ask("Get ready to " + text); }));
    put_back(probe);
  }
  if (has_index && result.passed()) result.checks.push_back(check_index(device, settings, party));
  if (!result.passed()) return result;
  party.person.ask("Let go of the handle");
  if (!stands(device, settings, party)) {
    result.checks.push_back(
        CheckResult{"handle"}.fail("handle", "it does not come to rest: something moves it"));
    return result;
  }
  const Evidence evidence = test_free_handle(device, settings, party);
  const std::vector<CheckResult> all = run_checks(evidence);
  result.checks.insert(result.checks.end(), all.begin(), all.end());
  const auto supply = selftest::mean_and_deviation(evidence.supply, 0, evidence.supply.size());
  result.checks.push_back(check_brake(settings, device.read_number("supply.brake_voltage"), supply.mean));
  return result;
}

}  // namespace kmax::bring_up
