// Which way is positive: by hand, by pushes of a brushed motor, and what follows from it.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "host_tools/calibration/step.hpp"

namespace kmax::calibration {

void settle_direction(Calibration& run, bool agrees, const std::string& evidence) {
  MotorKnowledge& known = run.known;
  const int before = known.direction;
  const auto report = [&] {
    run.report.values.push_back(
        {"encoder.direction", static_cast<double>(known.direction), 0.0, "", static_cast<double>(before)});
  };
  if (agrees) {
    if (!known.hand_checked) report();
    return;
  }
  if (known.hand_checked)
    throw StepFailed(
        {"phases_swapped", evidence + "; the hand has shown that the encoder counts the right way",
         known.brushed() ? "exchange the motor's two wires" : "exchange any two of the motor's wires"});
  known.direction = -before;
  run.report.remarks.push_back(
      {"encoder_reversed_or_phases_swapped", evidence,
       fmt::format("encoder.direction becomes {:+d}, which cures both; --hand tells which of the two it is",
                   known.direction)});
  const double displacement = run.bench.displacement();
  run.bench.set_result({fmt::format("encoder.direction={:+d}", known.direction)});
  run.bench.rehome(-displacement);
  report();
}

void find_direction_by_hand(Calibration& run) {
  Bench& bench = run.bench;
  MotorKnowledge& known = run.known;
  StepReport& report = run.report;
  constexpr double least_counts = 20.0;
  bench.disarm();
  const double before = bench.displacement();
  run.prompter->ask(
      fmt::format("move the handle by {:.0f} mm towards the end that is to be positive, and leave it there",
                  500.0 * bench.travel()));
  const double moved = bench.displacement() - before;
  const double counts = moved / known.count_length();
  report.values.push_back({"hand.moved", moved, known.count_length(), "m", std::nullopt});
  if (std::abs(counts) < least_counts)
    throw StepFailed(
        {"encoder_dead", fmt::format("the encoder counted {:.0f} while the handle was moved by hand", counts),
         "if the handle was moved: check the encoder's cable, supply and mounting, and encoder.kind"});
  // The bench's origin stays where it was; where the hand has put the handle is as good a start as any.
  const int direction = counts > 0.0 ? known.direction : -known.direction;
  if (direction != known.direction) {
    report.remarks.push_back({"encoder_reversed",
                              "the count fell while the handle was moved towards its positive end",
                              fmt::format("encoder.direction becomes {:+d}", direction)});
    bench.set_result({fmt::format("encoder.direction={:+d}", direction)});
  }
  report.values.push_back(
      {"encoder.direction", static_cast<double>(direction), 0.0, "", static_cast<double>(known.direction)});
  bench.rehome(0.0);
  known.direction = direction;
  known.hand_checked = true;
}

namespace {
struct Push {
  double counts = 0.0;   // in the push's direction
  double missing = 0.0;  // share of voltage / resistance that the current lacks at the push's end
};

Push push(Bench& bench, const MotorKnowledge& known, double voltage, double duration) {
  ExcitationPlan plan;
  plan.kind = "voltage";
  plan.bias = voltage;
  plan.duration = duration;
  const auto ticks = static_cast<std::size_t>(duration / known.tick);
  // The shaft coasts to rest in the time after it.
  const int interval = static_cast<int>(std::max<std::size_t>(1, ticks / 300));
  const std::size_t samples = 2 * ticks / static_cast<std::size_t>(interval);
  const CapturePlan record{{"count", "current", "voltage"}, samples, interval, 0.0};
  const Waveforms seen = bench.repeat([&] { return bench.record(plan, record); });
  require_no_trip(seen);
  const double sign = voltage > 0.0 ? 1.0 : -1.0;
  const auto count = seen.of("count"), current = seen.of("current");
  Push result;
  result.counts = sign * (count.back() - count.front());
  // The last tenth of the push.
  const std::size_t end = ticks / static_cast<std::size_t>(interval);
  const std::size_t begin = end - std::max<std::size_t>(1, end / 10);
  const double lost = 2.0 * known.supply * known.electronics->pwm_hz() * known.dead_time;
  const double standing = (std::abs(voltage) - lost) / known.resistance;
  const double last = sign * bench::mean_of(current.subspan(begin, end - begin));
  result.missing = 1.0 - last / standing;
  return result;
}
}  // namespace

void find_direction_by_pushes(Calibration& run) {
  Bench& bench = run.bench;
  const MotorKnowledge& known = run.known;
  constexpr double enough_counts = 30.0, few_counts = 5.0;
  constexpr double turning_share = 0.3;               // of the current that is missing when the shaft turns
  constexpr double shortest = 0.002, longest = 0.25;  // s
  const double lost = 2.0 * known.supply * known.electronics->pwm_hz() * known.dead_time;
  const double voltage = std::min(0.6 * known.current * known.resistance + lost, known.largest_voltage());
  Push forwards, backwards;
  for (double duration = shortest; duration <= longest; duration *= 1.5) {
    bench.progress(fmt::format("direction: pushing for {:.0f} ms", 1000.0 * duration));
    forwards = push(bench, known, voltage, duration);
    backwards = push(bench, known, -voltage, duration);
    const double counts = std::abs(forwards.counts + backwards.counts) / 2.0;
    const double missing = (forwards.missing + backwards.missing) / 2.0;
    if (counts >= enough_counts || missing >= 2.0 * turning_share) break;
  }
  const double counts = (forwards.counts + backwards.counts) / 2.0;
  const double missing = (forwards.missing + backwards.missing) / 2.0;
  const std::string evidence = fmt::format(
      "pushed to and fro with {:.2f} V the encoder counts {:.1f}, and the current falls by {:.0f} % of what "
      "a standing motor draws",
      voltage, counts, 100.0 * missing);
  if (std::abs(counts) < few_counts) {
    if (missing >= turning_share) throw_encoder_dead(evidence);
    throw_motor_blocked(evidence);
  }
  settle_direction(run, counts > 0.0, evidence);
}

}  // namespace kmax::calibration
