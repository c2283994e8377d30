#pragma once
// One axis of a simulated haptic device with, if wanted, a person holding it:
//
//   m x'' = F - b x' - f_c sgn(x') + k1 (y - x) + b1 (y' - x')
//   M y'' = k1 (x - y) + b1 (x' - y') + k2 (u - y) + b2 (u' - y')
//
// x handle, y hand, u intended position (intended_motion.hpp); k1, b1, k2, b2 already carry the activation g
// (operator_model.hpp). Friction is Coulomb's with true stick: at x' = 0 the handle stays while the other
// forces sum to no more than f_c. F is the commanded force, held between calls (zero-order hold) and clipped
// at the force limit.
//
// Method: within an interval everything is linear with constant coefficients between events, and the inputs
// are polynomials of time, so the solution is its Taylor series: with s' = A s + f, c[n+1] = h (A c[n] +
// f[n]) / (n + 1) over a step h. The order is chosen from ||A|| h so that the truncated rest is below 1e-13
// of the state, and h is divided so that ||A|| h stays below 1.25: nothing is approximated but rounding. The
// series also is x'(t), and the net force on a stuck handle as a polynomial, so stops, reversals and
// break-aways are located inside the interval (first_crossing.hpp) and the rest of it continues from there. A
// general-purpose integrator with a fixed step misses these: in this problem semi-implicit Euler with 10
// steps per sample reads K_max 0.6 N/mm wrong.
//
// Two things are constant over pieces of at most 2 ms instead of exact: the activation g (its value in the
// middle of the piece; its time constant is 200 times longer) and the rate at which the push target moves.
//
// Events. Every event happens at x' = 0. Break-away needs a net force of f_c plus 1e-13 of the forces
// involved, so it always has a direction and coinciding events resolve one after the other. After 64 events
// in one step of the series the handle is held for the rest of that step (at most 2 ms); that can only remove
// energy, and is counted.
//
// Cost per call, -O2, one core of an AMD EPYC: held 45 ns (sticking) to 110 ns (oscillating in a wall) for 2
// ms, 35 to 45 ns for 50 us; alone 8 ns (sticking) or 33 ns. tests/benchmarks/simulation_benchmark.cpp
// measures it. No heap.

#include <array>
#include <cstdint>
#include <optional>

#include "host_tools/simulation/device_model.hpp"
#include "host_tools/simulation/intended_motion.hpp"
#include "host_tools/simulation/operator_model.hpp"

namespace kmax::simulation {

// Where the handle is at time 0, and how fast; the hand starts at the same place, at rest.
struct HandleStart {
  double position = 0.0;  // m
  double velocity = 0.0;  // m/s
};

class CoupledHandle {
 public:
  // The device alone: nobody holds it, nothing of the hand is integrated. Throws std::invalid_argument.
  explicit CoupledHandle(const DeviceModel& device, const HandleStart& start = {});

  // With a person who intends to stay at the start position until begin_motion(). Throws
  // std::invalid_argument.
  CoupledHandle(const DeviceModel& device, const OperatorModel& person, const IntendedMotionConfig& motion);
  CoupledHandle(const DeviceModel& device, const OperatorModel& person, const IntendedMotionConfig& motion,
                const HandleStart& start);

  // Starts approach, hold and release now. Throws std::logic_error without a person.
  void begin_motion();

  // Holds `force` (N, along +x, before clipping) for `duration` (s, > 0 and <= 10). `background_force`:
  // magnitude in N of the field commanded at the same time (its sign is ignored); it drives activation and
  // push, and is not added to `force`. Throws std::invalid_argument for a value that is not finite or a
  // duration out of range.
  void advance(double force, double background_force, double duration);

  // Holds the handle where it is, at once and against any force, or lets it go again; the person goes on.
  void block(bool blocked);
  bool blocked() const { return blocked_; }

  double position() const { return x_; }       // m
  double velocity() const { return v_; }       // m/s; exactly 0 while sticking
  double hand_position() const { return y_; }  // m; without a person the start position
  double hand_velocity() const { return w_; }  // m/s
  double intended_position() const { return has_operator_ ? motion_.position() : x_; }
  bool sticking() const { return sticking_; }
  bool has_operator() const { return has_operator_; }
  // Throws std::logic_error without a person.
  const IntendedMotion& motion() const;

  double activation() const { return activation_; }  // a, N
  double gain() const { return gain_; }              // g of the last piece

  // Kinetic energy plus energy in the springs of grip and arm, J.
  double energy() const;

  // Force on the handle in the last interval, after clipping, N.
  double applied_force() const { return applied_force_; }
  std::uint64_t samples() const { return samples_; }
  std::uint64_t clipped_samples() const { return clipped_samples_; }
  double clipped_share() const {
    return samples_ == 0 ? 0.0 : static_cast<double>(clipped_samples_) / static_cast<double>(samples_);
  }
  // How often the limit of 64 events was met. 0 in every known scene.
  std::uint64_t event_limit_hits() const { return event_limit_hits_; }

 private:
  static constexpr int max_order = 22;
  using Series = std::array<double, max_order + 1>;
  struct State {
    double x;
    double v;
    double y;
    double w;
  };

  void set_piece(double piece);
  void set_gain(double gain);
  void propagate(double duration, double force, double intended, double intended_rate);
  void step(double step, double force, double intended, double intended_rate);
  bool leaves_stick(double force);
  void expand_alone(double h, int order, double force);
  void expand_sliding(double h, int order, double force, double intended, double rate);
  void expand_stuck(double h, int order, double intended, double rate);
  double stop_time(int order) const;
  double break_away_time(int order, double force);
  double stick_limit(double force) const;
  double grip_force() const { return k1_ * (y_ - x_) + b1_ * (w_ - v_); }

  DeviceModel device_;
  OperatorModel person_;
  IntendedMotion motion_;
  bool has_operator_ = false;
  bool blocked_ = false;

  double x_ = 0.0;
  double v_ = 0.0;
  double y_ = 0.0;
  double w_ = 0.0;
  bool sticking_ = false;
  double direction_ = 1.0;

  double activation_ = 0.0;
  double push_ = 0.0;  // lagged background force, N
  double gain_ = 1.0;
  double k1_ = 0.0;
  double b1_ = 0.0;
  double k2_ = 0.0;
  double b2_ = 0.0;
  double sliding_rate_ = 0.0;  // bounds on ||A||, 1/s: sliding, and of the hand alone while the handle sticks
  double stuck_rate_ = 0.0;

  double per_mass_ = 0.0;
  double per_hand_mass_ = 0.0;
  double stiffness_rate_ = 0.0;  // the parts of those bounds at g = 1
  double damping_rate_ = 0.0;
  double stuck_stiffness_rate_ = 0.0;
  double stuck_damping_rate_ = 0.0;
  double series_stiffness_ = 0.0;

  double piece_ = 0.0;  // the piece length that the three decay factors below belong to
  double half_decay_ = 1.0;
  double decay_ = 1.0;
  double push_decay_ = 1.0;

  double applied_force_ = 0.0;
  std::uint64_t samples_ = 0;
  std::uint64_t clipped_samples_ = 0;
  std::uint64_t event_limit_hits_ = 0;

  Series cx_{};
  Series cv_{};
  Series cy_{};
  Series cw_{};
  State end_{};  // the series summed at the end of the step
};

}  // namespace kmax::simulation
