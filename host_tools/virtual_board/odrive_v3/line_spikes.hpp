#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>

#include "host_tools/simulation/noise_generator.hpp"
#include "host_tools/simulation/spikes.hpp"
#include "host_tools/virtual_board/board_time.hpp"

namespace kmax::virtual_board {

/// When the pulses of simulation::SpikesConfig begin and end.
class LineSpikes {
 public:
  enum Line : std::size_t { index_0, index_1, emergency_stop, fault_line, encoder_0, encoder_1, line_count };

  void configure(const std::optional<simulation::SpikesConfig>& config) { config_ = config; }
  void on_change(std::function<void(Line, BoardTime)> listener) { change_ = std::move(listener); }

  /// A conversion, 25 us after the last one, of bridges that switch. `edge`: s from here to one of their
  /// edges, chosen by a number from 0 to 1.
  void draw(BoardTime now, const std::function<double(double)>& edge) {
    if (!config_) return;
    for (std::size_t line = 0; line < line_count; ++line) {
      constexpr double interval = 25e-6;
      if (!enabled(static_cast<Line>(line)) || next_[line] != never) continue;
      if (noise_.uniform() >= config_->rate * interval) continue;
      const double after = config_->at_samples ? 4e-6 * noise_.uniform() : edge(noise_.uniform());
      next_[line] = now + units_of(after);
    }
    look_ahead();
  }
  bool on(Line line) const { return on_[line]; }
  BoardTime next_event() const { return earliest_; }
  void advance(BoardTime now) {
    for (std::size_t line = 0; line < line_count; ++line) {
      if (next_[line] > now) continue;
      on_[line] = !on_[line];
      begun_ += on_[line] ? 1 : 0;
      next_[line] = on_[line] ? next_[line] + units_of(config_->width) : never;
      change_(static_cast<Line>(line), now);
    }
    look_ahead();
  }
  std::uint64_t begun() const { return begun_; }

 private:
  void look_ahead() { earliest_ = *std::min_element(next_.begin(), next_.end()); }
  static BoardTime units_of(double s) {
    return static_cast<BoardTime>(s * static_cast<double>(units_per_second));
  }
  bool enabled(Line line) const {
    switch (line) {
      case index_0:
      case index_1:
        return config_->index;
      case emergency_stop:
        return config_->emergency_stop;
      case fault_line:
        return config_->fault_line;
      default:
        return config_->encoder;
    }
  }
  static constexpr std::array<BoardTime, line_count> none = [] {
    std::array<BoardTime, line_count> times{};
    times.fill(never);
    return times;
  }();

  std::optional<simulation::SpikesConfig> config_;
  simulation::NoiseGenerator noise_{1};
  std::array<BoardTime, line_count> next_ = none;
  BoardTime earliest_ = never;  ///< of next_
  std::array<bool, line_count> on_{};
  std::uint64_t begun_ = 0;
  std::function<void(Line, BoardTime)> change_;
};

}  // namespace kmax::virtual_board
