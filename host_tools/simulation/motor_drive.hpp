#pragma once
// One axis with its power: an inverter, a motor on its legs, current sensors, the handle that the motor
// moves, and the encoder on the shaft. Electrical and mechanical parts advance together.
//
//   shaft angle = position / transmission, shaft speed = velocity / transmission,
//   force on the handle = (torque + cogging) / transmission
//
// Both are without friction or elasticity; the rotor's inertia belongs into the device's mass.
//
// Method: pieces of at most 25 us. In each the circuit is solved with the speed that the handle will have in
// the middle of the piece, extrapolated with the acceleration of the piece before; then the handle moves
// under the mean torque, as it would under a constant force. Circuit and handle are each solved exactly; what
// the splitting leaves is of second order in the piece: 2e-6 of the velocity after 10 ms at full acceleration
// of a 45 g handle by the brushed motor's default.
//
// Force limit. DeviceModel::force_limit clips the force in CoupledHandle, which stands for an ideal actuator
// with a peak force. A motor has no such limit: its current is limited by the firmware, and by the supply and
// the winding. The handle given here must have force_limit = 0 (SceneAxis::make_drive sees to it); advance()
// throws std::logic_error once the handle has clipped.
//
// Background force: CoupledHandle wants to know the background force (the field's and F_B) that makes the
// person co-contract, apart from the whole force. A motor shows only the whole. So it is a setting: 0 unless
// set_background_force() is called, by whoever knows what the firmware commands.
//
// Cost of advance() for 25 us with a person, who costs 0.1 us of it: brushed 0.3 us, synchronous 0.5 us, and
// with a current in the dead time's band 0.4 and 0.7 us (a busy machine: three tasks on each core). No heap.

#include <array>
#include <cstdint>
#include <variant>

#include "host_tools/simulation/brushed_dc_motor.hpp"
#include "host_tools/simulation/coupled_handle.hpp"
#include "host_tools/simulation/current_sensor.hpp"
#include "host_tools/simulation/encoder_coupling.hpp"
#include "host_tools/simulation/inverter.hpp"
#include "host_tools/simulation/quadrature_encoder.hpp"
#include "host_tools/simulation/supply.hpp"
#include "host_tools/simulation/synchronous_motor.hpp"

namespace kmax::simulation {

using MotorConfig = std::variant<BrushedDcMotorConfig, SynchronousMotorConfig>;

struct MotorDriveConfig {
  MotorConfig motor;
  InverterConfig inverter;
  CurrentSensorConfig current_sensor;
  EncoderConfig encoder;  // and the transmission
  std::uint64_t seed = 1;
};

class MotorDrive {
 public:
  static constexpr double longest_piece = 25e-6;  // s

  // Throws std::invalid_argument for a part whose values are not allowed.
  MotorDrive(const MotorDriveConfig& config, const CoupledHandle& handle);

  // Holds the command for `duration` (s, above 0 up to 0.01) and adds the charge it takes to the supply's
  // interval; whoever owns the supply then advances it by the same duration, once for all its drives. Throws
  // std::invalid_argument for a duration or command that is not allowed or not finite; nothing has moved
  // then.
  void advance(double duration, const InverterCommand& command, Supply& supply);

  // V at the converter's pin of leg B or C now, in the middle of that half of the PWM period; one sample of
  // noise. A leg that is off shows the current of its lower diode. The current is the mean of the PWM period,
  // as far as the amplifier has settled since the leg's last edge.
  double current_pin(CurrentSensor::Channel channel,
                     CurrentSensor::Half half = CurrentSensor::Half::low_sides);

  // The person on the handle, the motion, what blocks it.
  CoupledHandle& handle() { return handle_; }
  const CoupledHandle& handle() const { return handle_; }
  QuadratureEncoder& encoder() { return encoder_; }
  const QuadratureEncoder& encoder() const { return encoder_; }
  CurrentSensor& current_sensor() { return sensor_; }
  EncoderCoupling& encoder_coupling() { return coupling_; }
  // The encoder looks at the shaft; advance() does that in every piece, so this matters with edge noise only.
  void update_encoder();
  // rad, of the encoder's disc: the shaft's unless the encoder is reversed or has a defect.
  double disc_angle() const { return coupling_.disc() / transmission_; }

  // Faults. Opens the wire of one of the motor's terminals, or closes it.
  void open_terminal(std::size_t terminal, bool open);
  // The wires of two of the motor's terminals change places on the legs. Twice is as before.
  void swap_terminals(std::size_t one, std::size_t other);
  // A blocked motor holds the handle where it is.
  void block(bool blocked);
  // So does somebody's hand until it lets go. Apart from block(), so that letting go does not mend a motor.
  void hold(bool held);

  // A hand that pushes with `force` (N along +x) less `damping` (N s/m) times the handle's speed, besides the
  // person of the scene; from now on. Throws std::invalid_argument unless finite and damping is 0 to 100.
  void push(double force, double damping);

  void set_background_force(double force);  // N; throws std::invalid_argument unless finite

  TerminalValues currents() const;      // A, into the motor's terminals, now
  TerminalValues leg_currents() const;  // A, out of the inverter's legs, now
  double shaft_angle() const { return handle_.position() / transmission_; }  // rad
  double mean_torque() const { return mean_torque_; }            // N m, with cogging, of the last advance
  double force() const { return mean_torque_ / transmission_; }  // N on the handle, of the last advance
  double magnetic_energy() const;                                // J in the inductances
  // Whether the gate driver starts if EN_GATE rises now (InverterConfig::start_limit). Its highest SH_x is
  // taken to be what the shaft induces between two legs, the lowest of which a diode holds at ground: a
  // guess, since what leaks where decides.
  bool gate_driver_starts() const;
  // Null: a brushed DC motor.
  const SynchronousMotor* synchronous_motor() const { return std::get_if<SynchronousMotor>(&motor_); }

 private:
  std::variant<BrushedDcMotor, SynchronousMotor> motor_;
  Inverter inverter_;
  CurrentSensor sensor_;
  CoupledHandle handle_;
  EncoderCoupling coupling_;
  QuadratureEncoder encoder_;
  double transmission_;
  std::array<std::size_t, terminal_count> leg_of_{terminal_a, terminal_b, terminal_c};  // of each terminal
  bool blocked_ = false, held_ = false;
  InverterCommand command_;    // of the last advance
  double acceleration_ = 0.0;  // m/s2, of the last piece
  double background_force_ = 0.0;
  double push_ = 0.0, push_damping_ = 0.0;
  double mean_torque_ = 0.0;
};

}  // namespace kmax::simulation
