#include "host_tools/simulation/coupled_handle.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <utility>

#include "host_tools/simulation/propagator_table.hpp"
#include "host_tools/simulation/reference_integrators.hpp"

namespace kmax::simulation {
namespace {

constexpr double longest_piece = 0.002;  // s, over which the activation is constant

IntendedMotionConfig standing_at(double position) {
  IntendedMotionConfig motion;
  motion.start_position = position;
  motion.wall_position = position;
  return motion;
}

void require_start(const HandleStart& start) {
  if (!(std::abs(start.position) <= 10.0) || !(std::abs(start.velocity) <= 100.0)) {
    throw std::invalid_argument(
        fmt::format("handle start at {} m with {} m/s: allowed is -10 to 10 m, -100 to 100 m/s",
                    start.position, start.velocity));
  }
}

[[noreturn]] void refuse(double force, double background_force, double duration) {
  throw std::invalid_argument(fmt::format(
      "advance(force = {} N, background force = {} N, duration = {} s): forces must be finite (background at "
      "most 1e6 N), the duration in (0, 10] s",
      force, background_force, duration));
}

ChainDynamics checked_chain(const DeviceModel& device, const OperatorModel* person,
                            const HandleStart& start) {
  validate(device);
  if (person != nullptr) validate(*person);
  require_start(start);
  return held_chain(device, person, 1.0);
}

}  // namespace

CoupledHandle::Motion CoupledHandle::motion_of(const ChainDynamics& chain, std::size_t first_scaled) {
  if (chain.masses == 1) return ChainMotion<1>(chain, first_scaled);
  if (chain.masses == 2) return ChainMotion<2>(chain, first_scaled);
  return ChainMotion<3>(chain, first_scaled);
}

CoupledHandle::CoupledHandle(const DeviceModel& device, const OperatorModel* person,
                             const IntendedMotionConfig& motion, const HandleStart& start)
    : device_(device),
      person_(person != nullptr ? *person : OperatorModel{}),
      motion_(motion),
      delay_(device.delay),
      has_operator_(person != nullptr),
      holding_(person != nullptr),
      lets_go_(person != nullptr && motion.open_time > 0.0),
      tip_(device.structure ? 1 : 0),
      chain_motion_(motion_of(checked_chain(device, person, start), tip_)) {
  force_limit_ = device.force_limit > 0.0 ? device.force_limit : std::numeric_limits<double>::infinity();
  if (has_operator_) series_stiffness_ = series_stiffness(person_);
  chain_.state.position.fill(start.position);
  for (std::size_t i = 0; i <= tip_; ++i) chain_.state.velocity[i] = start.velocity;
}

CoupledHandle::CoupledHandle(const DeviceModel& device, const HandleStart& start)
    : CoupledHandle(device, nullptr, (require_start(start), standing_at(start.position)), start) {}

CoupledHandle::CoupledHandle(const DeviceModel& device, const OperatorModel& person,
                             const IntendedMotionConfig& motion)
    : CoupledHandle(device, &person, motion, HandleStart{motion.start_position, 0.0}) {}

CoupledHandle::CoupledHandle(const DeviceModel& device, const OperatorModel& person,
                             const IntendedMotionConfig& motion, const HandleStart& start)
    : CoupledHandle(device, &person, motion, start) {}

void CoupledHandle::share(std::shared_ptr<PropagatorTable> table) {
  if (!has_operator_)
    throw std::logic_error("share: without an operator there is no activation to have a table of");
  if (table == nullptr || !table->fits(device_, person_))
    throw std::invalid_argument("share: the table was made for another operator or device");
  rounds_ = table->rounds();
  grid_ = table->grid();
  table_ = std::move(table);
  settled_background_ = -1.0;
  std::visit([this](auto& motion) { motion.share(table_.get()); }, chain_motion_);
}

void CoupledHandle::set_integrator(const IntegratorConfig& integrator) {
  validate(integrator);
  integrator_ = integrator;
  exact_ = integrator.kind == IntegratorKind::exact;
}

void CoupledHandle::resist_across(double force) {
  if (force == across_) return;
  if (!(std::abs(force) <= 1e6))
    throw std::invalid_argument(fmt::format("resist_across({} N): allowed is -1e6 to 1e6 N", force));
  across_ = force;
  settled_background_ = -1.0;
}

void CoupledHandle::begin_motion() {
  if (!has_operator_)
    throw std::logic_error("begin_motion: this scene has no operator who could move the handle");
  if (!holding_) become(true);
  in_hold_ = false;
  motion_.begin();
}

// The chain without the hand, or with it again.
void CoupledHandle::become(bool holding) {
  holding_ = holding;
  if (holding) {
    chain_.state.position[tip_ + 1] = chain_.state.position[tip_];
    chain_.state.velocity[tip_ + 1] = chain_.state.velocity[tip_];
    settled_background_ = -1.0;
  }
  chain_motion_ = motion_of(held_chain(device_, holding ? &person_ : nullptr, 1.0), tip_);
  if (holding && table_) std::visit([this](auto& motion) { motion.share(table_.get()); }, chain_motion_);
  paces_.fill({});
  pace_ = next_pace_ = 0;
}

[[gnu::noinline]] void CoupledHandle::open_or_close_hand(double passed) {
  if (!holding_) {
    motion_.advance(passed, target_);
    open_left_ -= passed;
    if (open_left_ <= 0.0) become(true);
    return;
  }
  if (in_hold_ && motion_.phase() != MotionPhase::hold) {
    open_left_ = motion_.config().open_time;
    become(false);
  }
  in_hold_ = holding_ && motion_.phase() == MotionPhase::hold;
}

const IntendedMotion& CoupledHandle::motion() const {
  if (!has_operator_) throw std::logic_error("motion: this scene has no operator");
  return motion_;
}

double CoupledHandle::energy() const {
  const ChainDynamics chain = held_chain(device_, holding_ ? &person_ : nullptr, gain_);
  double twice = 0.0;
  for (std::size_t i = 0; i < chain.masses; ++i) {
    const double next = i + 1 < chain.masses ? chain_.state.position[i + 1] : motion_.position();
    const double stretch = next - chain_.state.position[i];
    twice += chain.mass[i] * chain_.state.velocity[i] * chain_.state.velocity[i] +
             chain.stiffness[i] * stretch * stretch;
  }
  return 0.5 * twice;
}

void CoupledHandle::block(bool blocked) {
  chain_.blocked = blocked;
  if (!blocked) return;
  chain_.state.velocity[0] = 0.0;
  chain_.sticking = true;
}

std::size_t CoupledHandle::pace_for(double duration) {
  for (std::size_t n = 0; n < paces; ++n) {
    if (paces_[n].duration == duration) return n;
  }
  const std::size_t slot = next_pace_;
  next_pace_ = (next_pace_ + 1) % paces;
  Pace& pace = paces_[slot];
  pace.duration = duration;
  if (holding_) {
    pace.half_decay = std::exp(-0.5 * duration / person_.activation_time);
    pace.decay = std::exp(-duration / person_.activation_time);
    pace.push_decay = std::exp(-duration / person_.push_lag);
  }
  std::visit([slot](auto& motion) { motion.forget(slot); }, chain_motion_);
  return slot;
}

void CoupledHandle::advance(double force, double background_force, double duration) {
  const double background = std::abs(background_force);
  if (!(std::abs(force) <= std::numeric_limits<double>::max() && background <= 1e6 && duration > 0.0 &&
        duration <= 10.0)) [[unlikely]]
    refuse(force, background_force, duration);
  double clipped = force < force_limit_ ? force : force_limit_;
  clipped = clipped > -force_limit_ ? clipped : -force_limit_;
  ++samples_;
  clipped_samples_ += clipped != force ? 1 : 0;
  if (device_.delay == 0.0 && duration <= longest_piece) [[likely]] {
    applied_force_ = clipped;
    advance_piece(clipped, background, duration);
  } else if (device_.delay == 0.0) {
    advance_in_pieces(clipped, background, duration);
  } else {
    delay_.command(clipped, duration);
    for (double left = duration; left > 0.0;) {
      const double piece = delay_.piece(left);
      advance_in_pieces(delay_.force(), background, piece);
      delay_.pass(piece);
      left = piece == left ? 0.0 : left - piece;
    }
  }
  if (lets_go_) [[unlikely]]
    open_or_close_hand(duration);
}

void CoupledHandle::advance(double force, double background_force, double duration, std::uint32_t times) {
  if (times == 0) return;
  // What is asked of the arguments, and whatever takes more than one piece or may change the chain.
  advance(force, background_force, duration);
  if (device_.delay != 0.0 || duration > longest_piece || lets_go_) {
    for (std::uint32_t n = 1; n < times; ++n) advance(force, background_force, duration);
    return;
  }
  const bool clipped = applied_force_ != force;
  samples_ += times - 1;
  clipped_samples_ += clipped ? times - 1 : 0;
  const double background = std::abs(background_force);
  std::visit(
      [&](auto& motion) {
        for (std::uint32_t n = 1; n < times; ++n)
          advance_piece_of(motion, applied_force_, background, duration);
      },
      chain_motion_);
}

void CoupledHandle::advance_in_pieces(double force, double background, double duration) {
  applied_force_ = force;
  const int pieces = duration <= longest_piece || !holding_
                         ? 1
                         : static_cast<int>(std::ceil(duration / longest_piece - 1e-9));
  const double piece = duration / pieces;
  for (int n = 0; n < pieces; ++n) advance_piece(force, background, piece);
}

[[gnu::always_inline]] inline void CoupledHandle::advance_piece(double force, double background,
                                                                double duration) {
  switch (chain_motion_.index()) {
    case 0:
      return advance_piece_of(*std::get_if<0>(&chain_motion_), force, background, duration);
    case 1:
      return advance_piece_of(*std::get_if<1>(&chain_motion_), force, background, duration);
    default:
      return advance_piece_of(*std::get_if<2>(&chain_motion_), force, background, duration);
  }
}

template <std::size_t masses>
[[gnu::always_inline]] inline void CoupledHandle::advance_piece_of(ChainMotion<masses>& motion, double force,
                                                                   double background, double duration) {
  if (paces_[pace_].duration != duration) [[unlikely]]
    pace_ = pace_for(duration);
  IntendedMotion::Segment whole{duration, 0.0, 0.0};
  if (holding_) {
    if (background != settled_background_) {
      respond_to(background);
      if (rounds_) {
        const double driver = driver_of(background);
        const double excess = (activation_ - driver) * paces_[pace_].half_decay;
        motion.expect(grid_.nearest(1.0 + person_.activation_gain * (driver + excess)), pace_);
      }
    }
    if (!motion_.advance_without_corner(duration, target_, whole)) [[unlikely]]
      return advance_round_corners(motion, force, duration);
  }
  if (exact_) [[likely]] {
    motion.move(chain_, force, whole.start, whole.rate, duration, gain_, pace_);
  } else {
    move_by_reference({force, whole.start, whole.rate}, duration);
  }
}

template <std::size_t masses>
[[gnu::noinline]] void CoupledHandle::advance_round_corners(ChainMotion<masses>& motion, double force,
                                                            double duration) {
  const IntendedMotion::Path path = motion_.advance(duration, target_);
  for (int n = 0; n < path.count; ++n) {
    const IntendedMotion::Segment& straight = path.segments[static_cast<std::size_t>(n)];
    const ChainInput input{force, straight.start, straight.rate};
    if (!exact_) {
      move_by_reference(input, straight.duration);
    } else if (path.count == 1) {
      motion.move(chain_, force, straight.start, straight.rate, duration, gain_, pace_);
    } else {
      motion.move_by_series(chain_, input, straight.duration, gain_);
    }
  }
}

// What the activation goes to.
[[gnu::always_inline]] inline double CoupledHandle::driver_of(double background) const {
  const double resisted = across_ == 0.0 ? background : std::hypot(background, across_);
  return std::min(resisted, person_.activation_limit);
}

// Activation, push and the target that follows from them, over a piece of the present pace.
[[gnu::always_inline]] inline void CoupledHandle::respond_to(double background) {
  const Pace& pace = paces_[pace_];
  const double driver = driver_of(background);
  const double excess = activation_ - driver;
  const double gain = 1.0 + person_.activation_gain * (driver + excess * pace.half_decay);
  gain_ = rounds_ ? grid_.nearest(gain) : gain;
  activation_ = driver + excess * pace.decay;
  push_ = background + (push_ - background) * pace.push_decay;
  const double stiffness = series_stiffness_ * (1.0 + person_.activation_gain * activation_);
  target_ = motion_.target_for(motion_.config().push_force + push_, stiffness);
  // Twice at rest: the target moves within the piece in which they arrive.
  settled_background_ = excess == 0.0 && activation_ == driver && push_ == background ? background : -1.0;
}

void CoupledHandle::move_by_reference(const ChainInput& input, double duration) {
  ChainDynamics chain = held_chain(device_, holding_ ? &person_ : nullptr, gain_);
  if (chain_.blocked) chain.friction = 1e300;
  const double step = longest_piece / integrator_.substeps;
  switch (integrator_.kind) {
    case IntegratorKind::semi_implicit_euler:
      integrate_semi_implicit_euler(chain, chain_.state, input, duration, step);
      break;
    case IntegratorKind::rk4:
      integrate_rk4(chain, chain_.state, input, duration, step);
      break;
    case IntegratorKind::adaptive:
    case IntegratorKind::exact:
      integrate_adaptive(chain, chain_.state, input, duration, integrator_.tolerance);
      break;
  }
  chain_.sticking = chain.friction > 0.0 && chain_.state.velocity[0] == 0.0;
}

}  // namespace kmax::simulation
