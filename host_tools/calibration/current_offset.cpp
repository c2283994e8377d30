#include "host_tools/calibration/current_offset.hpp"

#include <cmath>

namespace kmax::calibration {

CurrentOffset check_current_offset(std::span<const double> current, const CurrentOffsetConfig& config) {
  CurrentOffset result;
  const auto count = static_cast<double>(current.size());
  if (current.size() < config.fewest_samples || current.size() < 2) {
    result.finding = {CurrentOffsetCause::too_little_data, count, static_cast<double>(config.fewest_samples),
                      "samples"};
    return result;
  }
  double sum = 0.0;
  for (std::size_t k = 0; k < current.size(); ++k) {
    if (!std::isfinite(current[k])) {
      result.finding = {CurrentOffsetCause::not_finite, static_cast<double>(k), 0.0, "(index)"};
      return result;
    }
    sum += current[k];
  }
  const double mean = sum / count;
  double squares = 0.0;
  for (const double i : current) squares += (i - mean) * (i - mean);
  result.noise = std::sqrt(squares / (count - 1.0));
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
      return "";
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
  return "";
}

}  // namespace kmax::calibration
