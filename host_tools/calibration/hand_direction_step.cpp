#include "host_tools/calibration/hand_direction_step.hpp"

#include <fmt/format.h>

#include <cmath>

namespace kmax::calibration {

void HandDirectionStep::run(Bench& bench, MotorKnowledge& known, StepReport& report) {
  constexpr double least_counts = 20.0;
  bench.disarm();
  const double before = bench.displacement();
  bench.prompter()->ask(
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

}  // namespace kmax::calibration
