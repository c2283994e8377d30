#pragma once
// The encoder of an axis without a motor: true position in, counter value out. Ideal (encoder_model.hpp)
// unless the scene asks for noise or dropouts; then the lines are simulated (quadrature_encoder.hpp).
//
// Cost of sample(): that of a division when ideal, that of QuadratureEncoder::update() with defects.

#include <cstdint>
#include <optional>

#include "host_tools/simulation/encoder_config.hpp"
#include "host_tools/simulation/quadrature_encoder.hpp"

namespace kmax::simulation {

class AxisEncoder {
 public:
  // `position`: m, where the handle is now. Throws std::invalid_argument.
  AxisEncoder(const EncoderConfig& config, double position, std::uint64_t seed)
      : ideal_(config.count_length()) {
    if (has_defects(config)) lines_.emplace(config, position, seed);
  }

  // Once in every tick: with noise every look shows something else. Throws std::domain_error for a position
  // that cannot be counted.
  std::uint32_t sample(double position) {
    if (!lines_) return ideal_.counts(position);
    lines_->update(position);
    return static_cast<std::uint32_t>(lines_->edges());
  }

  // What a look now would show, without looking: with defects what the last sample() has shown.
  std::uint32_t counts(double position) const {
    return lines_ ? static_cast<std::uint32_t>(lines_->edges()) : ideal_.counts(position);
  }

  // By dropouts, number of.
  std::int64_t lost_edges() const { return lines_ ? lines_->lost_edges() : 0; }

 private:
  EncoderModel ideal_;
  std::optional<QuadratureEncoder> lines_;
};

}  // namespace kmax::simulation
