#pragma once

#include <cstdint>

#include "control/finite.hpp"
#include "control/sine_cosine.hpp"

namespace kmax::firmware {

/// What is excited; the numbers are those of excitation.kind. Torque and position need the rotor's angle.
enum class ExcitationKind : std::uint8_t {
  off = 0,
  voltage = 1,   ///< open loop: a vector in the stator's frame; DC: a magnitude
  current = 2,   ///< closed loop: likewise
  torque = 3,    ///< torque-making current, by the encoder's electrical angle
  position = 4,  ///< force of a spring and damper between the handle and a moving point
};

enum class AlternationAxis : std::uint8_t { along = 0, across = 1 };

struct ExcitationConfig {
  ExcitationKind kind = ExcitationKind::off;
  std::uint32_t run{};          ///< another number starts it
  float bias{};                 ///< V or A
  float alternation{};          ///< V or A, amplitude of the square wave; its first half is positive
  std::uint32_t half_period{};  ///< ticks; 0: no square wave
  AlternationAxis alternation_axis = AlternationAxis::along;
  float angle{};          ///< rad, electrical
  float angle_rate{};     ///< rad/s, electrical, at most half a turn per tick
  float angle_span{};     ///< rad, >= 0: the vector stands after having turned this far; 0: it never turns
  float ramp{};           ///< s, >= 0: bias and alternation come up over this time
  float duration{};       ///< s, >= 0; 0: nothing is excited
  float travel{};         ///< m, >= 0, for the axis' trip
  float stiffness{};      ///< N/m, >= 0
  float damping{};        ///< N s/m, >= 0
  float speed{};          ///< m/s, >= 0, of the moving point
  float stroke{};         ///< m, signed
  float force_limit{};    ///< N, >= 0: bound of kind position
  double count_length{};  ///< m per encoder count, > 0
  float tick_rate{};      ///< Hz, > 0
};

/// What the motor is asked for instead of a wall's force: for identification and self-test.
///
///   factor   time / ramp up to 1
///   along    factor x (bias + square wave)     or   factor x bias, with the square wave across
///   across   0                                 or   factor x square wave, a quarter electrical turn ahead
///   angle    angle + what has been turned, at angle_rate until angle_span
///   position force = stiffness (point - moved) + damping (point speed - velocity), |force| <= force_limit;
///            `moved` from where the handle was at the start; the point goes from there to `stroke` at
///            `speed`, then stands. Neither ramp nor bias nor alternation: the spring starts without tension.
///
/// A DC motor and kind torque have one dimension: their square wave is along or it is not.
///
/// Only a `run` that differs from the one before starts the excitation, and not while it stands by: to arm an
/// axis starts nothing, whatever was left in its parameters. For `duration` it lasts, then it asks for zero
/// and is `finished` until the next start. Another `kind` under way is the end of the run, since what was V
/// would become A or N. All else may change in between: the vector turns on from where it stands, the point
/// moves on from where it is, amplitudes step. A configuration with a value that is not finite, or that has
/// no meaning, excites nothing and allows no travel. A velocity that is not finite makes a force that is
/// not: the motor control makes a fault of it.
///
/// What bounds an identification is current.limit and the travel. force.limit bounds the kind position only:
/// a current in the stator's frame makes a force that nobody knows yet, and a motor must be identifiable
/// while force.limit, meant for whoever holds the handle, is small or 0.
///
/// Turning and moving are sums of integers, so they drift by nothing but the rounding of one step: 2^-33 of a
/// turn, 2^-33 of a count. Cost: about 60 Cortex-M4F instructions, no division.
class Excitation {
 public:
  struct Coefficients {
    ExcitationKind kind = ExcitationKind::off;
    bool across = false;
    std::uint32_t run{};
    std::uint32_t duration{};       ///< ticks
    std::uint32_t ramp_ticks{};     ///< ticks
    std::uint32_t half_period{};    ///< ticks
    std::uint32_t travel_counts{};  ///< for the axis' trip: farther than this
    float ramp_step{};              ///< per tick
    float bias{}, alternation{};
    control::TurnFraction angle{};
    std::int32_t angle_step{};  ///< 2^-32 turns per tick
    std::int64_t angle_span{};  ///< 2^-32 turns
    float electrical_speed{};   ///< rad/s
    float stiffness{};          ///< N per 2^-8 counts
    float damping{};            ///< N s/m
    float speed{};              ///< m/s
    float force_limit{};        ///< N
    float count_length{};       ///< m
    std::int64_t stroke{};      ///< 2^-32 counts
    std::int64_t point_step{};  ///< 2^-32 counts per tick, >= 0
  };

  struct Output {
    ExcitationKind kind = ExcitationKind::off;
    float along = 0.0f, across = 0.0f;  ///< V or A; kind torque: along is the torque-making current
    float force = 0.0f;                 ///< N at the handle, kind position
    control::TurnFraction angle = 0;    ///< electrical, of `along`
    float electrical_speed = 0.0f;      ///< rad/s, of that angle
    bool alternating = false;           ///< there is a square wave: the current may lag behind its reference
    bool started = false;               ///< this is the first tick of a run
    bool finished = false;              ///< there is no run, its duration is over, or the kind is off
  };

  /// Outside the interrupt.
  static constexpr Coefficients prepare(const ExcitationConfig& config);

  /// While the axis is not driven, and before the first update() after that: no run is under way, and the
  /// present one will not start.
  void stand_by(const Coefficients& c) {
    run_ = c.run;
    end();
  }

  /// The run is over.
  void end() {
    time_ = over;
    turned_ = 0;
  }

  /// Once per tick while driven. `position`: counts along +x. `velocity`: m/s.
  Output update(const Coefficients& c, std::int64_t position, float velocity);

 private:
  // Farther than this from the start counts as this far; twice as much still fits into 63 bits.
  static constexpr std::int64_t farthest_counts = std::int64_t{1} << 29;
  static constexpr std::uint32_t over = UINT32_MAX;

  static constexpr bool usable(const ExcitationConfig& config);
  static constexpr std::int64_t rounded(double value, double most);
  static constexpr std::int64_t bounded(std::int64_t value, std::int64_t most) {
    return value > most ? most : value < -most ? -most : value;
  }

  float square_wave(const Coefficients& c);
  float turn(const Coefficients& c);
  float spring_force(const Coefficients& c, std::int64_t position, float velocity);

  std::int64_t start_ = 0;   // counts
  std::int64_t point_ = 0;   // 2^-32 counts from the start
  std::int64_t turned_ = 0;  // 2^-32 turns
  std::uint32_t run_ = 0;
  std::uint32_t time_ = over;  // ticks
  std::uint32_t phase_ = 0;    // ticks into this half of the square wave
  ExcitationKind kind_ = ExcitationKind::off;
  bool negative_ = false;  // which half it is
};

constexpr bool Excitation::usable(const ExcitationConfig& config) {
  for (const float value : {config.bias, config.alternation, config.angle, config.angle_rate}) {
    if (!control::is_finite(value)) return false;
  }
  for (const float value : {config.angle_span, config.ramp, config.duration, config.travel, config.stiffness,
                            config.damping, config.speed, config.force_limit}) {
    if (!control::is_finite(value) || value < 0.0f) return false;
  }
  return control::is_finite(config.stroke) && control::is_finite(config.count_length) &&
         config.count_length > 0.0 && control::is_finite(config.tick_rate) && config.tick_rate > 0.0f;
}

/// To the nearest whole number, its magnitude at most `most` (<= 2^62).
constexpr std::int64_t Excitation::rounded(double value, double most) {
  const double within = value > most ? most : value < -most ? -most : value;
  return static_cast<std::int64_t>(within < 0.0 ? within - 0.5 : within + 0.5);
}

constexpr Excitation::Coefficients Excitation::prepare(const ExcitationConfig& config) {
  constexpr double fraction = 4294967296.0;  // 2^32
  constexpr double turn = 6.283185307179586476925;
  constexpr double most = fraction - 1.0, most_wide = 4.0e18;
  Coefficients c;
  c.run = config.run;
  if (!usable(config)) return c;
  const auto rate = static_cast<double>(config.tick_rate);
  const double counts = 1.0 / config.count_length;
  c.kind = config.kind;
  c.across = config.alternation_axis == AlternationAxis::across;
  c.duration = static_cast<std::uint32_t>(rounded(static_cast<double>(config.duration) * rate, most));
  c.ramp_ticks = static_cast<std::uint32_t>(rounded(static_cast<double>(config.ramp) * rate, most));
  if (c.ramp_ticks != 0) c.ramp_step = 1.0f / static_cast<float>(c.ramp_ticks);
  c.bias = config.bias;
  c.half_period = config.alternation != 0.0f ? config.half_period : 0;
  c.alternation = c.half_period != 0 ? config.alternation : 0.0f;
  // Only the fraction of a turn counts, as two's complement.
  const double turns = static_cast<double>(config.angle) / turn;
  const double whole = static_cast<double>(rounded(turns, 1e15));
  c.angle = static_cast<control::TurnFraction>(rounded((turns - whole) * fraction, fraction));
  c.angle_step = static_cast<std::int32_t>(
      rounded(static_cast<double>(config.angle_rate) / rate / turn * fraction, 2147483647.0));
  c.angle_span = rounded(static_cast<double>(config.angle_span) / turn * fraction, most_wide);
  c.electrical_speed = static_cast<float>(static_cast<double>(c.angle_step) / fraction * turn * rate);
  // A count more or less by rounding must not decide about a travel that is a whole number of counts.
  c.travel_counts =
      static_cast<std::uint32_t>(static_cast<double>(config.travel) * counts * (1.0 + 1e-6) < most
                                     ? static_cast<double>(config.travel) * counts * (1.0 + 1e-6)
                                     : most);
  c.count_length = static_cast<float>(config.count_length);
  c.stiffness = static_cast<float>(static_cast<double>(config.stiffness) * config.count_length / 256.0);
  c.damping = config.damping;
  c.force_limit = config.force_limit;
  const auto farthest = static_cast<double>(farthest_counts) * fraction;
  c.stroke = rounded(static_cast<double>(config.stroke) * counts * fraction, farthest);
  c.point_step = rounded(static_cast<double>(config.speed) / rate * counts * fraction, farthest);
  c.speed = config.speed;
  return c;
}

inline Excitation::Output Excitation::update(const Coefficients& c, std::int64_t position, float velocity) {
  Output out;
  out.kind = c.kind;
  if (run_ != c.run) {
    run_ = c.run;
    kind_ = c.kind;
    out.started = c.kind != ExcitationKind::off;
    start_ = position;
    point_ = turned_ = 0;
    time_ = phase_ = 0;
    negative_ = false;
  }
  // An end once reached stays, whatever kind and duration become.
  if (c.kind == ExcitationKind::off || kind_ != c.kind || time_ >= c.duration) time_ = over;
  if (time_ == over) {
    out.angle = c.angle + static_cast<control::TurnFraction>(turned_);
    out.finished = true;
    return out;
  }
  if (c.kind == ExcitationKind::position) {
    out.force = spring_force(c, position, velocity);
  } else {
    const float factor = time_ < c.ramp_ticks ? static_cast<float>(time_) * c.ramp_step : 1.0f;
    const float wave = square_wave(c);
    out.alternating = c.half_period != 0;
    out.along = factor * (c.across ? c.bias : c.bias + wave);
    out.across = c.across ? factor * wave : 0.0f;
    out.angle = c.angle + static_cast<control::TurnFraction>(turned_);
    out.electrical_speed = turn(c);
  }
  ++time_;
  return out;
}

inline float Excitation::square_wave(const Coefficients& c) {
  if (c.half_period == 0) return 0.0f;
  if (phase_ >= c.half_period) {
    negative_ = !negative_;
    phase_ = 0;
  }
  ++phase_;
  return negative_ ? -c.alternation : c.alternation;
}

/// Turns the vector for the next tick; rad/s at which it turns.
inline float Excitation::turn(const Coefficients& c) {
  const std::int64_t next = turned_ + c.angle_step;
  // A span that was made smaller leaves the vector where it is.
  if (c.angle_step > 0 && turned_ < c.angle_span) {
    turned_ = next > c.angle_span ? c.angle_span : next;
  } else if (c.angle_step < 0 && turned_ > -c.angle_span) {
    turned_ = next < -c.angle_span ? -c.angle_span : next;
  } else {
    return 0.0f;
  }
  return c.electrical_speed;
}

inline float Excitation::spring_force(const Coefficients& c, std::int64_t position, float velocity) {
  const std::int64_t moved = bounded(position - start_, farthest_counts);
  // The difference is exact; what is left of it in 2^-8 counts is far below what an encoder can tell.
  constexpr std::int64_t most = INT32_MAX;
  const std::int64_t stretch = bounded((point_ - (moved << 32)) >> 24, most);
  float speed = 0.0f;
  if (point_ < c.stroke) {
    point_ = c.stroke - point_ > c.point_step ? point_ + c.point_step : c.stroke;
    speed = c.speed;
  } else if (point_ > c.stroke) {
    point_ = point_ - c.stroke > c.point_step ? point_ - c.point_step : c.stroke;
    speed = -c.speed;
  }
  const float force =
      c.stiffness * static_cast<float>(static_cast<std::int32_t>(stretch)) + c.damping * (speed - velocity);
  return control::clamp_magnitude(force, c.force_limit);
}

}  // namespace kmax::firmware
