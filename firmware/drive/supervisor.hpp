#pragma once

#include <array>
#include <concepts>
#include <cstdint>
#include <optional>

#include "firmware/board_interface/board_readings.hpp"
#include "firmware/drive/armed_axes.hpp"
#include "firmware/drive/axis.hpp"
#include "firmware/drive/axis_state_machine.hpp"
#include "firmware/drive/commutation.hpp"
#include "firmware/drive/link_states.hpp"
#include "firmware/drive/thermal_supervisor.hpp"

namespace kmax::firmware {

/// How an axis loses its force when its commander is lost; the numbers are those of link.loss.
enum class LinkLoss : std::uint8_t {
  limp = 0,  ///< at once
  ramp = 1,  ///< evenly within force.ramp_time
  damp = 2,  ///< at once, and the motor's shorted winding brakes the handle until it stands
};

/// The main loop's judgement of one axis: what trips it, whether it may be armed, and which commands it
/// obeys. No failure; what goes wrong becomes a fault or a refusal.
///
/// An armed axis belongs to its commander: the link whose controlword armed it, and on that link, if
/// that link had written a drive.commander other than 0 for it, whoever knows that number. Only the
/// commander's silence, bus-off or NMT stop counts, and nobody else's signs of life keep the axis armed.
/// Others can disarm it, halt it, and tighten its bounds (armed_change.hpp).
///
/// When the commander is lost (link_silent, bus_off, heartbeat_lost), link.loss says how the force goes;
/// until it is gone the axis is in "fault reaction active" and counts as armed for all that may not change
/// then. Any other fault, a controlword that does not ask for operation, whoever writes it, NMT stop and
/// reset, and two seconds end it at once. Mode excitation always loses its force at once.
class Supervisor {
 public:
  /// All that an axis which makes force is judged by. It refers to what its owner brings up to date before
  /// each poll().
  struct Situation {
    ParameterValues& values;
    Commutation& commutation;
    const ThermalSupervisor& thermal;
    const AxisReport& report;    ///< the tick's
    const AxisSetting& setting;  ///< in force
    const BoardReadings& readings;
    const LinkStates& links;
    const std::uint32_t& now_us;
  };
  /// What arming is judged by beside it.
  struct Readiness {
    bool settled;  ///< the tick works by the present settings, and knows of the axis' last disarming
    bool commutation_known, guard_failed, store_busy, restarting;
    bool absent;                ///< the board does not have this axis
    bool pushes_anothers_axis;  ///< if it were armed: of one that another link has armed
  };
  /// The last trip, and the temperatures then.
  struct Trip {
    TripRecord record;
    float value = 0.0f, bound = 0.0f;  ///< in the fault's unit
    float power_stage_temperature = 0.0f, winding_temperature = 0.0f;
  };

  Supervisor() { machine_.initialised(); }

  /// A controlword; it supersedes one that still waits. Whoever wrote it commands, unless the axis is armed:
  /// then it keeps its commander.
  void request(const Controlword& controlword, std::uint32_t now_us) {
    if (waiting_) machine_.pass_over(waiting_->word, waiting_->by);
    waiting_ = controlword;
    if (makes_force()) return;
    commander_ = controlword.by;
    number_ = next_number_[static_cast<std::size_t>(controlword.by)];
    signed_us_ = now_us;
  }
  /// A controlword that was refused.
  void pass_over(std::uint16_t word, Link by) { machine_.pass_over(word, by); }
  /// drive.commander was written: the number of that link's next attempt to arm.
  void set_next_number(Link link, std::uint16_t number) {
    next_number_[static_cast<std::size_t>(link)] = number;
  }
  Link commander() const { return commander_; }
  /// link.sign_of_life was written.
  void take_sign_of_life(Link link, std::uint16_t number, std::uint32_t now_us) {
    if (link == commander_ && number == number_) signed_us_ = now_us;
  }
  /// In every poll, and after every controlword. `readiness()` is asked for while a controlword waits.
  template <std::invocable Ask>
  void poll(const Situation& now, std::size_t axis, Ask readiness) {
    // Before the commands: a fault is reported even if the host disarms in the same moment.
    if (armed())
      watch(now, axis);
    else if (reaction_)
      go_on_with_reaction(now);
    if (waiting_) [[unlikely]]
      obey(now, readiness(), axis);
    if (claimed_ && !makes_force()) [[unlikely]]
      give_back(now.values, axis);
  }
  [[gnu::cold]] void trip(const Situation& now, std::size_t axis, Fault fault, float value, float bound);
  /// After poll(), when the tick knows whether the axis makes force.
  void finish_reaction() {
    if (!reaction_) machine_.reaction_done();
  }
  /// At once, and without a controlword.
  void disarm() {
    waiting_.reset();
    reaction_.reset();
    machine_.disable();
  }

  const AxisStateMachine& machine() const { return machine_; }
  bool armed() const { return machine_.armed(); }
  /// Armed, or its force is fading.
  bool makes_force() const { return armed() || reaction_.has_value(); }
  /// See Axis::Command::share.
  float force_share() const { return reaction_ ? reaction_->share : 1.0f; }
  const Trip& last_trip() const { return trip_; }
  /// Halt, as the last controlword that was obeyed says.
  bool is_halted() const { return halted_; }

 private:
  void watch(const Situation& now, std::size_t axis);
  [[gnu::cold]] void obey(const Situation& now, const Readiness& readiness, std::size_t axis);
  [[gnu::cold]] void give_back(ParameterValues& values, std::size_t axis);
  [[gnu::cold]] void begin_reaction(const Situation& now, std::size_t axis);
  [[gnu::cold]] void go_on_with_reaction(const Situation& now);
  // Rare: small code rather than fast code.
  [[gnu::cold]] Refusal obstacle_to_arming(const Situation& now, const Readiness& readiness,
                                           std::size_t axis) const;
  [[gnu::cold]] bool cause_remains(const Situation& now) const;

  /// The way from a lost commander to no force. Times are the tick's.
  struct Reaction {
    LinkLoss kind;
    std::uint32_t began, moved_last;
    float ramp;  ///< ticks, as it was then
    float share{};
  };

  AxisStateMachine machine_;
  std::optional<Reaction> reaction_;
  std::optional<Controlword> waiting_;  ///< until the settings have arrived, if it asks to enable
  Trip trip_;
  Link commander_ = Link::serial;
  std::uint16_t number_ = 0;  ///< of the commander
  std::array<std::uint16_t, link_count> next_number_{};
  std::uint32_t signed_us_{};  ///< when a commander with a number gave its last sign of life
  bool claimed_ = false;       ///< somebody has armed it, or tried to: the next one's number is another
  bool halted_ = false;        ///< who does not command, or no longer, may begin a halt and not end it
};

}  // namespace kmax::firmware
