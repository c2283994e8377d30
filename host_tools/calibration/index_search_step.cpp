#include "host_tools/calibration/index_search_step.hpp"

#include <fmt/format.h>

#include "host_tools/calibration/field_sweep.hpp"

namespace kmax::calibration {

void IndexSearchStep::run(Bench& bench, MotorKnowledge& known, StepReport& report) {
  // What was found before without the index is not asked for: of an identified motor
  // measured.commutation_known then tells whether the index has been passed.
  bench.set_result({"motor.commutation_known=no"});
  bench.set_temporary({"motor.calibrated=yes"});
  const auto passed = [&] { return bench.number("measured.commutation_known") != 0.0; };
  double before = bench.number("measured.count");
  if (!passed()) {
    FieldSweep sweep(bench, known);
    sweep.prepare();
    bench.tell("index: sweeping over the travel");
    const Recording to = sweep.sweep(true), fro = sweep.sweep(false);
    sweep.require_living_encoder(to, fro);
    sweep.finish();
    const double displacement = bench.displacement();
    before = bench.number("measured.count");
    // Counts are referred to the index while no force acts.
    bench.disarm();
    bench.wait(0.05);
    if (!passed())
      throw StepFailed({"index_not_found",
                        fmt::format("the index has not been seen within {:.1f} mm of travel to either side",
                                    1000.0 * bench.travel()),
                        "move the handle nearer to the index, allow more --travel, or check the index line"});
    bench.rehome(displacement);
  }
  report.values.push_back({"measured.count", bench.number("measured.count"), 0.0, "counts", before});
}

}  // namespace kmax::calibration
