#include "host_tools/simulation/motor_drive.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <utility>

namespace kmax::simulation {
namespace {

std::variant<BrushedDcMotor, SynchronousMotor> make_motor(const MotorConfig& config) {
  if (const auto* brushed = std::get_if<BrushedDcMotorConfig>(&config)) return BrushedDcMotor(*brushed);
  return SynchronousMotor(std::get<SynchronousMotorConfig>(config));
}

}  // namespace

MotorDrive::MotorDrive(const MotorDriveConfig& config, const CoupledHandle& handle)
    : motor_(make_motor(config.motor)),
      inverter_(config.inverter),
      sensor_(config.current_sensor, NoiseGenerator(config.seed).bits()),
      handle_(handle),
      coupling_(handle.position(), config.encoder.reversed),
      encoder_(config.encoder, coupling_.disc(), config.seed),
      transmission_(config.encoder.transmission) {}

void MotorDrive::advance(double duration, const InverterCommand& command, Supply& supply) {
  if (!(duration > 0.0 && duration <= 0.01)) {
    throw std::invalid_argument(
        fmt::format("motor drive: duration = {} s: allowed is above 0 to 0.01 s", duration));
  }
  const int pieces =
      duration <= longest_piece ? 1 : static_cast<int>(std::ceil(duration / longest_piece - 1e-9));
  const double piece = duration / pieces;
  InverterCommand at_terminals = command;
  for (std::size_t k = 0; k < terminal_count; ++k) at_terminals.legs[k] = command.legs[leg_of_[k]];
  double torque_sum = 0.0;
  for (int n = 0; n < pieces; ++n) {
    const double velocity = handle_.velocity();
    const double middle = velocity == 0.0 ? 0.0 : velocity + 0.5 * piece * acceleration_;
    const ShaftMotion shaft{shaft_angle(), middle / transmission_};
    double torque = 0.0;
    const Inverter::Flow flow = std::visit(
        [&](auto& motor) {
          const Inverter::Flow from_legs =
              inverter_.advance(motor, at_terminals, supply.voltage(), shaft, piece);
          torque = from_legs.mean_torque + motor.cogging_torque(shaft.angle + 0.5 * piece * shaft.speed);
          return from_legs;
        },
        motor_);
    supply.draw(flow.charge);
    torque_sum += torque;
    const double force = torque / transmission_;
    handle_.advance(force + push_ - push_damping_ * velocity, background_force_, piece);
    acceleration_ = (handle_.velocity() - velocity) / piece;
    coupling_.update(handle_.position(), torque);
    encoder_.update(coupling_.disc());
  }
  mean_torque_ = torque_sum / pieces;
  command_ = command;
  if (handle_.clipped_samples() != 0) {
    throw std::logic_error(
        "motor drive: the handle clipped the motor's force; give its device force_limit = 0");
  }
}

double MotorDrive::current_pin(CurrentSensor::Channel channel, CurrentSensor::Half half) {
  const std::size_t leg = channel == CurrentSensor::Channel::b ? terminal_b : terminal_c;
  const double current = leg_currents()[leg];
  const auto [enabled, duty] = command_.legs[leg];
  if (!enabled) return sensor_.sample(channel, std::max(current, 0.0), half);
  const bool low = half == CurrentSensor::Half::low_sides;
  const double since = 0.5 * (low ? 1.0 - duty : duty) / command_.pwm_frequency - command_.dead_time;
  const double left = sensor_.left_after(since);
  return sensor_.sample(channel, current * (low ? 1.0 - left : left), half);
}

void MotorDrive::open_terminal(std::size_t terminal, bool open) {
  std::visit([&](auto& motor) { motor.set_open(terminal, open); }, motor_);
}

void MotorDrive::swap_terminals(std::size_t one, std::size_t other) {
  std::swap(leg_of_.at(one), leg_of_.at(other));
}

void MotorDrive::block(bool blocked) {
  blocked_ = blocked;
  handle_.block(blocked_ || held_);
}

void MotorDrive::hold(bool held) {
  held_ = held;
  handle_.block(blocked_ || held_);
}

void MotorDrive::update_encoder() {
  coupling_.update(handle_.position(), mean_torque_);
  encoder_.update(coupling_.disc());
}

void MotorDrive::push(double force, double damping) {
  if (!std::isfinite(force) || !(damping >= 0.0 && damping <= 100.0))
    throw std::invalid_argument(fmt::format(
        "push of {} N with {} N s/m: the force must be finite, the damping 0 to 100 N s/m", force, damping));
  push_ = force;
  push_damping_ = damping;
}

void MotorDrive::set_background_force(double force) {
  if (!(std::abs(force) <= 1e6))
    throw std::invalid_argument(fmt::format("background force = {} N: allowed is -1e6 to 1e6 N", force));
  background_force_ = force;
}

TerminalValues MotorDrive::currents() const {
  return std::visit([](const auto& motor) { return motor.currents(); }, motor_);
}

TerminalValues MotorDrive::leg_currents() const {
  const TerminalValues into_motor = currents();
  TerminalValues out_of_legs{};
  for (std::size_t k = 0; k < terminal_count; ++k) out_of_legs[leg_of_[k]] = into_motor[k];
  return out_of_legs;
}

bool MotorDrive::gate_driver_starts() const {
  const double limit = inverter_.config().start_limit;
  const double highest = std::visit(
      [&](const auto& motor) { return motor.largest_induced(handle_.velocity() / transmission_); }, motor_);
  return limit == 0.0 || highest <= limit;
}

double MotorDrive::magnetic_energy() const {
  if (const auto* brushed = std::get_if<BrushedDcMotor>(&motor_)) return brushed->energy();
  return std::get<SynchronousMotor>(motor_).energy(shaft_angle());
}

}  // namespace kmax::simulation
