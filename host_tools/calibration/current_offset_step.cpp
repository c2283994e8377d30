#include "host_tools/calibration/current_offset_step.hpp"

#include <fmt/format.h>

#include "host_tools/calibration/current_offset.hpp"
#include "host_tools/calibration/trip_diagnosis.hpp"

namespace kmax::calibration {

void CurrentOffsetStep::run(Bench& bench, MotorKnowledge& known, StepReport& report) {
  known.supply = bench.number("supply.voltage");
  const double least = bench.number("supply.voltage_min"), most = bench.number("supply.voltage_max");
  if (known.supply < least || known.supply > most)
    throw StepFailed(diagnosis_of(firmware::Refusal::supply_out_of_range, known.supply, least, most));
  const Recording recording = bench.watch({{"current_b", "current_c"}, 500, 7, 0.0});
  for (const char* phase : {"b", "c"}) {
    const CurrentOffset offset = check_current_offset(recording.of(fmt::format("current_{}", phase)));
    report.values.push_back({fmt::format("current_{}.offset", phase), offset.mean.value,
                             offset.mean.standard_error, "A", std::nullopt});
    report.values.push_back({fmt::format("current_{}.noise", phase), offset.noise, 0.0, "A", std::nullopt});
    if (!offset.finding.is_none())
      throw StepFailed(
          {fmt::format("current_{}_offset", phase),
           fmt::format("current sensor {} with the bridge off: {}", phase, to_string(offset.finding)),
           "check the shunt and its amplifier; nothing may turn the motor meanwhile"});
  }
  report.values.push_back({"supply.voltage", known.supply, 0.0, "V", std::nullopt});
}

}  // namespace kmax::calibration
