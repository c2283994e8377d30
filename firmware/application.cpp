// The main-loop side of the application.
#include "firmware/application.hpp"

#include "firmware/drive/haptic_configuration.hpp"

namespace kmax::firmware {

namespace {
modbus::RtuPortConfig port_configuration(const ParameterValues& values) {
  modbus::RtuPortConfig config;
  config.unit = static_cast<std::uint8_t>(values.whole<"modbus.unit">());
  config.baud_rate = static_cast<std::uint32_t>(values.whole<"modbus.baud_rate">());
  config.half_duplex = false;  // separate wires for both directions
  return config;
}
}  // namespace

Application::Application(const BoardIdentity& board, std::span<std::uint32_t> capture_memory)
    : board_(board),
      bank_(*this),
      port_(bank_, port_configuration(parameters_.values())),
      settings_(make_settings()),
      objects_({.application = *this,
                .parameters = parameters_,
                .store = store_,
                .tick = tick_,
                .node = node_,
                .board_name = board.board_name}),
      node_(objects_,
            {.vendor = vendor_id,
             .product = product_code,
             .revision = firmware_version,
             .serial = board.serial_number},
            round_interval_us),
      tick_(settings_, capture_memory) {
  configure_thermal();
  make_scales();
  start_communication(true);
  refresh_readings();
}

ArmedAxes Application::armed_axes() const {
  ArmedAxes armed;
  for (std::size_t axis = 0; axis < axis_count; ++axis) armed.axis[axis] = supervisors_[axis].armed();
  return armed;
}

Application::Settings Application::make_settings() const {
  Settings settings;
  const ParameterValues& values = parameters_.values();
  for (std::size_t axis = 0; axis < axis_count; ++axis) {
    settings[axis].encoder_offset = values.whole<"encoder.offset">(axis);
    settings[axis].encoder_direction = values.whole<"encoder.direction">(axis);
    settings[axis].generation = generation_;
    // Near the position by the new origin: the resampler starts from there.
    const std::int64_t position = Axis::position_of(report_[axis].counted, settings[axis]);
    settings[axis].haptic = control::HapticLoop<float>::prepare(haptic_configuration(values, axis), position);
    const Circumstances now = offered_[axis];
    auto motor = motor_configuration(values, axis, now.winding_temperature, now.current_share);
    motor.modulation_limit = board_.modulation_limit;
    settings[axis].motor = MotorControl::prepare(motor);
    settings[axis].compensation =
        control::ForceCompensation<float>::prepare(compensation_configuration(values, axis));
    settings[axis].plausibility = control::MotionPlausibility<float>::prepare(
        plausibility_configuration(values, axis), 1.0f / static_cast<float>(tick_rate_hz));
    settings[axis].watch_motion = values.real<"device.hand_force">(axis) > 0.0f;
    settings[axis].excitation = Excitation::prepare(excitation_configuration(values, axis));
    settings[axis].mode = mode(axis);
    settings[axis].commutated = now.commutated;
    settings[axis].supply_voltage_min = values.real<"supply.voltage_min">();
    settings[axis].supply_voltage_max = values.real<"supply.voltage_max">();
  }
  return settings;
}

void Application::make_scales() {
  const ParameterValues& values = parameters_.values();
  for (std::size_t axis = 0; axis < axis_count; ++axis) {
    const double length = count_length(values, axis);
    const double step =
        control::resampler_step(static_cast<double>(values.real<"position.resolution">(axis)), length);
    scale_[axis] = {length, static_cast<float>(step * length)};
  }
}

void Application::offer_settings_if_changed() {
  std::array<Circumstances, axis_count> now;
  for (std::size_t axis = 0; axis < axis_count; ++axis) now[axis] = circumstances_of(axis);
  if (parameters_.changes() == offered_changes_ && now == offered_) return;
  offered_ = now;
  if (parameters_.changes() != offered_changes_) {
    configure_thermal();
    make_scales();
  }
  offered_changes_ = parameters_.changes();
  if (parameters_.restarting_changes() != offered_restarts_) {
    offered_restarts_ = parameters_.restarting_changes();
    ++generation_;
  }
  settings_ = make_settings();
  tick_.offer(settings_);
  port_.configure(port_configuration(parameters_.values()));
  tick_.trace_axis(static_cast<std::size_t>(parameters_.values().whole<"trace.axis">()),
                   static_cast<std::uint32_t>(parameters_.values().whole<"trace.interval">()));
}

/// So that readings and arming never go by an older set, and nothing is worked out twice.
void Application::judge_if_changed() {
  if (parameters_.changes() == judged_changes_) return;
  judged_changes_ = parameters_.changes();
  for (std::size_t axis = 0; axis < axis_count; ++axis)
    guard_[axis] = guard_finding(parameters_.values(), axis);
}

/// The tick works by the present settings, and knows of the axis' last disarming.
bool Application::settled(std::size_t of_axis) const {
  if (!tick_.settings_taken() || report_[of_axis].enabled) return false;
  for (const AxisReport& axis : report_) {
    if (axis.generation != generation_) return false;
  }
  return true;
}

Application::Circumstances Application::circumstances_of(std::size_t axis) const {
  return {thermal_[axis].allowance(), thermal_[axis].resistance_temperature(), commutation_known(axis)};
}

void Application::configure_thermal() {
  for (std::size_t axis = 0; axis < axis_count; ++axis)
    thermal_[axis].configure(thermal_configuration(parameters_.values(), axis));
}

void Application::poll_temperatures() {
  for (std::size_t axis = 0; axis < axis_count; ++axis)
    thermal_[axis].poll(now_us_, report_[axis].motor.current_square, readings_.power_stage_temperature[axis]);
}

bool Application::commutation_known(std::size_t axis) const {
  return !readings_.has_power_stage ||
         Commutation::known(parameters_.values(), axis, report_[axis].referenced);
}

void Application::take_reports() {
  // The last axis' first: that it is of a round says that those of the others are of the same.
  for (std::size_t axis = axis_count; axis-- > 0;) report_[axis] = tick_.report(axis);
}

/// The main loop's news of a link come at any time; what goes regularly goes with the rounds of the tick, on
/// a clock that counts them.
bool Application::round_has_begun() {
  constexpr std::uint32_t without_ticks_us = 1'000;  // where none come, or none any more
  const std::uint32_t round = report_[axis_count - 1].tick / round_ticks;
  const std::uint32_t waited_us = now_us_ - round_us_;
  // So late that the first axis has reported of the next round: a moment more, and the last will have too.
  const bool complete = round != round_ && report_[0].tick / round_ticks == round;
  if (!complete && waited_us < without_ticks_us) return false;
  round_clock_us_ += round == round_ ? waited_us : (round - round_) * round_interval_us;
  round_ = round;
  round_us_ = now_us_;
  return true;
}

Supervisor::Situation Application::situation(std::size_t axis) {
  const auto heard_us = last_heard_us(axis);
  // Off the bus, or never on it again after a bit rate that failed.
  const bool off_the_bus =
      can_.state == CanState::bus_off || can_.state == CanState::stopped || can_.state == CanState::absent;
  return {.values = parameters_.values(),
          .commutation = commutation_[axis],
          .thermal = thermal_[axis],
          .report = report_[axis],
          .setting = settings_[axis],
          .silent_us = heard_us ? std::optional(modbus::elapsed_us(now_us_, *heard_us)) : std::nullopt,
          .power_stage_temperature = readings_.power_stage_temperature[axis],
          .supply_voltage = readings_.supply_voltage,
          .enabled = tick_.enabled(axis),
          .settled = settled(axis),
          .ticks_have_stopped = readings_.ticks_have_stopped,
          .commutation_known = commutation_known(axis),
          .guard_failed = guard_[axis].verdict == GuardFinding::Verdict::fail,
          .store_busy = store_busy(),
          .restarting = restarting_,
          .off_the_bus = off_the_bus,
          .heartbeat_lost = node_.any_heartbeat_lost()};
}

void Application::act() {
  for (std::size_t axis = 0; axis < axis_count; ++axis)
    commutation_[axis].follow(parameters_.values(), axis, report_[axis].reference_generation);
  offer_settings_if_changed();
  judge_if_changed();
  for (std::size_t axis = 0; axis < axis_count; ++axis) {
    Supervisor& supervisor = supervisors_[axis];
    std::uint16_t word = 0;
    if (parameters_.fetch_controlword(axis, word)) supervisor.request(word);
    supervisor.poll(situation(axis), axis);
    tick_.enable(axis, supervisor.armed());
    supervisor.reaction_done();
  }
  publish_torques();
}

void Application::poll(std::uint32_t now_us) {
  if (!started_) {
    started_ = true;
    uptime_second_us_ = now_us;
  }
  now_us_ = now_us;
  tick_.keep_alive();
  while (now_us - uptime_second_us_ >= 1'000'000) {
    uptime_second_us_ += 1'000'000;
    ++uptime_s_;
  }
  take_reports();
  parameters_.poll(now_us);
  poll_temperatures();

  SerialByte received;
  while (serial_queue_.pop(received)) port_.receive(received.byte, received.line_error, received.time_us);
  port_.poll(now_us);
  poll_can();
  act();
  store_.poll();
  finish_saves();
}

const LoadReport& Application::attach_store(AnyFlashSectors flash) {
  const LoadReport& loaded = store_.attach(flash);
  offer_settings_if_changed();
  start_communication(true);
  refresh_readings();
  return loaded;
}

ParameterAccess::Result Application::preset(std::size_t entry, std::size_t axis, std::uint32_t raw) {
  const SlotValue one{static_cast<std::uint16_t>(slot_of(entry, axis)), raw};
  const auto result = parameters_.write({&one, 1}, Link::local, armed_axes(), now_us_);
  offer_settings_if_changed();
  return result;
}

}  // namespace kmax::firmware
