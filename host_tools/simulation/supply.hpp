#pragma once
// The supply of a board: a voltage source behind a resistance, the bus capacitor, a brake resistor switched
// by the board, and the divider through which the board measures the bus.
//
//   C dV/dt = (E - V)/R - I - brake duty x V / R_brake
//
// I is what the inverters draw; motors that brake return it (I < 0). A bench supply cannot take it back: it
// stops conducting while V > E, and the bus is pumped up. With `absorbs` (a battery) it conducts both ways.
// Disconnected it gives nothing. The bus does not fall below 0 V.
//
// Use: during an interval every inverter reads voltage(), which stays as it is, and adds its charge by
// draw(); one advance() then ends the interval for all. Within it the equation is solved exactly
// (exponentials, the moment where the source stops or begins located), I taken as constant. That the
// inverters saw the voltage of the interval's beginning costs an error of half the voltage's change within
// it, 0.13 V for 10 A, 1 mF and 25 us.
//
// Cost of advance(): 40 ns (an exponential).

#include <array>

#include "board/odrive_v3/voltage_variant.hpp"
#include "host_tools/simulation/model_field.hpp"

namespace kmax::simulation {

// Defaults: a 24 V bench supply with its cable on an ODrive v3.6, 24 V variant, with a 2 ohm brake resistor.
struct SupplyConfig {
  double voltage = 24.0;          // V, E
  double resistance = 0.05;       // ohm, R
  double capacitance = 1e-3;      // F, C
  double brake_resistance = 2.0;  // ohm
  // Bus voltage per voltage at the converter's pin.
  double divider_ratio =
      static_cast<double>(board::odrive_v3::supply_divider_ratio(board::odrive_v3::VoltageVariant::v24));
  bool absorbs = false;      // the source takes current back
  bool part_ratings = true;  // the board's parts break (SceneDrives)
};

inline constexpr std::array supply_fields{
    ModelField<SupplyConfig>{"voltage", &SupplyConfig::voltage, 0.0, 1000.0, "V", "E, voltage of the source"},
    ModelField<SupplyConfig>{"resistance", &SupplyConfig::resistance, 1e-4, 1000.0, "ohm",
                             "R, of source and cable"},
    ModelField<SupplyConfig>{"capacitance", &SupplyConfig::capacitance, 1e-6, 10.0, "F",
                             "C, of the bus capacitor"},
    ModelField<SupplyConfig>{"brake_resistance", &SupplyConfig::brake_resistance, 0.01, 1000.0, "ohm",
                             "brake resistor"},
    ModelField<SupplyConfig>{
        "divider_ratio", &SupplyConfig::divider_ratio, 1.0, 1000.0, "",
        "bus voltage per voltage at the converter pin; 11: the 24 V board, 19: the 56 V board"},
};

class Supply {
 public:
  // Begins connected, the capacitor charged to E. Throws std::invalid_argument.
  explicit Supply(const SupplyConfig& config = {});

  void disconnect() { connected_ = false; }
  void connect() { connected_ = true; }
  bool connected() const { return connected_; }

  // Sets E, V. Throws std::invalid_argument.
  void set_source(double voltage);
  // Puts the capacitor's voltage there, V >= 0. Throws std::invalid_argument.
  void set_voltage(double voltage);
  // Share of the time in which the brake resistor is switched on, 0 .. 1. Throws std::invalid_argument.
  void set_brake(double duty);

  // Charge taken from the bus in the present interval, C; negative: returned. Throws std::invalid_argument
  // unless finite.
  void draw(double charge);

  // Ends the interval, s, above 0 up to 10. Throws std::invalid_argument.
  void advance(double duration);

  double voltage() const { return voltage_; }              // V, of the bus
  double pin_voltage() const;                              // V, behind the divider, bounded to 3.3
  double source_current() const;                           // A, now
  double source_charge() const { return source_charge_; }  // C given by the source since the beginning
  double brake_energy() const { return brake_energy_; }    // J turned into heat in the brake resistor
  const SupplyConfig& config() const { return config_; }

 private:
  double piece(double duration, double load, bool conducts);
  bool source_conducts(double load) const;

  SupplyConfig config_;
  bool connected_ = true;
  double voltage_ = 0.0;
  double brake_duty_ = 0.0;
  double drawn_ = 0.0;
  double source_charge_ = 0.0;
  double brake_energy_ = 0.0;
};

}  // namespace kmax::simulation
