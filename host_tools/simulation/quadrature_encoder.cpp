#include "host_tools/simulation/quadrature_encoder.hpp"

#include <fmt/format.h>

namespace kmax::simulation {

QuadratureEncoder::QuadratureEncoder(const EncoderConfig& config, double position, std::uint64_t seed)
    : config_((validate(config), config)),
      disc_(config.count_length()),
      counts_per_turn_(static_cast<std::int64_t>(config.counts_per_turn)),
      index_(static_cast<std::int64_t>(config.index_position)),
      noise_(seed),
      disc_count_(disc_.extended_counts(position)),
      edges_(disc_count_) {}

void QuadratureEncoder::update(double position) {
  if (config_.edge_noise > 0.0) position += config_.edge_noise * disc_.count_length() * noise_.gaussian();
  const std::int64_t now = disc_.extended_counts(position);
  const std::int64_t moved = now - disc_count_;
  disc_count_ = now;
  if (!plugged_ || moved == 0) return;
  std::int64_t lost = 0;
  if (config_.dropout_probability > 0.0) {
    const std::int64_t number = moved < 0 ? -moved : moved;
    for (std::int64_t edge = 0; edge < number; ++edge)
      lost += noise_.uniform() < config_.dropout_probability ? 1 : 0;
    lost_ += lost;
  }
  edges_ += moved < 0 ? moved + lost : moved - lost;
}

EncoderLines QuadratureEncoder::lines() const {
  if (!plugged_) return {true, true, true};
  const std::int64_t state = edges_ & 3;
  std::int64_t in_turn = disc_count_ % counts_per_turn_;
  if (in_turn < 0) in_turn += counts_per_turn_;
  return {state == 1 || state == 2, state == 2 || state == 3, index_loose_ || in_turn == index_};
}

}  // namespace kmax::simulation
