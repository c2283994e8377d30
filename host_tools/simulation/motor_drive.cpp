#include "host_tools/simulation/motor_drive.hpp"

#include <fmt/format.h>

#include <cmath>
#include <stdexcept>

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
      encoder_(config.encoder, handle.position(), config.seed),
      transmission_(config.encoder.transmission) {}

void MotorDrive::advance(double duration, const InverterCommand& command, Supply& supply) {
  if (!(duration > 0.0 && duration <= 0.01)) {
    throw std::invalid_argument(
        fmt::format("motor drive: duration = {} s: allowed is above 0 to 0.01 s", duration));
  }
  const int pieces =
      duration <= longest_piece ? 1 : static_cast<int>(std::ceil(duration / longest_piece - 1e-9));
  const double piece = duration / pieces;
  double torque_sum = 0.0;
  for (int n = 0; n < pieces; ++n) {
    const double velocity = handle_.velocity();
    const double middle = velocity == 0.0 ? 0.0 : velocity + 0.5 * piece * acceleration_;
    const ShaftMotion shaft{shaft_angle(), middle / transmission_};
    double torque = 0.0;
    const Inverter::Flow flow = std::visit(
        [&](auto& motor) {
          const Inverter::Flow from_legs = inverter_.advance(motor, command, supply.voltage(), shaft, piece);
          torque = from_legs.mean_torque + motor.cogging_torque(shaft.angle + 0.5 * piece * shaft.speed);
          return from_legs;
        },
        motor_);
    supply.draw(flow.charge);
    torque_sum += torque;
    const double force = torque / transmission_;
    handle_.advance(force, background_from_motor_ ? force : background_force_, piece);
    acceleration_ = (handle_.velocity() - velocity) / piece;
    encoder_.update(handle_.position());
  }
  mean_torque_ = torque_sum / pieces;
  for (std::size_t k = 0; k < terminal_count; ++k) leg_on_[k] = command.legs[k].enabled;
  if (handle_.clipped_samples() != 0) {
    throw std::logic_error(
        "motor drive: the handle clipped the motor's force; give its device force_limit = 0");
  }
}

double MotorDrive::current_pin(CurrentSensor::Channel channel, bool lower_fet_on) {
  const std::size_t leg = channel == CurrentSensor::Channel::b ? terminal_b : terminal_c;
  const double current = currents()[leg];
  const bool below = leg_on_[leg] ? lower_fet_on : current > 0.0;
  return sensor_.sample(channel, below ? current : 0.0);
}

void MotorDrive::open_terminal(std::size_t terminal, bool open) {
  std::visit([&](auto& motor) { motor.set_open(terminal, open); }, motor_);
}

void MotorDrive::set_background_force(double force) {
  if (!(std::abs(force) <= 1e6))
    throw std::invalid_argument(fmt::format("background force = {} N: allowed is -1e6 to 1e6 N", force));
  background_force_ = force;
  background_from_motor_ = false;
}

TerminalValues MotorDrive::currents() const {
  return std::visit([](const auto& motor) { return motor.currents(); }, motor_);
}

double MotorDrive::magnetic_energy() const {
  if (const auto* brushed = std::get_if<BrushedDcMotor>(&motor_)) return brushed->energy();
  return std::get<SynchronousMotor>(motor_).energy(shaft_angle());
}

}  // namespace kmax::simulation
