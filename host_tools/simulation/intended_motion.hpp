#pragma once
// Where the person wants the hand to be: the intended position u(t) that pulls the arm spring of
// operator_model.hpp.
//
// One trial has five phases:
//
//   rest      u = start position, until begin() is called
//   approach  u moves at the approach speed towards the target
//   hold      u has met the target; it follows the target (never faster than the approach speed) for the hold
//   time release   u moves back to the start position at the approach speed done      u = start position
//
// The target is defined by a force, because a person who presses on a wall controls the force and not a
// position inside the wall: it is the u for which grip and arm in series, at rest, press with exactly `push`
// newtons on a handle that stands on the wall's surface,
//
//   u_target = wall - side * push / (g k1 k2 / (k1 + k2)),    push = push force + lag(background force),
//
// so it lies on the far side of the surface. The person pushes through the field: the background force,
// delayed by the push lag, is added. The activation g appears in it, so a stiffer arm does not press harder.
// A handle that has sunk into the wall by d feels d * g k1 k2/(k1 + k2) less than `push` (1.2 % at 0.1 mm, 1
// N and 116 N/m).
//
// Works for a wall on either side: `wall_side` = +1 means that free space is above `wall_position`.
// u is continuous and piecewise linear; its rate jumps at the corners between phases. Corners are placed
// exactly, so the motion does not depend on how time is divided, except through the target, which the caller
// gives at the end of each piece and which moves linearly within it. No heap, no division by zero. Cost:
// about 5 ns per piece.

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <optional>
#include <span>

#include "host_tools/simulation/model_field.hpp"

namespace kmax::simulation {

struct IntendedMotionConfig {
  double start_position = 0.02;  // m, in free space
  double approach_speed = 0.2;   // m/s
  double push_force = 1.0;       // N, static push at the surface, without the background force
  double hold_time = 3.0;        // s
  double open_time = 0.0;        // s after the hold for which the hand lets the handle go; 0: it never does
  double wall_position = 0.0;    // m
  double wall_side = 1.0;        // +1 or -1: free space is on this side
};

inline constexpr std::array motion_fields{
    ModelField<IntendedMotionConfig>{"start_position", &IntendedMotionConfig::start_position, -10.0, 10.0,
                                     "m", "where the hand begins, in free space"},
    ModelField<IntendedMotionConfig>{"approach_speed", &IntendedMotionConfig::approach_speed, 1e-4, 100.0,
                                     "m/s", "speed towards the wall and back"},
    ModelField<IntendedMotionConfig>{"push_force", &IntendedMotionConfig::push_force, 0.0, 1000.0, "N",
                                     "static push at the surface, without the background force"},
    ModelField<IntendedMotionConfig>{"hold_time", &IntendedMotionConfig::hold_time, 0.0, 1e5, "s",
                                     "how long the wall is pressed"},
    ModelField<IntendedMotionConfig>{"open_time", &IntendedMotionConfig::open_time, 0.0, 1e5, "s",
                                     "how long the hand lets the handle go after that; 0: it never does"},
    ModelField<IntendedMotionConfig>{"wall_position", &IntendedMotionConfig::wall_position, -10.0, 10.0, "m",
                                     "wall that is aimed at; without it the parameter wall.position"},
    ModelField<IntendedMotionConfig>{
        "wall_side", &IntendedMotionConfig::wall_side, -1.0, 1.0, "",
        "side of that wall where free space is; without it the parameter wall.side", "-1 or +1"},
};

// Throws std::invalid_argument, also for a start inside the wall.
inline void validate(const IntendedMotionConfig& config) {
  require_allowed(config, std::span<const ModelField<IntendedMotionConfig>>(motion_fields), "motion");
  if (std::abs(config.wall_side) != 1.0) {
    throw std::invalid_argument(fmt::format("motion.wall_side = {}: allowed is -1 or +1", config.wall_side));
  }
  if (config.wall_side * (config.start_position - config.wall_position) < 0.0) {
    throw std::invalid_argument(
        fmt::format("motion.start_position = {} m lies inside the wall at {} m (free space is on side {:+}): "
                    "start in free space",
                    config.start_position, config.wall_position, config.wall_side));
  }
}

enum class MotionPhase { rest, approach, hold, release, done };

class IntendedMotion {
 public:
  // A straight piece of u(t): u = start + rate * t for `duration` seconds.
  struct Segment {
    double duration;
    double start;
    double rate;
  };
  // At most five corners fit into one piece of time: approach, catching up, following, release, done.
  static constexpr int max_segments = 6;
  struct Path {
    std::array<Segment, max_segments> segments;
    int count = 0;
  };

  // Rests at the start position; the target is the wall's surface until advance() is told otherwise.
  explicit IntendedMotion(const IntendedMotionConfig& config)
      : config_(config), position_(config.start_position), target_(config.wall_position) {
    validate(config);
  }

  // Starts the approach now, from wherever u is. May be called again at any time: a new trial.
  void begin() {
    phase_ = MotionPhase::approach;
    elapsed_ = 0.0;
    hold_begin_.reset();
  }

  // The intended position that presses with `push` newtons on a handle at the surface.
  double target_for(double push, double stiffness_in_series) const {
    return config_.wall_position - config_.wall_side * push / stiffness_in_series;
  }

  // Advances by `duration` > 0 seconds, during which the target moves linearly to `target_at_end`.
  Path advance(double duration, double target_at_end);

  // The same if no corner falls into the piece and u rests or keeps to its target, which is nearly always:
  // true, and the segment. False: nothing is done, call advance(). A quarter of its cost.
  bool advance_without_corner(double duration, double target_at_end, Segment& segment);

  double position() const { return position_; }
  MotionPhase phase() const { return phase_; }
  // Seconds since begin(); 0 while at rest.
  double elapsed() const { return elapsed_; }
  // Begin and end of the hold phase in seconds since begin(); known once the hold has begun.
  std::optional<double> hold_begin() const { return hold_begin_; }
  std::optional<double> hold_end() const {
    return hold_begin_ ? std::optional<double>(*hold_begin_ + config_.hold_time) : std::nullopt;
  }
  const IntendedMotionConfig& config() const { return config_; }

 private:
  struct Chase {
    double duration;
    double rate;
    bool met;
  };

  // One straight piece towards a goal that itself moves with `slope`, for at most `limit` seconds; it ends
  // early where u meets the goal. Once met, u keeps to the goal as long as the goal is no faster than the
  // approach speed.
  Chase chase(double goal, double slope, double limit) const {
    const double gap = goal - position_;
    const double speed = config_.approach_speed;
    if (gap == 0.0 && phase_ != MotionPhase::hold) return {0.0, 0.0, true};
    if (gap == 0.0) return {limit, std::clamp(slope, -speed, speed), true};
    const double rate = std::copysign(speed, gap);
    const double closing = std::copysign(1.0, gap) * (rate - slope);
    if (closing <= 0.0 || std::abs(gap) >= closing * limit) return {limit, rate, false};
    return {std::abs(gap) / closing, rate, true};
  }

  IntendedMotionConfig config_;
  MotionPhase phase_ = MotionPhase::rest;
  double position_;
  double target_;
  double elapsed_ = 0.0;
  double hold_left_ = 0.0;
  std::optional<double> hold_begin_;
};

inline bool IntendedMotion::advance_without_corner(double duration, double target_at_end, Segment& segment) {
  segment = {duration, position_, 0.0};
  if (phase_ == MotionPhase::hold) {
    if (position_ != target_ || !(hold_left_ > duration)) return false;
    if (target_at_end != target_) {
      segment.rate = (target_at_end - target_) / duration;
      if (!(std::abs(segment.rate) <= config_.approach_speed)) return false;
      position_ = target_ = target_at_end;
    }
    hold_left_ -= duration;
    elapsed_ += duration;
    return true;
  }
  if (phase_ != MotionPhase::rest && phase_ != MotionPhase::done) return false;
  target_ = target_at_end;
  if (phase_ == MotionPhase::done) elapsed_ += duration;
  return true;
}

inline IntendedMotion::Path IntendedMotion::advance(double duration, double target_at_end) {
  Path path;
  const double slope = (target_at_end - target_) / duration;
  double left = duration;
  while (left > 0.0 && path.count < max_segments) {
    const bool last = path.count == max_segments - 1;  // never reached; keeps the time covered if it were
    Chase piece{left, 0.0, false};
    double end = position_;
    const bool towards_target = phase_ == MotionPhase::approach || phase_ == MotionPhase::hold;
    if (towards_target) {
      const double limit = phase_ == MotionPhase::hold ? std::min(left, hold_left_) : left;
      piece = chase(target_, slope, limit);
      if (last) piece.duration = left;
      const double target_then = piece.duration == left ? target_at_end : target_ + slope * piece.duration;
      const bool keeps_up = piece.met && (piece.rate == slope || position_ != target_);
      end = keeps_up ? target_then : position_ + piece.rate * piece.duration;
      target_ = target_then;
    } else if (phase_ == MotionPhase::release) {
      piece = chase(config_.start_position, 0.0, left);
      if (last) piece.duration = left;
      end = piece.met ? config_.start_position : position_ + piece.rate * piece.duration;
    }
    if (piece.duration > 0.0) {
      path.segments[static_cast<std::size_t>(path.count++)] = {piece.duration, position_, piece.rate};
    }
    position_ = end;
    left = piece.duration >= left ? 0.0 : left - piece.duration;
    if (phase_ != MotionPhase::rest) elapsed_ += piece.duration;
    if (phase_ == MotionPhase::approach && piece.met) {
      phase_ = MotionPhase::hold;
      hold_begin_ = elapsed_;
      hold_left_ = config_.hold_time;
    } else if (phase_ == MotionPhase::hold) {
      hold_left_ -= piece.duration;
      if (hold_left_ <= 0.0) phase_ = MotionPhase::release;
    } else if (phase_ == MotionPhase::release && piece.met) {
      phase_ = MotionPhase::done;
    }
  }
  target_ = target_at_end;
  return path;
}

}  // namespace kmax::simulation
