#include "host_tools/simulation/synchronous_motor.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace kmax::simulation {
namespace {

constexpr double pi = 3.141592653589793;
constexpr double root_three = 1.7320508075688772;
constexpr double largest_step = 1.25;  // rate x duration of one series
constexpr double runge_kutta_step = 0.03;
constexpr double shortest_time_constant = 1e-6;  // s

// Taylor order for rate x h <= (index + 1) / 64; the forcing terms need one order more than the rest.
constexpr std::size_t order_bins = 80;
constexpr std::array<int, order_bins> series_orders = [] {
  std::array<int, order_bins> orders{};
  for (std::size_t bin = 0; bin < order_bins; ++bin) {
    const double z = static_cast<double>(bin + 1) / 64.0;
    double term = z;
    int order = 1;
    while (2.0 * term * z / (order + 1) > 1e-13) term *= z / ++order;
    orders[bin] = order + 1;
  }
  return orders;
}();
constexpr std::array<double, 24> reciprocals = [] {
  std::array<double, 24> values{};
  for (std::size_t n = 1; n < values.size(); ++n) values[n] = 1.0 / static_cast<double>(n);
  return values;
}();
static_assert(series_orders[order_bins - 1] < static_cast<int>(reciprocals.size()));

struct Rotation {
  double cosine;
  double sine;
};
Rotation rotation(double angle) {
  return {std::cos(angle), std::sin(angle)};
}

}  // namespace

void validate(const SynchronousMotorConfig& config) {
  require_allowed(config, std::span<const ModelField<SynchronousMotorConfig>>(synchronous_motor_fields),
                  "motor");
  if (config.pole_pairs != std::floor(config.pole_pairs)) {
    throw std::invalid_argument(
        fmt::format("motor.pole_pairs = {}: allowed is a whole number", config.pole_pairs));
  }
  if (config.cogging_periods != std::floor(config.cogging_periods)) {
    throw std::invalid_argument(
        fmt::format("motor.cogging_periods = {}: allowed is a whole number", config.cogging_periods));
  }
  const double smaller = std::min(config.inductance_d, config.inductance_q);
  if (!(smaller / config.resistance >= shortest_time_constant)) {
    throw std::invalid_argument(
        fmt::format("motor: inductance / resistance = {} H / {} ohm = {} s; allowed is {} s or more", smaller,
                    config.resistance, smaller / config.resistance, shortest_time_constant));
  }
}

SynchronousMotor::SynchronousMotor(const SynchronousMotorConfig& config) : config_(config) {
  validate(config);
  torque_per_flux_ = 1.5 * config.pole_pairs;
  flux_ = config.torque_constant / torque_per_flux_;
}

void SynchronousMotor::set_open(std::size_t terminal, bool open) {
  open_.at(terminal) = open;
  stop_currents(open_);
}

void SynchronousMotor::stop_currents(const std::array<bool, terminal_count>& stopped) {
  std::size_t terminal = terminal_count, number = 0;
  for (std::size_t k = 0; k < terminal_count; ++k) {
    if (!stopped[k]) continue;
    terminal = k;
    ++number;
  }
  if (number == 0) return;
  if (number > 1) {
    alpha_ = beta_ = 0.0;
    return;
  }
  // What is left is the part of the vector across the terminal's axis.
  const Rotation across = rotation((static_cast<double>(terminal) * 2.0 / 3.0 + 0.5) * pi);
  const double left = alpha_ * across.cosine + beta_ * across.sine;
  alpha_ = left * across.cosine;
  beta_ = left * across.sine;
}

DirectQuadrature SynchronousMotor::currents_at(double angle) const {
  const auto [c, s] = rotation(electrical_angle(angle));
  return {c * alpha_ + s * beta_, c * beta_ - s * alpha_};
}

double SynchronousMotor::torque_at(double angle) const {
  const DirectQuadrature i = currents_at(angle);
  return torque(i.d, i.q);
}

double SynchronousMotor::cogging_torque(double angle) const {
  return config_.cogging_torque == 0.0 ? 0.0
                                       : -config_.cogging_torque * std::sin(config_.cogging_periods * angle);
}

double SynchronousMotor::energy(double angle) const {
  const DirectQuadrature i = currents_at(angle);
  return 0.75 * (config_.inductance_d * i.d * i.d + config_.inductance_q * i.q * i.q);
}

TerminalValues SynchronousMotor::induced(const ShaftMotion& shaft) const {
  const auto [c, s] = rotation(electrical_angle(shaft.angle));
  const double size = electrical_speed(shaft.speed) * flux_;
  return terminals_of(-size * s, size * c);
}

void SynchronousMotor::advance(const TerminalDrive& drive, const ShaftMotion& shaft, double duration) {
  std::array<std::size_t, terminal_count> conducting{};
  std::size_t count = 0;
  for (std::size_t k = 0; k < terminal_count; ++k) {
    if (drive.conducting[k] && wired(k)) conducting[count++] = k;
  }
  if (count == terminal_count) {
    advance_three(drive, shaft, duration);
  } else if (count == 2) {
    advance_two(conducting[0], conducting[1], drive, shaft, duration);
  } else {
    alpha_ = beta_ = mean_alpha_ = mean_beta_ = mean_torque_ = 0.0;
  }
}

void SynchronousMotor::advance_three(const TerminalDrive& drive, const ShaftMotion& shaft, double duration) {
  const double resistance = config_.resistance + drive.leg_resistance;
  const double per_d = 1.0 / config_.inductance_d, per_q = 1.0 / config_.inductance_q;
  const double w = electrical_speed(shaft.speed);
  const double v_alpha = (2.0 * drive.voltage[0] - drive.voltage[1] - drive.voltage[2]) / 3.0;
  const double v_beta = (drive.voltage[1] - drive.voltage[2]) / root_three;
  const double angle = electrical_angle(shaft.angle);
  const auto [c, s] = rotation(angle);
  double d = c * alpha_ + s * beta_, q = c * beta_ - s * alpha_;
  double v_d = c * v_alpha + s * v_beta, v_q = c * v_beta - s * v_alpha;
  const double flux_d = config_.inductance_d * d + flux_, flux_q = config_.inductance_q * q;

  const double most = std::max(per_d, per_q);
  const double ratio = most * std::max(config_.inductance_d, config_.inductance_q);
  const double z = (resistance * most + std::abs(w) * (1.0 + ratio)) * duration;
  const int steps = z <= largest_step ? 1 : static_cast<int>(std::ceil(z / largest_step));
  const double h = duration / steps;
  const auto bin = static_cast<std::size_t>(z / steps * 64.0);
  const auto order = static_cast<std::size_t>(series_orders[std::min(order_bins - 1, bin)]);
  double torque_sum = 0.0;
  for (int step = 0; step < steps; ++step) {
    double cd = d, cq = q, cvd = v_d, cvq = v_q - w * flux_;
    double half_d = d, half_q = q, half = 0.5;
    const double begin = torque(d, q);
    for (std::size_t n = 1; n <= order; ++n) {
      const double f = h * reciprocals[n];
      const double next_d = f * per_d * (cvd - resistance * cd + w * config_.inductance_q * cq);
      const double next_q = f * per_q * (cvq - resistance * cq - w * config_.inductance_d * cd);
      // The flux is a constant and leaves the series after its first term.
      if (n == 1) cvq = v_q;
      const double next_vd = f * w * cvq, next_vq = -f * w * cvd;
      d += cd = next_d;
      q += cq = next_q;
      v_d += cvd = next_vd;
      v_q += cvq = next_vq;
      half_d += half * cd;
      half_q += half * cq;
      half *= 0.5;
    }
    torque_sum += begin + 4.0 * torque(half_d, half_q) + torque(d, q);
  }
  mean_torque_ = torque_sum / (6.0 * steps);

  const auto [c1, s1] = rotation(angle + w * duration);
  alpha_ = c1 * d - s1 * q;
  beta_ = s1 * d + c1 * q;
  // Faraday's law in the stator's frame: the flux linkage changes by the integral of v - R i.
  const double end_d = config_.inductance_d * d + flux_, end_q = config_.inductance_q * q;
  const double per = 1.0 / (resistance * duration);
  mean_alpha_ = v_alpha / resistance - ((c1 * end_d - s1 * end_q) - (c * flux_d - s * flux_q)) * per;
  mean_beta_ = v_beta / resistance - ((s1 * end_d + c1 * end_q) - (s * flux_d + c * flux_q)) * per;
}

void SynchronousMotor::advance_two(std::size_t x, std::size_t y, const TerminalDrive& drive,
                                   const ShaftMotion& shaft, double duration) {
  stop_currents({x != 0, x == 0 && y == 2, y == 1});
  const double resistance = 2.0 * (config_.resistance + drive.leg_resistance);
  const double voltage = drive.voltage[x] - drive.voltage[y];
  const double w = electrical_speed(shaft.speed);
  const double axis = (x == 0 && y == 2) ? pi / 6.0 : x == 0 ? -pi / 6.0 : pi / 2.0;
  const Rotation along = rotation(axis);
  const double linked = root_three * flux_;
  constexpr double vector = 2.0 / root_three;  // of the pair's current

  struct Pair {
    double current;
    double torque;
  };
  const auto at = [&](double linkage, double delta) -> Pair {
    const Rotation to = rotation(delta);
    const double inductance =
        2.0 * (config_.inductance_d * to.cosine * to.cosine + config_.inductance_q * to.sine * to.sine);
    const double i = (linkage - linked * to.cosine) / inductance;
    return {i, torque(vector * i * to.cosine, vector * i * to.sine)};
  };

  double delta = axis - electrical_angle(shaft.angle);
  const Rotation start = rotation(delta);
  double i = (alpha_ * along.cosine + beta_ * along.sine) / vector;
  double linkage = 2.0 *
                       (config_.inductance_d * start.cosine * start.cosine +
                        config_.inductance_q * start.sine * start.sine) *
                       i +
                   linked * start.cosine;
  const double first_linkage = linkage;
  const double rate = 0.5 * resistance / std::min(config_.inductance_d, config_.inductance_q) + std::abs(w);
  const int steps = std::max(1, static_cast<int>(std::ceil(rate * duration / runge_kutta_step)));
  const double h = duration / steps;
  const double turn = w * h;
  double torque_sum = 0.0;
  Pair now = at(linkage, delta);
  for (int step = 0; step < steps; ++step) {
    const double k1 = voltage - resistance * now.current;
    const double k2 = voltage - resistance * at(linkage + 0.5 * h * k1, delta - 0.5 * turn).current;
    const double k3 = voltage - resistance * at(linkage + 0.5 * h * k2, delta - 0.5 * turn).current;
    const double k4 = voltage - resistance * at(linkage + h * k3, delta - turn).current;
    const double end_linkage = linkage + h / 6.0 * (k1 + 2.0 * (k2 + k3) + k4);
    const Pair end = at(end_linkage, delta - turn);
    // The middle from the values and slopes at both ends (Hermite), for Simpson's rule.
    const double end_slope = voltage - resistance * end.current;
    const Pair middle = at(0.5 * (linkage + end_linkage) + h / 8.0 * (k1 - end_slope), delta - 0.5 * turn);
    linkage = end_linkage;
    delta -= turn;
    torque_sum += now.torque + 4.0 * middle.torque + end.torque;
    now = end;
  }
  mean_torque_ = torque_sum / (6.0 * steps);
  alpha_ = vector * now.current * along.cosine;
  beta_ = vector * now.current * along.sine;
  const double mean = (voltage - (linkage - first_linkage) / duration) / resistance;
  mean_alpha_ = vector * mean * along.cosine;
  mean_beta_ = vector * mean * along.sine;
}

}  // namespace kmax::simulation
