#pragma once
// What a hand feels of a motor that shall make a constant force: how far the force at the handle is from the
// one that is asked for, with each compensation on or off. For torque_ripple_benchmark.cpp and its test.
//
// The parts are those of the simulated motors (host_tools/simulation: windings, bridge with its dead time,
// current sensors with noise and offset, encoder, supply) and of the target (control/, in float: current
// controllers, ForceCompensation), with what lies between them: 12-bit converter codes, counts, duties
// rounded to the timer's steps, half a tick from sample to duty. The shaft's motion is prescribed: a hand
// that moves the handle at a constant speed whatever it feels, or holds it.
//
//   felt = (motor + cogging) / transmission + gravity - friction x direction of motion
//
// Standing, friction may hold anything and is left out. "felt" is passed through a first-order low-pass of
// 1 kHz, above which fingers feel nothing.

#include <array>
#include <cmath>
#include <cstdint>
#include <stdexcept>
#include <string>
#include <variant>
#include <vector>

#include "firmware/drive/axis.hpp"
#include "host_tools/simulated_board/simulated_power_hardware.hpp"
#include "host_tools/simulation/converter_code.hpp"
#include "host_tools/simulation/scene.hpp"

namespace kmax::torque_ripple {

/// Gravity is not the scenes' business: a handle of some grams off the shaft's axis.
inline constexpr double gravity_constant = 0.02, gravity_cosine = 0.03;  // N along +x
inline constexpr double asked_force = 0.5;                               // N
inline constexpr double speed = 0.005;                                   // m/s

struct Compensations {
  bool dead_time = false, cogging = false, friction = false, gravity = false;
  double limit_share = 0.7;  // ForceCompensation's limit, of the real friction
  double map_share = 1.0;    // cogging as identified, of the real one
};

/// Of felt less asked_force, N.
struct Felt {
  double rms = 0.0;     // all of it
  double peak = 0.0;    // largest magnitude
  double ripple = 0.0;  // RMS about the mean: of each place when standing, of each direction when moving
};

struct Trace {
  std::vector<double> position, felt;  // m, N
};

/// The values of the axis' motor, with the resistance of the bridge's legs.
inline firmware::MotorControlConfig motor_config_of(const simulation::SceneAxis& axis,
                                                    double leg_resistance) {
  firmware::MotorControlConfig config{
      .transmission = static_cast<float>(axis.encoder.transmission),
      .counts_per_turn = static_cast<std::uint32_t>(axis.encoder.counts_per_turn),
      .modulation_limit = 0.88f};
  if (const auto* motor = std::get_if<simulation::SynchronousMotorConfig>(&*axis.motor)) {
    config.kind = firmware::MotorKind::pmsm;
    config.torque_constant = static_cast<float>(motor->torque_constant);
    config.resistance = static_cast<float>(motor->resistance + leg_resistance);
    config.inductance = static_cast<float>(motor->inductance_d);
    config.inductance_q = static_cast<float>(motor->inductance_q);
    config.pole_pairs = static_cast<std::int32_t>(motor->pole_pairs);
    config.electrical_offset = static_cast<float>(motor->electrical_offset);
  } else {
    const auto& brushed = std::get<simulation::BrushedDcMotorConfig>(*axis.motor);
    config.torque_constant = static_cast<float>(brushed.torque_constant);
    config.resistance = static_cast<float>(brushed.resistance + 2 * leg_resistance);
    config.inductance = static_cast<float>(brushed.inductance);
  }
  return config;
}

class Rig {
 public:
  static constexpr double tick = 50e-6, half_tick = 25e-6, dead_time = 20 / 168e6;

  /// Throws std::invalid_argument for an axis without a motor.
  Rig(const simulation::Scene& scene, const Compensations& compensations)
      : axis_(scene.axes.at(0)),
        inverter_(axis_.inverter),
        sensor_(sensor_config(axis_, current_limit(scene)), scene.seed),
        supply_(scene.make_supply()),
        count_length_(axis_.encoder.count_length()) {
    if (!axis_.motor) throw std::invalid_argument(scene.name + ": the axis has no motor");
    prepare_haptic();
    prepare_motor(compensations.dead_time, current_limit(scene));
    prepare_compensation(compensations);
    command_.dead_time = dead_time;
    for (std::size_t channel = 0; channel < 2; ++channel) {
      for (int n = 0; n < 256; ++n) zero_[channel] += pin(channel) / 256;
    }
  }

  /// Held at `places` places, evenly spread over a turn of the motor's electrical angle and, with steps that
  /// have nothing in common with it, over the cogging.
  Felt standing(int places = 16) {
    Sum all, ripple;
    for (int place = 0; place < places; ++place) {
      place_at(electrical_turn() * (place + 0.381966 * (place % 3)) / places);
      Sum here;
      for (int n = 0; n < 6000; ++n) {
        const double felt = step(0.0) - asked_force;
        if (n >= 2000) here.add(felt);
      }
      all.add(here);
      ripple.add_squares(here.variance() * here.count, here.count);
    }
    return {all.rms(), all.peak, ripple.rms()};
  }

  /// Moved forth and back over an electrical turn and more, at `speed`; what happens within 0.2 s of the
  /// start and of the reversal is left out. `trace`, if given, gets the way forth.
  Felt moving(Trace* trace = nullptr) {
    const double stroke = 1.2 * electrical_turn();
    const auto ticks = static_cast<int>((stroke / speed + 0.2) / tick);
    Sum all, ripple;
    place_at(0.0);
    for (const double direction : {1.0, -1.0}) {
      Sum here;
      for (int n = 0; n < ticks; ++n) {
        const double felt = step(direction * speed) - direction * axis_.device.friction - asked_force;
        if (n * tick < 0.2) continue;
        here.add(felt);
        if (trace != nullptr && direction > 0.0 && n % 100 == 0) {
          trace->position.push_back(position_);
          trace->felt.push_back(felt + asked_force);
        }
      }
      all.add(here);
      ripple.add_squares(here.variance() * here.count, here.count);
    }
    return {all.rms(), all.peak, ripple.rms()};
  }

 private:
  struct Sum {
    double count = 0.0, sum = 0.0, squares = 0.0, peak = 0.0;
    void add(double value) {
      count += 1.0;
      sum += value;
      squares += value * value;
      peak = std::fmax(peak, std::fabs(value));
    }
    void add(const Sum& other) {
      count += other.count;
      sum += other.sum;
      squares += other.squares;
      peak = std::fmax(peak, other.peak);
    }
    void add_squares(double more, double of) {
      squares += more;
      count += of;
    }
    double rms() const { return std::sqrt(squares / count); }
    double variance() const { return std::fmax(0.0, squares / count - sum * sum / (count * count)); }
  };

  static double current_limit(const simulation::Scene& scene) {
    for (const auto& parameter : scene.parameters) {
      if (parameter.name == "current.limit") return std::get<double>(parameter.value);
    }
    return 5.0;
  }

  /// The largest of the amplifier's gains that shows 1.5 times the current limit, as the firmware chooses it.
  static simulation::CurrentSensorConfig sensor_config(const simulation::SceneAxis& axis, double limit) {
    auto config = axis.current_sensor;
    config.gain = 10.0;
    for (const double gain : {20.0, 40.0, 80.0}) {
      if (1.5 * limit * config.shunt * gain < 1.6) config.gain = gain;
    }
    return config;
  }

  const simulation::SynchronousMotorConfig* synchronous() const {
    return std::get_if<simulation::SynchronousMotorConfig>(&*axis_.motor);
  }

  /// m of handle travel; a DC motor has no electrical angle: a turn of its shaft's tenth.
  double electrical_turn() const {
    const double turn = 2 * pi * axis_.encoder.transmission;
    return synchronous() != nullptr ? turn / synchronous()->pole_pairs : 0.1 * turn;
  }

  /// No wall; the force comes from outside, as another axis' would.
  void prepare_haptic() {
    control::HapticLoopConfig<float> config;
    config.count_length = count_length_;
    config.velocity.kind = control::VelocityEstimatorKind::tracking;
    config.velocity.bandwidth = 30.0f;
    config.force.ramp_time = 0.0f;
    setting_.haptic = control::HapticLoop<float>::prepare(config, 0);
    setting_.supply = firmware::SupplyWindow(0.0f, 100.0f);
    setting_.generation = 1;
  }

  void prepare_motor(bool dead_time_compensated, double limit) {
    firmware::MotorControlConfig config = motor_config_of(axis_, axis_.inverter.on_resistance);
    config.current_limit = static_cast<float>(limit);
    config.dead_time = static_cast<float>(dead_time_compensated ? dead_time : 0.0);
    double inductance = 0.0;
    if (const auto* motor = synchronous()) {
      motor_.emplace<simulation::SynchronousMotor>(*motor);
      inductance = 0.75 * (motor->inductance_d + motor->inductance_q);
    } else {
      const auto& brushed = std::get<simulation::BrushedDcMotorConfig>(*axis_.motor);
      motor_.emplace<simulation::BrushedDcMotor>(brushed);
      inductance = brushed.inductance;
    }
    // The band in which the current ends within the dead time, and what the converter cannot tell from zero.
    config.dead_time_current =
        static_cast<float>(std::fmax(supply_.voltage() * dead_time / inductance, 0.02));
    setting_.motor = firmware::MotorControl::prepare(config);
  }

  void prepare_compensation(const Compensations& on) {
    control::ForceCompensationConfig<float> config;
    if (on.friction) config.friction = static_cast<float>(axis_.device.friction);
    config.friction_velocity = static_cast<float>(0.8 * speed);
    if (const auto* motor = synchronous(); motor != nullptr && on.cogging) {
      config.cogging_periods = static_cast<std::uint32_t>(motor->cogging_periods);
      config.cogging_sine_1 =
          static_cast<float>(-on.map_share * motor->cogging_torque / axis_.encoder.transmission);
    }
    if (on.gravity) {
      config.gravity_constant = static_cast<float>(gravity_constant);
      config.gravity_cosine = static_cast<float>(gravity_cosine);
    }
    config.limit = static_cast<float>(on.limit_share * axis_.device.friction);
    setting_.compensation = control::ForceCompensation<float>::prepare(config);
  }

  /// As if the handle had always been there.
  void place_at(double position) {
    position_ = position;
    ++setting_.generation;
  }
  std::int64_t count() const { return static_cast<std::int64_t>(std::floor(position_ / count_length_)); }

  double pin(std::size_t channel) {
    const double current =
        std::visit([](const auto& motor) { return motor.currents(); }, motor_)[channel + 1];
    const double volt = sensor_.sample(static_cast<simulation::CurrentSensor::Channel>(channel), current);
    return simulation::converter_code(volt) * drivers::converter_reference / drivers::converter_codes;
  }
  float amperes(std::size_t channel) {
    return static_cast<float>((pin(channel) - zero_[channel]) / (sensor_.gain() * sensor_.config().shunt));
  }
  static simulation::LegCommand leg(float duty) {
    return {true, std::floor(static_cast<double>(duty) * 4200.0 + 0.5) / 4200.0};
  }

  /// A tick at this velocity (m/s); N felt without friction.
  double step(double velocity) {
    firmware::Axis::Input in{};
    in.count = static_cast<std::uint32_t>(count());
    in.count_valid = true;
    in.motor = {true, static_cast<float>(supply_.voltage()), amperes(0), amperes(1)};
    const auto& out = controlled_.ISR_tick(
        setting_, in, {.enable = true, .from_axes = static_cast<float>(asked_force)}, ticks_++);
    if (controlled_.ISR_fault() != firmware::Fault::none) {
      throw std::runtime_error("the axis has tripped: fault " +
                               std::to_string(static_cast<int>(controlled_.ISR_fault())));
    }
    simulation::InverterCommand next = command_;
    next.legs = {leg(out.motor.duty_a), leg(out.motor.duty_b), leg(out.motor.duty_c)};
    next.legs[0].enabled = synchronous() != nullptr;
    const double first = advance(velocity);
    command_ = next;
    const double made = 0.5 * (first + advance(velocity));
    felt_ += felt_share * (made - felt_);
    return felt_;
  }

  /// Half a tick; its mean force at the handle.
  double advance(double velocity) {
    const double transmission = axis_.encoder.transmission;
    const simulation::ShaftMotion shaft{position_ / transmission, velocity / transmission};
    const double middle = shaft.angle + 0.5 * half_tick * shaft.speed;
    const double torque = std::visit(
        [&](auto& motor) {
          const auto flow = inverter_.advance(motor, command_, supply_.voltage(), shaft, half_tick);
          supply_.draw(flow.charge);
          return flow.mean_torque + motor.cogging_torque(middle);
        },
        motor_);
    supply_.advance(half_tick);
    position_ += velocity * half_tick;
    return torque / transmission + gravity_constant + gravity_cosine * std::cos(middle);
  }

  static constexpr double pi = 3.14159265358979323846;
  static constexpr double felt_share = 0.2696;  // 1 - exp(-2 pi 1 kHz 50 us)

  simulation::SceneAxis axis_;
  std::variant<simulation::BrushedDcMotor, simulation::SynchronousMotor> motor_;
  simulation::Inverter inverter_;
  simulation::CurrentSensor sensor_;
  simulation::Supply supply_;
  double count_length_;
  std::array<double, 2> zero_{};
  simulation::InverterCommand command_;
  double position_ = 0.0, felt_ = asked_force;

  firmware::Axis controlled_;
  firmware::AxisSetting setting_{};
  std::uint32_t ticks_ = 0;
};

}  // namespace kmax::torque_ripple
