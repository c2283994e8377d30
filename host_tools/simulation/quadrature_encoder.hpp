#pragma once
// An incremental encoder with its three lines and its defects: handle position in, edges and levels out.
//
// Quantization is EncoderModel's: the disc's count is floor(position / count length). edges() is what a
// lossless counter at the end of the cable holds; it begins with the disc's count, so it is 0 at position 0.
// A leads B while the position grows: with edges() modulo 4 = 0, 1, 2, 3 the levels (A, B) are 00, 10, 11,
// 01. The index Z is high while the disc's count within the turn is the index position, one state wide.
//
// Defects:
//   dropout     every edge is lost in the cable with this probability: edges() then lags, the index does not
//   edge noise  the disc's count is taken at position + noise, drawn again at every update: an edge chatters
//   unplugged   pull-ups hold all three lines high; edges() stays. What happens meanwhile is lost.
//
// Random numbers: noise_generator.hpp, the same for the same seed on every machine. With edge noise the
// result depends on how often update() is called.
//
// Cost of update(): 10 ns; with dropouts 1 ns per edge more. No heap.

#include <cstdint>
#include <optional>

#include "host_tools/simulation/encoder_config.hpp"
#include "host_tools/simulation/noise_generator.hpp"

namespace kmax::simulation {

struct EncoderLines {
  bool a = false;
  bool b = false;
  bool z = false;
  bool operator==(const EncoderLines&) const = default;
};

class QuadratureEncoder {
 public:
  // `position`: m, where the handle is now. Throws std::invalid_argument (validate(EncoderConfig)).
  QuadratureEncoder(const EncoderConfig& config, double position, std::uint64_t seed = 1);

  // Call at least once per control interval. Throws std::domain_error for a position that cannot be counted
  // (NaN), as EncoderModel does.
  void update(double position);

  std::int64_t edges() const { return edges_; }
  EncoderLines lines() const;

  // Pulls the plug, or puts it back.
  void set_plugged(bool plugged) { plugged_ = plugged; }
  bool plugged() const { return plugged_; }
  // The wire of Z alone.
  void set_index_loose(bool loose) { index_loose_ = loose; }

  std::int64_t lost_edges() const { return lost_; }  // by dropouts, number of
  const EncoderConfig& config() const { return config_; }

 private:
  EncoderConfig config_;
  EncoderModel disc_;
  std::int64_t counts_per_turn_;
  std::int64_t index_;
  NoiseGenerator noise_;
  std::int64_t disc_count_;
  std::int64_t edges_;
  std::int64_t lost_ = 0;
  bool plugged_ = true, index_loose_ = false;
};

// The encoder of an axis without a motor: true position in, counter value out. Ideal (EncoderModel) unless
// the scene asks for noise or dropouts; then the lines are simulated. sample() costs a division, or update().
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

  // Every look shows where the handle is, however many there were before.
  bool ideal() const { return !lines_; }

  // By dropouts, number of.
  std::int64_t lost_edges() const { return lines_ ? lines_->lost_edges() : 0; }

 private:
  EncoderModel ideal_;
  std::optional<QuadratureEncoder> lines_;
};

}  // namespace kmax::simulation
