#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <utility>

#include "drivers/periodic_timer.hpp"
#include "firmware/board_interface/board_readings.hpp"
#include "firmware/command/fault_log.hpp"
#include "firmware/command/store_commands.hpp"
#include "firmware/drive/axes_settings.hpp"
#include "firmware/drive/axes_tick.hpp"
#include "firmware/drive/link_states.hpp"
#include "firmware/drive/stability_guard.hpp"
#include "firmware/drive/supervisor.hpp"

namespace kmax::firmware {

/// All axes as the main loop has them: their tick, when it gets new settings, who commands each axis and what
/// trips it.
///
/// In every poll begin_poll(), then what the hosts write, then act(). Main loop only, but for tick()'s ISR_
/// functions. No failure; what goes wrong becomes a fault of an axis or a refusal.
class Axes {
 public:
  /// The main loop's rhythm.
  static constexpr std::uint32_t round_ticks = AxesTick<axis_count>::round_ticks;
  static constexpr std::uint32_t round_interval_us = round_ticks * 1'000'000 / tick_rate_hz;

  /// `capture_memory`: see AxesTick.
  Axes(ParameterAccess& parameters, const StoreCommands& store, const LinkStates& links, FaultLog& log,
       std::span<std::uint32_t> capture_memory);
  Axes(const Axes&) = delete;
  Axes& operator=(const Axes&) = delete;

  /// Before begin_poll(), as often as they change.
  void set_readings(const BoardReadings& readings) {
    if (readings.modulation_limit != readings_.modulation_limit ||
        readings.has_power_stage != readings_.has_power_stage)
      ++readings_changes_;
    readings_ = readings;
  }
  /// Takes the tick's reports over, so that all that is judged in this poll is of one moment.
  void begin_poll(std::uint32_t now_us);
  /// Obeys the controlwords that have been written, and judges. At the end of the poll, and at once when a
  /// controlword was written: each acts as if it had come alone, by the settings that came before it.
  void act();
  [[gnu::cold]] void offer_settings_if_changed();
  /// What mode torque asks for, as it is written now.
  void command_forces();
  /// At once, and without a controlword.
  void disarm(std::size_t axis);
  /// Of those that `link` commands.
  void trip_all_of(Link link, Fault fault);

  /// What was written just now names `by` as the next commander, or is its sign of life.
  void note_commander(std::span<const SlotValue> written, Link by);
  /// What was refused, since another link commands: a host that goes on sending it when that one has disarmed
  /// holds it, and it arms nothing.
  void pass_over(std::span<const SlotValue> refused, Link by);

  std::uint32_t now_us() const { return now_us_; }
  /// Those that make force, also while it fades or brakes.
  ArmedAxes armed() const;
  bool any_armed() const { return armed().any(); }
  const Supervisor& supervisor(std::size_t axis) const { return supervisors_[axis]; }
  /// Rises when an axis' fault comes or goes.
  std::uint32_t fault_changes() const { return fault_changes_; }
  /// The tick's, as it was when this poll began.
  const AxisReport& report(std::size_t axis) const { return report_[axis]; }
  const ThermalSupervisor& thermal(std::size_t axis) const { return thermal_[axis]; }
  const AxesSettings::Scale& scale(std::size_t axis) const { return settings_.scale(axis); }
  const BoardReadings& readings() const { return readings_; }
  /// By the present parameters.
  const GuardFinding& guard(std::size_t axis) {
    judge_if_changed();
    return guard_[axis];
  }
  /// The rotor's angle is known, or nobody asks for it.
  bool commutation_known(std::size_t axis) const;

  /// Each fault of an axis is in it by the end of the poll that finds it.
  FaultLog& log() { return log_; }

  AxesTick<axis_count>& tick() { return tick_; }
  const AxesTick<axis_count>& tick() const { return tick_; }

 private:
  /// What settings, commutation and the guard's findings were last made from, as far as it changes by itself.
  struct SeenOfAxis {
    std::uint32_t temperatures, reference_generation;
    bool referenced;
  };
  struct Seen {
    std::uint32_t parameters, faults, readings;
    std::array<SeenOfAxis, axis_count> axis;
  };
  template <std::size_t... axis>
  std::array<Supervisor::Situation, axis_count> situations(std::index_sequence<axis...>) {
    return {situation(axis)...};
  }
  bool circumstances_have_changed() const;
  // Rare: small code rather than fast code.
  [[gnu::cold]] void follow_circumstances();
  [[gnu::cold]] void poll_temperatures();
  void configure_thermal();
  void judge_if_changed();
  [[gnu::cold]] void log_trip(std::size_t axis);
  bool settled(std::size_t axis) const;
  bool pushes_anothers_axis(std::size_t axis) const;
  AxesSettings::Circumstances circumstances_of(std::size_t axis) const;
  Supervisor::Situation situation(std::size_t axis);
  [[gnu::cold]] Supervisor::Readiness readiness(std::size_t axis) const;

  ParameterAccess& parameters_;
  const StoreCommands& store_;
  const LinkStates& links_;
  FaultLog& log_;
  BoardReadings readings_;
  std::uint32_t now_us_ = 0;
  drivers::PeriodicTimer temperatures_timer_{1'000};
  std::array<Supervisor, axis_count> supervisors_;
  std::array<Fault, axis_count> logged_{};  ///< the faults that there were when it was last looked
  std::uint32_t fault_changes_ = 0;
  std::array<ThermalSupervisor, axis_count> thermal_;
  std::array<Commutation, axis_count> commutation_;
  std::array<GuardFinding, axis_count> guard_{};
  std::uint32_t judged_changes_ = 0;
  std::array<AxisReport, axis_count> report_;
  std::uint32_t offered_changes_ = 0;
  std::uint32_t readings_changes_ = 1;  ///< not yet followed
  Seen seen_{};
  AxesSettings settings_;
  // Aligned, an address within it is one immediate: two instructions a tick less than at an odd place.
  alignas(64) AxesTick<axis_count> tick_;
  const std::array<Supervisor::Situation, axis_count> situations_;
};

}  // namespace kmax::firmware
