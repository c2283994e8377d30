#include "host_tools/simulation/brushed_dc_motor.hpp"

#include <cmath>

namespace kmax::simulation {

BrushedDcMotor::BrushedDcMotor(const BrushedDcMotorConfig& config) : config_(config) {
  require_allowed(config, std::span<const ModelField<BrushedDcMotorConfig>>(brushed_dc_motor_fields),
                  "motor");
}

void BrushedDcMotor::set_open(std::size_t terminal, bool open) {
  open_.at(terminal) = open;
  stop_currents(open_);
}

void BrushedDcMotor::stop_currents(const std::array<bool, terminal_count>& stopped) {
  if (stopped[terminal_b] || stopped[terminal_c]) current_ = 0.0;
}

void BrushedDcMotor::advance(const TerminalDrive& drive, const ShaftMotion& shaft, double duration) {
  if (!drive.conducting[terminal_b] || !drive.conducting[terminal_c] || !wired(terminal_b) ||
      !wired(terminal_c)) {
    current_ = mean_current_ = 0.0;
    return;
  }
  const double resistance = config_.resistance + 2.0 * drive.leg_resistance;
  if (duration != duration_ || resistance != resistance_) {
    duration_ = duration;
    resistance_ = resistance;
    const double x = duration * resistance / config_.inductance;
    approach_ = -std::expm1(-x);
    // 1 - (1 - e^-x)/x; for a small x its series, because the literal form cancels.
    mean_approach_ = x > 1e-2 ? 1.0 - approach_ / x
                              : x / 2 * (1 - x / 3 * (1 - x / 4 * (1 - x / 5 * (1 - x / 6 * (1 - x / 7)))));
  }
  const double voltage = drive.voltage[terminal_b] - drive.voltage[terminal_c];
  const double way = (voltage - config_.torque_constant * shaft.speed) / resistance - current_;
  mean_current_ = current_ + way * mean_approach_;
  current_ += way * approach_;
}

}  // namespace kmax::simulation
