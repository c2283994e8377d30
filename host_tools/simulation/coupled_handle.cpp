#include "host_tools/simulation/coupled_handle.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>

#include "host_tools/simulation/first_crossing.hpp"

namespace kmax::simulation {
namespace {

constexpr double longest_piece = 0.002;  // s, over which the activation is constant
constexpr double largest_step = 1.25;    // ||A|| h
constexpr int max_events = 64;

// Taylor order for ||A|| h <= (index + 1) / 64. Terms beyond order N of the homogeneous solution sum to less
// than 2 z^(N+1)/(N+1)! for z <= 1.25; the input terms, constant and linear in time, need two orders more.
constexpr int order_bins = 80;
constexpr std::array<int, order_bins> series_orders = [] {
  std::array<int, order_bins> orders{};
  for (int bin = 0; bin < order_bins; ++bin) {
    const double z = (bin + 1) / 64.0;
    double term = z;
    int order = 1;
    while (2.0 * term * z / (order + 1) > 1e-13) term *= z / ++order;
    orders[static_cast<std::size_t>(bin)] = order + 2;
  }
  return orders;
}();
static_assert(series_orders[order_bins - 1] <= 20);

constexpr std::array<double, 24> reciprocals = [] {
  std::array<double, 24> values{};
  for (std::size_t n = 1; n < values.size(); ++n) values[n] = 1.0 / static_cast<double>(n);
  return values;
}();

int series_order(double z) {
  return series_orders[static_cast<std::size_t>(std::min(order_bins - 1, static_cast<int>(z * 64.0)))];
}

double sum_of_magnitudes(const double* c, int order) {
  double sum = 0.0;
  for (int n = 1; n <= order; ++n) sum += std::abs(c[n]);
  return sum;
}

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

}  // namespace

CoupledHandle::CoupledHandle(const DeviceModel& device, const HandleStart& start)
    : device_(device), motion_((require_start(start), standing_at(start.position))) {
  validate(device);
  x_ = y_ = start.position;
  v_ = start.velocity;
  per_mass_ = 1.0 / device.mass;
  sliding_rate_ = device.damping * per_mass_;
}

CoupledHandle::CoupledHandle(const DeviceModel& device, const OperatorModel& person,
                             const IntendedMotionConfig& motion)
    : CoupledHandle(device, person, motion, HandleStart{motion.start_position, 0.0}) {}

CoupledHandle::CoupledHandle(const DeviceModel& device, const OperatorModel& person,
                             const IntendedMotionConfig& motion, const HandleStart& start)
    : device_(device), person_(person), motion_(motion), has_operator_(true) {
  validate(device);
  validate(person);
  require_start(start);
  x_ = y_ = start.position;
  v_ = start.velocity;
  per_mass_ = 1.0 / device.mass;
  per_hand_mass_ = 1.0 / person.hand_mass;
  series_stiffness_ = series_stiffness(person);
  // In the coordinates (W x, v, W y, w) the largest row sum of |A| is at most W + the damping rate below.
  stiffness_rate_ =
      std::sqrt(std::max(2.0 * person.grip_stiffness / device.mass,
                         (2.0 * person.grip_stiffness + person.arm_stiffness) / person.hand_mass));
  damping_rate_ = std::max(2.0 * person.grip_damping / device.mass,
                           (2.0 * person.grip_damping + person.arm_damping) / person.hand_mass);
  stuck_stiffness_rate_ = std::sqrt((person.grip_stiffness + person.arm_stiffness) / person.hand_mass);
  stuck_damping_rate_ = (person.grip_damping + person.arm_damping) / person.hand_mass;
  set_gain(1.0);
}

void CoupledHandle::begin_motion() {
  if (!has_operator_)
    throw std::logic_error("begin_motion: this scene has no operator who could move the handle");
  motion_.begin();
}

const IntendedMotion& CoupledHandle::motion() const {
  if (!has_operator_) throw std::logic_error("motion: this scene has no operator");
  return motion_;
}

double CoupledHandle::energy() const {
  const double device = 0.5 * device_.mass * v_ * v_;
  if (!has_operator_) return device;
  const double grip = y_ - x_;
  const double arm = motion_.position() - y_;
  return device + 0.5 * (person_.hand_mass * w_ * w_ + k1_ * grip * grip + k2_ * arm * arm);
}

void CoupledHandle::set_gain(double gain) {
  gain_ = gain;
  k1_ = person_.grip_stiffness * gain;
  b1_ = person_.grip_damping * gain;
  k2_ = person_.arm_stiffness * gain;
  b2_ = person_.arm_damping * gain;
  // sqrt(g) <= (1 + g) / 2
  sliding_rate_ = stiffness_rate_ * 0.5 * (1.0 + gain) + damping_rate_ * gain + device_.damping * per_mass_;
  stuck_rate_ = stuck_stiffness_rate_ * 0.5 * (1.0 + gain) + stuck_damping_rate_ * gain;
}

void CoupledHandle::set_piece(double piece) {
  piece_ = piece;
  half_decay_ = std::exp(-0.5 * piece / person_.activation_time);
  decay_ = std::exp(-piece / person_.activation_time);
  push_decay_ = std::exp(-piece / person_.push_lag);
}

void CoupledHandle::advance(double force, double background_force, double duration) {
  if (!std::isfinite(force) || !(std::abs(background_force) <= 1e6) ||
      !(duration > 0.0 && duration <= 10.0)) {
    throw std::invalid_argument(fmt::format(
        "advance(force = {} N, background force = {} N, duration = {} s): forces must be finite (background "
        "at most 1e6 N), the duration in (0, 10] s",
        force, background_force, duration));
  }
  const double limit = device_.force_limit;
  applied_force_ = limit > 0.0 ? std::clamp(force, -limit, limit) : force;
  ++samples_;
  if (applied_force_ != force) ++clipped_samples_;

  if (!has_operator_) {
    propagate(duration, applied_force_, 0.0, 0.0);
    return;
  }
  const double background = std::abs(background_force);
  const int pieces =
      duration <= longest_piece ? 1 : static_cast<int>(std::ceil(duration / longest_piece - 1e-9));
  const double piece = duration / pieces;
  if (piece != piece_) set_piece(piece);
  for (int n = 0; n < pieces; ++n) {
    set_gain(1.0 + person_.activation_gain * (background + (activation_ - background) * half_decay_));
    activation_ = background + (activation_ - background) * decay_;
    push_ = background + (push_ - background) * push_decay_;
    const double stiffness = series_stiffness_ * (1.0 + person_.activation_gain * activation_);
    const IntendedMotion::Path path =
        motion_.advance(piece, motion_.target_for(motion_.config().push_force + push_, stiffness));
    for (int segment = 0; segment < path.count; ++segment) {
      const IntendedMotion::Segment& straight = path.segments[static_cast<std::size_t>(segment)];
      propagate(straight.duration, applied_force_, straight.start, straight.rate);
    }
  }
}

void CoupledHandle::propagate(double duration, double force, double intended, double intended_rate) {
  const double z = std::max(sliding_rate_, stuck_rate_) * duration;
  if (z <= largest_step) {
    step(duration, force, intended, intended_rate);
    return;
  }
  const int steps = static_cast<int>(std::ceil(z / largest_step));
  const double h = duration / steps;
  for (int n = 0; n < steps; ++n) step(h, force, intended + intended_rate * (h * n), intended_rate);
}

void CoupledHandle::step(double duration, double force, double intended, double intended_rate) {
  double left = duration;
  int events = 0;
  bool breaking_away = false;
  while (left > 0.0) {
    if (v_ == 0.0 && events >= max_events) {
      sticking_ = true;
      ++event_limit_hits_;
    } else if (v_ == 0.0 && !breaking_away) {
      sticking_ = !leaves_stick(force);
    }
    double end = no_crossing;
    int order = 0;
    if (sticking_) {
      if (!has_operator_) return;  // constant force: nothing can change within the interval
      order = series_order(stuck_rate_ * left);
      expand_stuck(left, order, intended, intended_rate);
      if (events < max_events) end = break_away_time(order, force);
    } else {
      if (v_ != 0.0) direction_ = std::copysign(1.0, v_);
      order = series_order(sliding_rate_ * left);
      if (has_operator_) {
        expand_sliding(left, order, force, intended, intended_rate);
      } else {
        expand_alone(left, order, force);
      }
      if (device_.friction > 0.0) end = stop_time(order);
    }

    if (end == no_crossing) {
      x_ = end_.x;
      v_ = end_.v;
      y_ = end_.y;
      w_ = end_.w;
      return;
    }
    if (!sticking_) x_ = polynomial_at(cx_.data(), order, end);
    v_ = 0.0;
    if (has_operator_) {
      y_ = polynomial_at(cy_.data(), order, end);
      w_ = polynomial_at(cw_.data(), order, end);
    }
    ++events;
    // After a break-away the next round must slide even if rounding puts the net force just below the limit.
    breaking_away = sticking_;
    sticking_ = false;
    intended += intended_rate * (left * end);
    left -= left * end;
  }
}

void CoupledHandle::block(bool blocked) {
  blocked_ = blocked;
  if (!blocked) return;
  v_ = 0.0;
  sticking_ = true;
}

double CoupledHandle::stick_limit(double force) const {
  if (blocked_) return std::numeric_limits<double>::infinity();
  return device_.friction + 1e-13 * (device_.friction + std::abs(force) +
                                     k1_ * (std::abs(x_) + std::abs(y_)) + b1_ * std::abs(w_));
}

bool CoupledHandle::leaves_stick(double force) {
  if (device_.friction == 0.0 && !blocked_) return true;
  const double net = force + grip_force();
  direction_ = std::copysign(1.0, net);
  return std::abs(net) > stick_limit(force);
}

void CoupledHandle::expand_alone(double h, int order, double force) {
  double push = (force - direction_ * device_.friction) * per_mass_;
  const double damping = device_.damping * per_mass_;
  cx_[0] = x_;
  double v = cv_[0] = v_;
  State end{x_, v_, y_, w_};
  for (std::size_t n = 0; n < static_cast<std::size_t>(order); ++n) {
    const double factor = h * reciprocals[n + 1];
    end.x += cx_[n + 1] = factor * v;
    v = factor * (push - damping * v);
    end.v += cv_[n + 1] = v;
    push = 0.0;
  }
  end_ = end;
}

// In both loops the factor h/(n + 1) is multiplied into the coefficients first, and the inputs (constant and
// linear in time, so they enter the first two terms only) stay out of the rest: the chain of dependent
// operations is the cost.
void CoupledHandle::expand_sliding(double h, int order, double force, double intended, double rate) {
  const double k1_m = k1_ * per_mass_;
  const double b1_m = b1_ * per_mass_;
  const double vv = (device_.damping + b1_) * per_mass_;
  const double k1_h = k1_ * per_hand_mass_;
  const double b1_h = b1_ * per_hand_mass_;
  const double yy = (k1_ + k2_) * per_hand_mass_;
  const double ww = (b1_ + b2_) * per_hand_mass_;
  double x = cx_[0] = x_;
  double v = cv_[0] = v_;
  double y = cy_[0] = y_;
  double w = cw_[0] = w_;
  State end{x, v, y, w};
  const auto term = [&](std::size_t n, auto... inputs) {
    const double f = h * reciprocals[n + 1];
    const double next_x = f * v;
    const double next_y = f * w;
    double next_v = (f * k1_m) * (y - x) + ((f * b1_m) * w - (f * vv) * v);
    double next_w = ((f * k1_h) * x - (f * yy) * y) + ((f * b1_h) * v - (f * ww) * w);
    if constexpr (sizeof...(inputs) == 2) {
      const std::array<double, 2> input{inputs...};
      next_v += f * input[0];
      next_w += f * input[1];
    }
    end.x += cx_[n + 1] = x = next_x;
    end.v += cv_[n + 1] = v = next_v;
    end.y += cy_[n + 1] = y = next_y;
    end.w += cw_[n + 1] = w = next_w;
  };
  term(0, (force - direction_ * device_.friction) * per_mass_,
       (k2_ * intended + b2_ * rate) * per_hand_mass_);
  term(1, 0.0, k2_ * per_hand_mass_ * rate * h);
  for (std::size_t n = 2; n < static_cast<std::size_t>(order); ++n) term(n);
  end_ = end;
}

void CoupledHandle::expand_stuck(double h, int order, double intended, double rate) {
  const double yy = (k1_ + k2_) * per_hand_mass_;
  const double ww = (b1_ + b2_) * per_hand_mass_;
  double y = cy_[0] = y_;
  double w = cw_[0] = w_;
  State end{x_, 0.0, y, w};
  const auto term = [&](std::size_t n, auto... input) {
    const double f = h * reciprocals[n + 1];
    const double next_y = f * w;
    double next_w = -(f * yy) * y - (f * ww) * w;
    ((next_w += f * input), ...);
    end.y += cy_[n + 1] = y = next_y;
    end.w += cw_[n + 1] = w = next_w;
  };
  term(0, (k1_ * x_ + k2_ * intended + b2_ * rate) * per_hand_mass_);
  term(1, k2_ * per_hand_mass_ * rate * h);
  for (std::size_t n = 2; n < static_cast<std::size_t>(order); ++n) term(n);
  end_ = end;
}

// Where x' reaches zero, as a part of the step.
double CoupledHandle::stop_time(int order) const {
  if (std::abs(cv_[0]) > sum_of_magnitudes(cv_.data(), order)) return no_crossing;
  Series forward;
  for (std::size_t n = 0; n <= static_cast<std::size_t>(order); ++n) forward[n] = direction_ * cv_[n];
  if (forward[0] > 0.0) return first_crossing(forward.data(), order);
  // Starting from rest: the zero at t = 0 is the start itself, so it is divided out. The first coefficient is
  // positive, because break-away needs a little more than the friction force (stick_limit).
  return first_crossing(forward.data() + 1, order - 1);
}

// Where the net force on a stuck handle reaches the friction force, as a part of the step; sets the
// direction.
double CoupledHandle::break_away_time(int order, double force) {
  const double limit = stick_limit(force);
  const double net = force + grip_force();
  const double variation =
      k1_ * sum_of_magnitudes(cy_.data(), order) + b1_ * sum_of_magnitudes(cw_.data(), order);
  if (std::abs(net) + variation < limit) return no_crossing;
  Series margin;
  for (std::size_t n = 1; n <= static_cast<std::size_t>(order); ++n)
    margin[n] = -(k1_ * cy_[n] + b1_ * cw_[n]);
  margin[0] = std::max(0.0, limit - net);
  const double upwards = first_crossing(margin.data(), order);
  for (std::size_t n = 1; n <= static_cast<std::size_t>(order); ++n) margin[n] = -margin[n];
  margin[0] = std::max(0.0, limit + net);
  const double downwards = first_crossing(margin.data(), order);
  if (upwards == no_crossing && downwards == no_crossing) return no_crossing;
  direction_ = upwards <= downwards ? 1.0 : -1.0;
  return std::min(upwards, downwards);
}

}  // namespace kmax::simulation
