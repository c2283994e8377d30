#pragma once
// One axis of a simulated haptic device with, if wanted, a structure that bends and a person who holds it:
//
//   m x'' = F - b x' - f_c sgn(x') + k1 (y - x) + b1 (y' - x')
//   M y'' = k1 (x - y) + b1 (x' - y') + k2 (u - y) + b2 (u' - y')
//
// x handle, y hand, u intended position (intended_motion.hpp); k1, b1, k2, b2 already carry the activation g
// (operator_model.hpp). A structure puts one more mass, the tip, between handle and hand
// (device_model.hpp); x is then the motor's side. Friction is Coulomb's with true stick: at x' = 0 the
// handle stays while the other forces sum to no more than f_c. F is the commanded force, held between calls
// (zero-order hold), clipped at the force limit and late by the device's delay (force_delay.hpp). A part that
// is not named is no mass of the chain and costs nothing.
//
// Method. Within an interval everything is linear with constant coefficients between events, and the inputs
// are polynomials of time: the solution is a matrix times the state, and nothing is approximated but
// rounding. Intervals that are proven to hold no event, or one reversal, use matrices computed once
// (chain_propagator.hpp); all others the Taylor series, in which stops, reversals and break-aways are located
// (chain_motion.hpp). A general-purpose integrator with a fixed step misses these: in this problem
// semi-implicit Euler with 10 steps per sample reads K_max 0.6 N/mm wrong. set_integrator() puts one in this
// one's place, to compare (reference_integrators.hpp).
//
// Two things are constant over pieces of at most 2 ms instead of exact: the activation g (its value in the
// middle of the piece; its time constant is 200 times longer) and the rate at which the push target moves.
//
// A hand that lets go (IntendedMotionConfig::open_time) opens at the end of the interval in which its hold
// ends: the handle moves on alone, with no mass and no spring of the hand. The person goes back to the start
// meanwhile; when the time is over, or another trial begins, the hand closes round the handle where that is.
//
// Cost per call, -O2, one core of an AMD EPYC at 3.7 GHz, for 2 ms and for 50 us alike: device alone 5 ns
// sticking, 10 ns sliding; held 9 and 12 ns; held, structure and delay at 50 us 17 and 20 ns. A stiff
// structure divides an interval of 2 ms into several steps. In a wall that oscillates a call with a reversal
// costs about 60 ns. A background force changes the gain in every piece: then a call costs 130 to 220 ns (2
// ms) or 50 ns (50 us) without a table and 20 to 70 ns with one (share()).
// tests/benchmarks/simulation_benchmark.cpp measures it. No heap, but for matrices when a duration or gain is
// met again and a delay's memory as it fills.

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <variant>

#include "host_tools/simulation/chain_motion.hpp"
#include "host_tools/simulation/device_model.hpp"
#include "host_tools/simulation/force_delay.hpp"
#include "host_tools/simulation/integrator_config.hpp"
#include "host_tools/simulation/intended_motion.hpp"
#include "host_tools/simulation/operator_model.hpp"
#include "host_tools/simulation/propagator_table.hpp"

namespace kmax::simulation {

// Where the handle is at time 0, and how fast; a tip moves with it; the hand starts at the same place, at
// rest.
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

  // Takes matrices from a table that other handles of the same person with the same device use too, one after
  // the other, in one thread. From now on matrices are interpolated over the activation, or the activation is
  // rounded, as the table was made; propagator_table.hpp gives the errors. For who runs many trials with a
  // background force. Throws std::invalid_argument for a table of another person or device, std::logic_error
  // without a person.
  void share(std::shared_ptr<PropagatorTable> table);

  // Another method than the exact one, from now on. Throws std::invalid_argument.
  void set_integrator(const IntegratorConfig& integrator);
  const IntegratorConfig& integrator() const { return integrator_; }

  // Starts approach, hold and release now. Throws std::logic_error without a person.
  void begin_motion();

  // Holds `force` (N, along +x, before clipping) for `duration` (s, > 0 and <= 10). `background_force`:
  // magnitude in N of the background force commanded at the same time (its sign is ignored); it drives
  // activation, up to the person's limit, and push, and is not added to `force`. Throws std::invalid_argument
  // for a value that is not finite or a duration out of range.
  void advance(double force, double background_force, double duration);
  // So many times, to the last bit, and faster.
  void advance(double force, double background_force, double duration, std::uint32_t times);

  // N, from now on: a force on the same hand across this axis. It drives the activation together with the
  // background force, at right angles, and nobody presses against it along this axis.
  void resist_across(double force);

  // Holds the handle where it is, at once and against any force, or lets it go again; the person goes on.
  void block(bool blocked);
  bool blocked() const { return chain_.blocked; }

  double position() const { return chain_.state.position[0]; }  // m, the motor's side: what the encoder sees
  double velocity() const { return chain_.state.velocity[0]; }  // m/s; exactly 0 while sticking
  double tip_position() const { return chain_.state.position[tip_]; }  // m, where the person holds the device
  double tip_velocity() const { return chain_.state.velocity[tip_]; }  // m/s
  // m; without a person the start position. An open hand is where the handle is.
  double hand_position() const {
    if (!has_operator_) return motion_.position();
    return chain_.state.position[holding_ ? tip_ + 1 : tip_];
  }
  double hand_velocity() const {  // m/s
    return has_operator_ ? chain_.state.velocity[holding_ ? tip_ + 1 : tip_] : 0.0;
  }
  double intended_position() const { return has_operator_ ? motion_.position() : position(); }
  bool sticking() const { return chain_.sticking; }
  bool has_operator() const { return has_operator_; }
  // A person has let it go for now.
  bool let_go() const { return has_operator_ && !holding_; }
  // Throws std::logic_error without a person.
  const IntendedMotion& motion() const;

  double activation() const { return activation_; }  // a, N
  double gain() const { return gain_; }              // g of the last piece

  // Kinetic energy plus energy in the springs of structure, grip and arm, J.
  double energy() const;

  // Force on the handle at the end of the last interval, clipped and delayed, N.
  double applied_force() const { return applied_force_; }
  std::uint64_t samples() const { return samples_; }
  std::uint64_t clipped_samples() const { return clipped_samples_; }
  double clipped_share() const {
    return samples_ == 0 ? 0.0 : static_cast<double>(clipped_samples_) / static_cast<double>(samples_);
  }
  // How often the limit of 64 events was met. 0 in every known scene.
  std::uint64_t event_limit_hits() const { return chain_.event_limit_hits; }

 private:
  // What a piece's duration decides, kept for the last few durations.
  struct Pace {
    double duration = 0.0;
    double half_decay = 1.0;
    double decay = 1.0;
    double push_decay = 1.0;
  };
  using Motion = std::variant<ChainMotion<1>, ChainMotion<2>, ChainMotion<3>>;
  static constexpr std::size_t paces = ChainMotion<1>::durations;

  CoupledHandle(const DeviceModel& device, const OperatorModel* person, const IntendedMotionConfig& motion,
                const HandleStart& start);
  static Motion motion_of(const ChainDynamics& chain, std::size_t first_scaled);

  void advance_in_pieces(double force, double background, double duration);
  void advance_piece(double force, double background, double duration);
  template <std::size_t masses>
  void advance_piece_of(ChainMotion<masses>& motion, double force, double background, double duration);
  template <std::size_t masses>
  void advance_round_corners(ChainMotion<masses>& motion, double force, double duration);
  void respond_to(double background);
  double driver_of(double background) const;
  std::size_t pace_for(double duration);
  void open_or_close_hand(double passed);
  void become(bool holding);
  void move_by_reference(const ChainInput& input, double duration);

  DeviceModel device_;
  OperatorModel person_;
  IntendedMotion motion_;
  ForceDelay delay_;
  IntegratorConfig integrator_;
  bool has_operator_ = false;
  bool holding_ = false;    // it, with a closed hand
  bool lets_go_ = false;    // after a hold
  bool in_hold_ = false;    // at the end of the last interval; only of a person who lets go
  double open_left_ = 0.0;  // s
  bool exact_ = true;
  double force_limit_ = 0.0;  // N; infinity: none
  std::size_t tip_ = 0;       // number of the mass that the person holds
  double series_stiffness_ = 0.0;

  MovingChain chain_;
  double activation_ = 0.0;
  double push_ = 0.0;    // lagged background force, N
  double across_ = 0.0;  // N
  double gain_ = 1.0;
  double target_ = 0.0;  // of the intended motion
  double settled_background_ =
      -1.0;  // the background force at which activation and push have arrived, if there is one

  std::array<Pace, paces> paces_;
  std::size_t pace_ = 0;
  std::size_t next_pace_ = 0;
  Motion chain_motion_;
  std::shared_ptr<PropagatorTable> table_;
  GainGrid grid_;
  bool rounds_ = false;  // the gain, to the grid

  double applied_force_ = 0.0;
  std::uint64_t samples_ = 0;
  std::uint64_t clipped_samples_ = 0;
};

}  // namespace kmax::simulation
