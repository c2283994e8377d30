#include "host_tools/calibration/current_offset.hpp"

#include <fmt/format.h>

#include <cmath>

#include "host_tools/calibration/step.hpp"

namespace kmax::calibration {

CurrentOffset check_current_offset(std::span<const double> current, const CurrentOffsetConfig& config) {
  CurrentOffset result;
  const auto count = static_cast<double>(current.size());
  if (current.size() < config.fewest_samples || current.size() < 2) {
    result.finding = {CurrentOffsetCause::too_little_data, count, static_cast<double>(config.fewest_samples),
                      "samples"};
    return result;
  }
  for (std::size_t k = 0; k < current.size(); ++k) {
    if (std::isfinite(current[k])) continue;
    result.finding = {CurrentOffsetCause::not_finite, static_cast<double>(k), 0.0, "(index)"};
    return result;
  }
  const double mean = bench::mean_of(current);
  result.noise = bench::deviation_of(current);
  // Without noise the converter's step bounds what is known: uniform within it.
  result.mean = {mean, std::hypot(result.noise / std::sqrt(count), config.adc_step / std::sqrt(12.0 * count)),
                 "A"};
  const bool far = !(std::abs(mean) <= config.largest_offset);
  if (far && result.noise == 0.0) {
    result.finding = {CurrentOffsetCause::railed, mean, config.largest_offset, "A"};
  } else if (far) {
    result.finding = {CurrentOffsetCause::offset_large, mean, config.largest_offset, "A"};
  } else if (!(result.noise <= config.largest_noise)) {
    result.finding = {CurrentOffsetCause::noise_large, result.noise, config.largest_noise, "A"};
  }
  return result;
}

std::string_view to_string(CurrentOffsetCause cause) {
  switch (cause) {
    case CurrentOffsetCause::none:
      break;
    case CurrentOffsetCause::too_little_data:
      return "current offset: too few samples; capture more";
    case CurrentOffsetCause::not_finite:
      return "current offset: a sample is not a number";
    case CurrentOffsetCause::offset_large:
      return "current offset: with the bridge off a current is read; the amplifier drifts, or the shaft is "
             "turned";
    case CurrentOffsetCause::noise_large:
      return "current offset: the noise is large; look at the shunts' wiring and the amplifier's gain";
    case CurrentOffsetCause::railed:
      return "current offset: the reading is constant and far from zero; amplifier or converter is stuck";
  }
  return {};
}

void check_current_sensors(Calibration& run) {
  Bench& bench = run.bench;
  MotorKnowledge& known = run.known;
  StepReport& report = run.report;
  known.supply = bench.number("supply.voltage");
  const double least = bench.number("supply.voltage_min"), most = bench.number("supply.voltage_max");
  if (known.supply < least || known.supply > most)
    throw StepFailed(diagnosis_of(firmware::Refusal::supply_out_of_range, known.supply, least, most));
  const Waveforms recording = bench.watch({{"current_b", "current_c"}, 500, 7, 0.0});
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
