#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <utility>
#include <vector>

#include "drivers/stm32f4/registers/adc.hpp"
#include "tests/image/faults/fault_bench.hpp"

namespace kmax::tests {

enum class Hits { axis, both };

/// A fault that the virtual board can make.
struct Cause {
  const char* name;
  std::function<void(FaultBench&, std::size_t axis)> make, mend;
  Hits hits;
  firmware::Fault fault;      ///< of an armed axis; none: nothing can notice it
  double ticks;               ///< from the cause to the bridge's end
  firmware::Refusal refusal;  ///< of arming while it lasts; none: nothing shows it before current flows

  enum class Ends : std::uint8_t {
    when_mended,
    at_once,         ///< a moment, and nothing to mend
    by_a_new_start,  ///< for the firmware, after it has been mended
  } ends = Ends::when_mended;
  std::function<void(FaultBench&)> prepare{};  ///< the bench, before all else
  /// not_seen: not before the handle has moved while all was well. not_made: the board could not.
  enum class AtStart : std::uint8_t { seen, not_seen, not_made } at_start = AtStart::seen;
};

/// Ticks until a bridge is off whose line does it, without the processor.
inline constexpr double by_line = 0.1;

namespace fault_causes_detail {
using firmware::Fault;
using firmware::Refusal;
using simulation::Defect;
using simulation::TemperatureSensor;
using Bench = FaultBench;

inline constexpr double no_tick = 0.8, tick = 1.3, supply_tick = 1.8, slow_tick = 100;
// The patience of PhaseWatch at the default bandwidth, two looks and what is left of a tick.
inline constexpr double wire = 42;

inline void plant(Bench& bench, std::size_t axis, Defect defect) {
  bench.world.drives().plant(axis, defect);
}
inline void mend(Bench& bench, std::size_t axis, Defect defect) {
  bench.world.drives().mend(axis, defect);
}
inline Cause defect(const char* name, Defect which, Fault fault, double ticks, Refusal refusal) {
  return {name,
          [which](Bench& b, std::size_t a) { plant(b, a, which); },
          [which](Bench& b, std::size_t a) { mend(b, a, which); },
          Hits::axis,
          fault,
          ticks,
          refusal};
}
inline Cause thermistor(const char* name, TemperatureSensor::Wiring wiring) {
  return {
      name,
      [wiring](Bench& b, std::size_t a) { b.world.temperature(a).set_wiring(wiring); },
      [](Bench& b, std::size_t a) { b.world.temperature(a).set_wiring(TemperatureSensor::Wiring::intact); },
      Hits::axis,
      Fault::over_temperature,
      slow_tick,
      Refusal::too_hot};
}
inline Cause chip(const char* name, drivers::Drv8301Fault fault) {
  return {name,
          [fault](Bench& b, std::size_t a) {
            b.board->gate_driver(a).set_condition(fault, true, b.board->now());
          },
          [fault](Bench& b, std::size_t a) {
            b.board->gate_driver(a).set_condition(fault, false, b.board->now());
          },
          Hits::both,
          Fault::gate_driver,
          by_line,
          Refusal::gate_driver_fault};
}
inline Cause source(const char* name, double volts, Fault fault, double ticks, Refusal refusal) {
  return {name,
          [volts](Bench& b, std::size_t) {
            b.world.supply().set_source(volts);
            b.world.supply().set_voltage(volts);
            // The chips feel it at once; the board's model looks at them every 25 us.
            for (std::size_t axis = 0; volts < 5.9 && axis < 2; ++axis)
              b.board->gate_driver(axis).set_condition(drivers::Drv8301Fault::supply_under_voltage, true,
                                                       b.board->now());
          },
          [](Bench& b, std::size_t) {
            b.world.supply().set_source(24.0);
            b.world.supply().set_voltage(24.0);
          },
          Hits::both,
          fault,
          ticks,
          refusal};
}

using Channel = simulation::CurrentSensor::Channel;
/// `volts`: from what the pin shows without a current.
inline Cause sensor(const char* name, Channel channel, double volts, Fault fault, double ticks,
                    Refusal refusal) {
  return {name,
          [channel, volts](Bench& b, std::size_t a) {
            auto& sensor = b.world.drive(a).current_sensor();
            const auto& config = sensor.config();
            sensor.set_stuck(channel,
                             1.65 + volts + (channel == Channel::b ? config.offset_b : config.offset_c));
          },
          [channel](Bench& b, std::size_t a) {
            b.world.drive(a).current_sensor().set_stuck(channel, std::nullopt);
          },
          Hits::axis,
          fault,
          ticks,
          refusal};
}
inline Cause moment(const char* name, std::function<void(Bench&, std::size_t)> make, Hits hits, Fault fault,
                    double ticks) {
  return {name,  std::move(make), [](Bench&, std::size_t) {}, hits, fault,
          ticks, Refusal::none,   Cause::Ends::at_once};
}

}  // namespace fault_causes_detail

/// All of them, in the order of the page.
inline std::vector<Cause> fault_causes() {
  using namespace fault_causes_detail;
  Cause plug =
      defect("encoder's plug off", Defect::encoder_unplugged, Fault::encoder, tick, Refusal::encoder_invalid);
  plug.ticks += 2.0;  // the third look in a row says so (drivers/quadrature_index_watch.hpp)
  plug.ends = Cause::Ends::by_a_new_start;
  plug.at_start = Cause::AtStart::not_seen;
  Cause converters{"converters stand still",
                   [](Bench& b, std::size_t) {
                     using namespace drivers::stm32f4;
                     b.board->chip().bus().write(adc_base + adc_stride + offsetof(AdcRegisters, cr2), 4, 0,
                                                 b.board->now());
                   },
                   [](Bench&, std::size_t) {},
                   Hits::both,
                   Fault::tick_missed,
                   no_tick,
                   Refusal::none};
  converters.ends = Cause::Ends::by_a_new_start;
  converters.at_start = Cause::AtStart::not_made;
  Cause silence = moment(
      "host on the serial line silent, link.timeout = 0.2 s", [](Bench&, std::size_t) {}, Hits::both,
      Fault::link_silent, 4100);
  silence.prepare = [](Bench& b) { b.write_real("link.timeout", 0, 0.2f); };
  return {
      silence,
      plug,
      sensor("current sensor at its rail", Channel::b, 2.0, Fault::current_sense, tick,
             Refusal::current_sense_invalid),
      sensor("current sensor C at its other rail", Channel::c, -2.0, Fault::current_sense, tick,
             Refusal::current_sense_invalid),
      sensor("current sensor at rest", Channel::b, 0.0, Fault::phase_open, slow_tick, Refusal::none),
      moment(
          "timer's break",
          [](Bench& b, std::size_t a) {
            b.board->chip().peripherals().advanced_timers[a].clock_failure_break(b.board->now());
          },
          Hits::axis, Fault::power_stage, by_line),
      moment(
          "gate driver: a FET carries too much",
          [](Bench& b, std::size_t a) {
            b.board->gate_driver(a).over_current(drivers::Drv8301Fault::over_current_b_low, b.board->now());
          },
          Hits::both, Fault::gate_driver, by_line),
      converters,
      defect("motor's wire B broken", Defect::phase_b_open, Fault::phase_open, wire, Refusal::none),
      defect("motor's wire C broken", Defect::phase_c_open, Fault::phase_open, wire, Refusal::none),
      thermistor("thermistor's wire broken", TemperatureSensor::Wiring::open),
      thermistor("thermistor shorted", TemperatureSensor::Wiring::shorted),
      {"power stage at 130 degC",
       [](Bench& b, std::size_t a) { b.world.temperature(a).set_temperature(130.0); },
       [](Bench& b, std::size_t a) { b.world.temperature(a).set_temperature(25.0); }, Hits::axis,
       Fault::over_temperature, slow_tick, Refusal::too_hot},
      {"fault line held low", [](Bench& b, std::size_t) { b.board->hold_fault_line(true); },
       [](Bench& b, std::size_t) { b.board->hold_fault_line(false); }, Hits::both, Fault::gate_driver,
       by_line, Refusal::gate_driver_fault},
      chip("gate driver: its supply too low", drivers::Drv8301Fault::gate_supply_under_voltage),
      chip("gate driver: its supply too high", drivers::Drv8301Fault::gate_supply_over_voltage),
      chip("gate driver: the motor's supply too low for it", drivers::Drv8301Fault::supply_under_voltage),
      chip("gate driver: too hot", drivers::Drv8301Fault::over_temperature),
      {"emergency stop open", [](Bench& b, std::size_t) { b.board->open_emergency_stop(true); },
       [](Bench& b, std::size_t) { b.board->open_emergency_stop(false); }, Hits::both, Fault::emergency_stop,
       by_line, Refusal::emergency_stop},
      source("supply at 9 V", 9.0, Fault::under_voltage, supply_tick, Refusal::supply_out_of_range),
      source("supply at 5 V", 5.0, Fault::gate_driver, supply_tick, Refusal::gate_driver_fault),
      source("supply at 27 V", 27.0, Fault::over_voltage, supply_tick, Refusal::supply_out_of_range),
  };
}

}  // namespace kmax::tests
