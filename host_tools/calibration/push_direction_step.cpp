#include "host_tools/calibration/push_direction_step.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "host_tools/calibration/direction_verdict.hpp"
#include "host_tools/calibration/trip_diagnosis.hpp"

namespace kmax::calibration {

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
  const RecordPlan record{{"count", "current", "voltage"}, samples, interval, 0.0};
  const Recording seen = bench.repeat([&] { return bench.record(plan, record); });
  require_no_trip(seen);
  const double sign = voltage > 0.0 ? 1.0 : -1.0;
  const auto count = seen.of("count"), current = seen.of("current");
  Push result;
  result.counts = sign * (count.back() - count.front());
  // The last tenth of the push.
  const std::size_t end = ticks / static_cast<std::size_t>(interval);
  const std::size_t begin = end - std::max<std::size_t>(1, end / 10);
  const double lost = 2.0 * known.supply * known.pwm_frequency * known.dead_time;
  const double standing = (std::abs(voltage) - lost) / known.resistance;
  const double last = sign * mean_of(current.subspan(begin, end - begin));
  result.missing = 1.0 - last / standing;
  return result;
}
}  // namespace

void PushDirectionStep::run(Bench& bench, MotorKnowledge& known, StepReport& report) {
  constexpr double enough_counts = 30.0, few_counts = 5.0;
  constexpr double turning_share = 0.3;               // of the current that is missing when the shaft turns
  constexpr double shortest = 0.002, longest = 0.25;  // s
  const double lost = 2.0 * known.supply * known.pwm_frequency * known.dead_time;
  const double voltage = std::min(0.6 * known.current * known.resistance + lost, known.largest_voltage());
  Push forwards, backwards;
  for (double duration = shortest; duration <= longest; duration *= 1.5) {
    bench.tell(fmt::format("direction: pushing for {:.0f} ms", 1000.0 * duration));
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
      "a "
      "standing motor draws",
      voltage, counts, 100.0 * missing);
  if (std::abs(counts) < few_counts) {
    if (missing >= turning_share)
      throw StepFailed({"encoder_dead", evidence + ": the motor turns, the encoder does not",
                        "check the encoder's cable, supply and mounting, and encoder.kind"});
    throw StepFailed({"motor_blocked", evidence + ": the motor stands",
                      "free the handle, move it away from its stops, or raise --current"});
  }
  known.direction = settle_direction(bench, known, counts > 0.0, evidence, report);
}

}  // namespace kmax::calibration
