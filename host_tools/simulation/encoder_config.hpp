#pragma once
// The encoder on a motor shaft, and the transmission between the shaft and the handle.

#include <array>
#include <cmath>
#include <cstdint>
#include <span>
#include <stdexcept>

#include <fmt/format.h>

#include "firmware/object_dictionary/axis_groups.hpp"
#include "host_tools/simulation/model_field.hpp"

namespace kmax::simulation {

// An ideal incremental encoder: true position in, counter value out. The counter is 32 bits wide and wraps,
// as a timer in encoder mode does; below zero it continues at 2^32 - 1. Nothing is added (noise, missing
// counts): a scene names sensor defects as parts of their own.

class EncoderModel {
 public:
  // `count_length`: metres of handle travel per count, > 0. Throws std::invalid_argument.
  explicit EncoderModel(double count_length) : count_length_(count_length) {
    if (!std::isfinite(count_length) || !(count_length >= 1e-12) || count_length > 1.0) {
      throw std::invalid_argument(
          fmt::format("encoder count length = {} m: allowed is a number from 1e-12 to 1 m", count_length));
    }
  }

  // The count a lossless 64-bit counter would hold: floor(position / count length). The largest distance is
  // 2^53 counts, the last one that a double resolves. Throws std::domain_error beyond it and for NaN.
  std::int64_t extended_counts(double position) const {
    const double counts = std::floor(position / count_length_);
    if (!(std::abs(counts) <= 9007199254740992.0)) {
      throw std::domain_error(
          fmt::format("position {} m cannot be counted in steps of {} m", position, count_length_));
    }
    return static_cast<std::int64_t>(counts);
  }

  std::uint32_t counts(double position) const {
    return static_cast<std::uint32_t>(extended_counts(position));
  }

  double count_length() const { return count_length_; }

 private:
  double count_length_;
};

// Metres of handle travel per count of an encoder on the motor shaft. `counts_per_turn`: after four-fold
// decoding. `transmission`: handle metres per motor radian.
inline double count_length(double counts_per_turn, double transmission) {
  constexpr double two_pi = 6.283185307179586;
  return two_pi * transmission / counts_per_turn;
}

using firmware::EncoderKind;

// Default: 0.055 mm per count, the resolution of the Geomagic Touch (paper 1, section 4), and no defects.
struct EncoderConfig {
  double counts_per_turn = 4000.0;        // quadrature: four times the lines
  double transmission = 0.0350140874800;  // handle metres per motor radian
  double index_position = 0.0;            // count within the turn at which the index is high
  double dropout_probability = 0.0;       // of every edge, to be lost
  double edge_noise = 0.0;                // counts, standard deviation of where an edge is seen
  EncoderKind kind = EncoderKind::quadrature;
  bool reversed = false;        // counts fall while the handle's position grows
  bool select_filtered = true;  // of an AS5047P: the solder jumper J20 beside GPIO7 is open

  double count_length() const { return simulation::count_length(counts_per_turn, transmission); }
};

inline constexpr std::array encoder_fields{
    ModelField<EncoderConfig>{"counts_per_turn", &EncoderConfig::counts_per_turn, 1.0, 1e9, "",
                              "counts of a turn; quadrature: four times the lines", "whole with a motor"},
    ModelField<EncoderConfig>{"transmission", &EncoderConfig::transmission, 1e-6, 10.0, "m/rad",
                              "travel of the handle per motor radian"},
    ModelField<EncoderConfig>{"index_position", &EncoderConfig::index_position, 0.0, 1e9, "counts",
                              "count within the turn at which the index is high; needs a motor", "whole"},
    ModelField<EncoderConfig>{"dropout_probability", &EncoderConfig::dropout_probability, 0.0, 1.0, "",
                              "probability with which an edge is lost"},
    ModelField<EncoderConfig>{"edge_noise", &EncoderConfig::edge_noise, 0.0, 100.0, "counts",
                              "standard deviation of where an edge is seen"},
};

// Whether the lines are worth simulating: without defects a count is all that they say.
inline bool has_defects(const EncoderConfig& config) {
  return config.dropout_probability > 0.0 || config.edge_noise > 0.0;
}

// Throws std::invalid_argument: a field outside its range; an index position that is not a whole number below
// the counts of a turn; counts of a turn that are not whole.
inline void validate(const EncoderConfig& config) {
  require_allowed(config, std::span<const ModelField<EncoderConfig>>(encoder_fields), "encoder");
  if (config.counts_per_turn != std::floor(config.counts_per_turn)) {
    throw std::invalid_argument(
        fmt::format("encoder.counts_per_turn = {}: allowed is a whole number", config.counts_per_turn));
  }
  if (config.index_position != std::floor(config.index_position) ||
      config.index_position >= config.counts_per_turn) {
    throw std::invalid_argument(
        fmt::format("encoder.index_position = {}: allowed is a whole number below counts_per_turn = {}",
                    config.index_position, config.counts_per_turn));
  }
}

}  // namespace kmax::simulation
