#include "host_tools/simulation/inverter.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace kmax::simulation {
namespace {

constexpr double diode_step = 12.5e-6;           // s
constexpr double band_share = 0.5;               // of a PWM period; the band's time constant is a whole one
constexpr double fine_turn = 0.1;                // rad of the electrical angle in a fine step
constexpr double no_current = 1e-9;              // A; what a diode does not notice
constexpr int bisections = 30;                   // 2^-30 = 1e-9
constexpr int most_inverter_steps = 10'000'000;  // per call; more is a defect of this file

enum class Path : unsigned char { absent, blocked, leg, lower_diode, upper_diode };

// One call of Inverter::advance.
template <typename Motor>
class Propagation {
 public:
  Propagation(Motor& motor, const InverterConfig& config, const InverterCommand& command, double supply)
      : motor_(motor),
        config_(config),
        command_(command),
        supply_(supply),
        inductance_(motor.loop_inductance()) {
    drive_.leg_resistance = config.on_resistance;
    for (std::size_t k = 0; k < terminal_count; ++k) all_on_ &= !motor.wired(k) || command.legs[k].enabled;
  }

  Inverter::Flow over(ShaftMotion shaft, double duration) {
    if (idle(shaft.speed)) {
      motor_.advance(drive_, shaft, duration);
      return {};
    }
    if (all_on_ && command_.dead_time == 0.0) {
      choose_paths(shaft);
      set_voltages(motor_.currents());
      motor_.advance(drive_, shaft, duration);
      account(duration);
    } else {
      double left = duration;
      for (int step = 0; left > 1e-12 * duration; ++step) {
        if (step == most_inverter_steps) throw std::logic_error("inverter: too many steps");
        const double used = advance_step(shaft, left);
        left -= used;
        shaft.angle += shaft.speed * used;
      }
    }
    flow_.mean_torque /= duration;
    return flow_;
  }

 private:
  bool idle(double speed) const {
    for (std::size_t k = 0; k < terminal_count; ++k) {
      if (motor_.wired(k) && command_.legs[k].enabled) return false;
    }
    const TerminalValues i = motor_.currents();
    return i[0] == 0.0 && i[1] == 0.0 && i[2] == 0.0 &&
           motor_.largest_induced(speed) <= supply_ + 2.0 * config_.diode_drop;
  }

  // Advances by one step of at most `left`; returns its length.
  double advance_step(const ShaftMotion& shaft, double left) {
    choose_paths(shaft);
    const TerminalValues first = motor_.currents();
    const bool in_band = any_in_band(first);
    double step = all_on_ && !in_band ? left : std::min(left, fine(shaft.speed));
    const Motor before = motor_;
    set_voltages(first);
    motor_.advance(drive_, shaft, step);
    if (in_band) {
      at_mean_currents(before, shaft, step);
    } else if (lost_differs(first, motor_.mean_currents()) || lost_differs(first, motor_.currents())) {
      step = std::min(left, fine(shaft.speed));
      motor_ = before;
      motor_.advance(drive_, shaft, step);
      at_mean_currents(before, shaft, step);
    }
    if (reversed_diode() < terminal_count) {
      step = stop_at_zero(before, shaft, step);
    } else {
      fresh_.fill(false);
    }
    account(step);
    return step;
  }

  // Repeats the step with the dead time's error at the mean currents that it had.
  void at_mean_currents(const Motor& before, const ShaftMotion& shaft, double step) {
    set_voltages(motor_.mean_currents());
    motor_ = before;
    motor_.advance(drive_, shaft, step);
  }

  double fine(double speed) const {
    const double turning = std::abs(motor_.electrical_speed(speed));
    const double longest = all_on_ ? band_share / command_.pwm_frequency
                                   : std::min(diode_step, band_share / command_.pwm_frequency);
    return turning * longest > fine_turn ? fine_turn / turning : longest;
  }

  void choose_paths(const ShaftMotion& shaft) {
    const TerminalValues i = motor_.currents();
    std::size_t conducting = 0, blocked = 0;
    for (std::size_t k = 0; k < terminal_count; ++k) {
      path_[k] = !motor_.wired(k)           ? Path::absent
                 : command_.legs[k].enabled ? Path::leg
                 : i[k] > no_current        ? Path::lower_diode
                 : i[k] < -no_current       ? Path::upper_diode
                                            : Path::blocked;
      conducting += path_[k] > Path::blocked ? 1 : 0;
      blocked += path_[k] == Path::blocked ? 1 : 0;
    }
    if (blocked > 0) unblock(shaft, conducting);
    for (std::size_t k = 0; k < terminal_count; ++k) drive_.conducting[k] = path_[k] > Path::blocked;
  }

  // Lets blocked legs conduct whose terminal would be beyond a rail. A leg that was stopped in the step
  // before stays blocked for this one: its current has just ended.
  void unblock(const ShaftMotion& shaft, std::size_t conducting) {
    const TerminalValues e = motor_.induced(shaft);
    const double top = supply_ + config_.diode_drop, bottom = -config_.diode_drop;
    if (conducting == 0) {
      std::size_t high = terminal_count, low = terminal_count;
      for (std::size_t k = 0; k < terminal_count; ++k) {
        if (path_[k] != Path::blocked || fresh_[k]) continue;
        if (high == terminal_count || e[k] > e[high]) high = k;
        if (low == terminal_count || e[k] < e[low]) low = k;
      }
      if (high == terminal_count || e[high] - e[low] <= top - bottom) return;
      path_[high] = Path::upper_diode;
      path_[low] = Path::lower_diode;
      return;
    }
    set_voltages(motor_.currents());
    // The conducting terminals' voltages less what is induced in them: the star point's.
    double star = 0.0;
    for (std::size_t k = 0; k < terminal_count; ++k) {
      if (path_[k] > Path::blocked) star += (drive_.voltage[k] - e[k]) / static_cast<double>(conducting);
    }
    for (std::size_t k = 0; k < terminal_count; ++k) {
      if (path_[k] != Path::blocked || fresh_[k]) continue;
      if (star + e[k] > top) path_[k] = Path::upper_diode;
      if (star + e[k] < bottom) path_[k] = Path::lower_diode;
    }
  }

  double lost(std::size_t k, double current) const {
    return Inverter::dead_time_share(command_, command_.legs[k].duty, current, supply_, inductance_);
  }

  bool any_in_band(const TerminalValues& currents) const {
    if (command_.dead_time == 0.0) return false;
    const double whole = command_.dead_time * command_.pwm_frequency;
    for (std::size_t k = 0; k < terminal_count; ++k) {
      if (path_[k] == Path::leg && std::abs(lost(k, currents[k])) < whole && switches(k)) return true;
    }
    return false;
  }

  bool switches(std::size_t k) const { return command_.legs[k].duty > 0.0 && command_.legs[k].duty < 1.0; }

  bool lost_differs(const TerminalValues& a, const TerminalValues& b) const {
    if (command_.dead_time == 0.0) return false;
    for (std::size_t k = 0; k < terminal_count; ++k) {
      if (path_[k] == Path::leg && lost(k, a[k]) != lost(k, b[k])) return true;
    }
    return false;
  }

  void set_voltages(const TerminalValues& currents) {
    for (std::size_t k = 0; k < terminal_count; ++k) {
      share_[k] = 0.0;
      switch (path_[k]) {
        case Path::leg:
          share_[k] = std::clamp(command_.legs[k].duty - lost(k, currents[k]), 0.0, 1.0);
          drive_.voltage[k] = share_[k] * supply_;
          break;
        case Path::lower_diode:
          drive_.voltage[k] = -config_.diode_drop;
          break;
        case Path::upper_diode:
          share_[k] = 1.0;
          drive_.voltage[k] = supply_ + config_.diode_drop;
          break;
        case Path::absent:
        case Path::blocked:
          break;
      }
    }
  }

  // A terminal whose diode has a current against its direction; terminal_count: none.
  std::size_t reversed_diode() const {
    const TerminalValues i = motor_.currents();
    std::size_t worst = terminal_count;
    double most = no_current;
    for (std::size_t k = 0; k < terminal_count; ++k) {
      const double against = path_[k] == Path::lower_diode   ? -i[k]
                             : path_[k] == Path::upper_diode ? i[k]
                                                             : 0.0;
      if (against > most) {
        most = against;
        worst = k;
      }
    }
    return worst;
  }

  // The end of the first current that reverses within the step; returns the time until then.
  double stop_at_zero(const Motor& before, const ShaftMotion& shaft, double step) {
    double early = 0.0, late = 1.0;
    for (int n = 0; n < bisections; ++n) {
      const double middle = 0.5 * (early + late);
      motor_ = before;
      motor_.advance(drive_, shaft, middle * step);
      (reversed_diode() < terminal_count ? late : early) = middle;
    }
    motor_ = before;
    motor_.advance(drive_, shaft, late * step);
    fresh_.fill(false);
    for (std::size_t k = reversed_diode(); k < terminal_count; k = reversed_diode()) {
      path_[k] = Path::blocked;
      fresh_[k] = true;
      motor_.stop_currents({path_[0] <= Path::blocked, path_[1] <= Path::blocked, path_[2] <= Path::blocked});
    }
    return late * step;
  }

  void account(double step) {
    const TerminalValues mean = motor_.mean_currents();
    for (std::size_t k = 0; k < terminal_count; ++k) flow_.charge += share_[k] * mean[k] * step;
    flow_.mean_torque += motor_.mean_torque() * step;
  }

  Motor& motor_;
  const InverterConfig& config_;
  const InverterCommand& command_;
  const double supply_;
  const double inductance_;
  bool all_on_ = true;
  std::array<Path, terminal_count> path_{};
  std::array<bool, terminal_count> fresh_{};
  TerminalValues share_{};
  TerminalDrive drive_;
  Inverter::Flow flow_;
};

}  // namespace

void validate(const InverterCommand& command) {
  for (std::size_t k = 0; k < terminal_count; ++k) {
    const double duty = command.legs[k].duty;
    if (!(duty >= 0.0 && duty <= 1.0)) {
      throw std::invalid_argument(
          fmt::format("duty of leg {} = {}: allowed is 0 to 1", static_cast<char>('A' + k), duty));
    }
  }
  if (!(command.dead_time >= 0.0 && command.dead_time <= 10e-6)) {
    throw std::invalid_argument(fmt::format("dead time = {} s: allowed is 0 to 1e-5 s", command.dead_time));
  }
  if (!(command.pwm_frequency >= 1e3 && command.pwm_frequency <= 1e6)) {
    throw std::invalid_argument(
        fmt::format("PWM frequency = {} Hz: allowed is 1000 to 1e6 Hz", command.pwm_frequency));
  }
}

Inverter::Inverter(const InverterConfig& config) : config_(config) {
  require_allowed(config, std::span<const ModelField<InverterConfig>>(inverter_fields), "inverter");
}

double Inverter::dead_time_share(const InverterCommand& command, double duty, double current, double supply,
                                 double loop_inductance) {
  if (command.dead_time == 0.0 || duty <= 0.0 || duty >= 1.0) return 0.0;
  const double whole = command.dead_time * command.pwm_frequency;
  const double band = supply * command.dead_time / loop_inductance;
  if (std::abs(current) >= band) return current > 0.0 ? whole : current < 0.0 ? -whole : 0.0;
  return whole * (current / band);
}

template <typename Motor>
Inverter::Flow Inverter::advance(Motor& motor, const InverterCommand& command, double supply,
                                 ShaftMotion shaft, double duration) const {
  validate(command);
  if (!(supply >= 0.0 && supply <= 1e4) || !std::isfinite(shaft.angle) || !(std::abs(shaft.speed) <= 1e5) ||
      !(duration > 0.0 && duration <= 0.01)) {
    throw std::invalid_argument(fmt::format(
        "inverter: supply = {} V, shaft at {} rad with {} rad/s, duration = {} s: allowed are 0 to 1e4 V, "
        "finite angles, speeds up to 1e5 rad/s, durations up to 0.01 s",
        supply, shaft.angle, shaft.speed, duration));
  }
  return Propagation<Motor>(motor, config_, command, supply).over(shaft, duration);
}

template Inverter::Flow Inverter::advance(BrushedDcMotor&, const InverterCommand&, double, ShaftMotion,
                                          double) const;
template Inverter::Flow Inverter::advance(SynchronousMotor&, const InverterCommand&, double, ShaftMotion,
                                          double) const;

}  // namespace kmax::simulation
