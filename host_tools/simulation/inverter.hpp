#pragma once
// Three half bridges between the rails of a supply, averaged over a PWM period.
//
//   leg on    voltage = share x supply, share = duty + dead-time error, bounded to 0 .. 1
//   leg off   the motor's current finds a diode: into the motor through the lower one (voltage = -drop), out
//             of it through the upper one (voltage = supply + drop), until it is zero; then the leg is
//             blocked
//
// Legs are switched on one by one, so a brushed motor uses B and C alone. The on-resistance lies in series
// with every leg's current, FET or diode. Blocked legs conduct again when the voltages that the turning shaft
// induces exceed the rails by the drop (a motor that is turned too fast charges the supply); while a leg next
// to it switches, its mean voltage counts. For that test the motor's rotor is taken as not salient.
//
// Dead time. Of the two edges of a period one is late by the dead time: the rising one while the current
// flows into the motor, the falling one while it flows out. share is wrong by -f t_dead or +f t_dead (f the
// PWM frequency). A current smaller than supply x t_dead / L ends within the dead time: while both FETs are
// off all motor voltage drives it to zero, L the inductance that it meets (loop_inductance()), and from then
// on the leg's voltage does no harm. The lost share then is f t_dead x current / (supply x t_dead / L): a
// straight line through zero. The ripple of the current within a period, which makes this band wider, is not
// in an averaged model. A leg that never switches (duty 0 or 1) has no edges and no error.
//
// Energy: what the legs give to the motor is what they take from the supply (share x current), less drop x
// |current| in a diode and on-resistance x current^2.
//
// Method: one step of the motor's exact solution while nothing changes. Where a current is in the band of the
// dead time, steps of at most half a PWM period and 0.1 rad of the electrical angle, the share taken at the
// step's mean current; the band pulls a current to its steady state with a time constant of about a PWM
// period, which these steps follow to a few percent, and the steady state itself is exact. Where a diode
// conducts, steps of at most 12.5 us; where its current ends is located by bisection to 1e-9 of the step.
//
// Cost of advance() for 25 us: 50 ns beyond the motor's own; twice the motor's own in the band; up to some us
// in the interval where diodes stop. No heap.

#include <array>

#include "host_tools/simulation/brushed_dc_motor.hpp"
#include "host_tools/simulation/model_field.hpp"
#include "host_tools/simulation/synchronous_motor.hpp"

namespace kmax::simulation {

struct InverterConfig {
  double on_resistance = 2e-3;  // ohm per leg
  double diode_drop = 0.8;      // V
  // V at SH_x above which the gate driver does not start when EN_GATE rises (DRV8301 data sheet, 8.1.1, as
  // recalled; the data sheet was not at hand); 0: it always starts.
  double start_limit = 8.5;
};

inline constexpr std::array inverter_fields{
    ModelField<InverterConfig>{"on_resistance", &InverterConfig::on_resistance, 0.0, 10.0, "ohm",
                               "resistance of a leg"},
    ModelField<InverterConfig>{"diode_drop", &InverterConfig::diode_drop, 0.0, 5.0, "V",
                               "voltage of a conducting diode"},
    ModelField<InverterConfig>{"start_limit", &InverterConfig::start_limit, 0.0, 100.0, "V",
                               "voltage at a motor terminal above which the gate driver does not start",
                               "0: it always starts"},
};

struct LegCommand {
  bool enabled = false;  // false: both FETs off
  double duty = 0.0;     // share of the period with the upper FET on, 0 .. 1, before dead time
};

struct InverterCommand {
  std::array<LegCommand, terminal_count> legs{};
  double dead_time = 0.0;          // s, 0 .. 10 us
  double pwm_frequency = 20000.0;  // Hz, 1000 .. 1e6; matters with a dead time only
};

class Inverter {
 public:
  struct Flow {
    double charge = 0.0;       // C taken from the supply
    double mean_torque = 0.0;  // N m, of the motor, without cogging
  };

  // Throws std::invalid_argument.
  explicit Inverter(const InverterConfig& config = {});

  // `supply`: V >= 0, constant meanwhile. `duration`: s, above 0 up to 0.01. Throws std::invalid_argument for
  // a duty outside 0 .. 1, a dead time, frequency or supply that is not allowed, and anything that is not
  // finite. Instantiated for the two motors of this folder.
  template <typename Motor>
  Flow advance(Motor& motor, const InverterCommand& command, double supply, ShaftMotion shaft,
               double duration) const;

  // The share of its duty that a leg loses (positive current) or gains, at this current.
  static double dead_time_share(const InverterCommand& command, double duty, double current, double supply,
                                double loop_inductance);

  const InverterConfig& config() const { return config_; }

 private:
  InverterConfig config_;
};

// Throws std::invalid_argument.
void validate(const InverterCommand& command);

}  // namespace kmax::simulation
