// The interrupt side of the application.
#include "firmware/application.hpp"

namespace kmax::firmware {

const AxisOutput& Application::ISR_tick(std::size_t axis, const AxisInput& input) {
  const Settings& settings = axis == 0 ? handover_.ISR_take() : handover_.ISR_current();
  if (axis == 0) {
    ++ISR_tick_;
    ISR_supervise_main_loop();
  }
  const bool enable = enable_[axis].load(std::memory_order_relaxed);
  if (ISR_main_loop_stands_ && enable) axes_[axis].ISR_trip(Fault::main_loop);
  // The force along one axis' wall belongs to the other axis; each takes what the other made last. In mode
  // torque there is no wall, and what the host asks for takes that place.
  Axis& ticked = axes_[axis];
  const float external = takes_command_[axis].load(std::memory_order_relaxed)
                             ? commanded_force_[axis].load(std::memory_order_relaxed)
                             : tangential_[(axis + 1) % axis_count];
  const AxisOutput& output = ticked.ISR_tick(settings[axis], input, enable, external, ISR_tick_);
  tangential_[axis] = output.tangential_force;
  if (ticked.ISR_changed() || ISR_round_begins())
    snapshots_[axis].ISR_publish([&ticked](AxisReport& report) { ticked.ISR_fill(report); });
  if (axis == trace_axis_.load(std::memory_order_relaxed)) ISR_trace(ticked.ISR_haptic());
  if (capture_.ISR_wants(axis)) [[unlikely]]
    ISR_capture(axis, input, output);
  return output;
}

// The main loop is what hears the host and the faults: without it no force may go on.
void Application::ISR_supervise_main_loop() {
  constexpr std::uint32_t most_ticks_without_poll = tick_rate_hz / 10;
  const std::uint32_t polls = polls_.load(std::memory_order_relaxed);
  ISR_ticks_without_poll_ = polls == ISR_polls_seen_ ? ISR_ticks_without_poll_ + 1 : 0;
  ISR_polls_seen_ = polls;
  ISR_main_loop_stands_ = ISR_ticks_without_poll_ > most_ticks_without_poll;
}

void Application::ISR_trace(const control::HapticLoop<float>::Output& traced) {
  const std::uint32_t interval = trace_interval_.load(std::memory_order_relaxed);
  if (interval == 0) {
    ISR_trace_countdown_ = 0;
    return;
  }
  if (!traced.new_sample) return;
  // A countdown as long as the interval is left over from a longer one.
  if (ISR_trace_countdown_ == 0 || ISR_trace_countdown_ >= interval) {
    ISR_trace_countdown_ = interval;
    trace_.ISR_push(
        {ISR_tick_, static_cast<std::int32_t>(traced.position), traced.force, traced.magnetic_coefficient});
  }
  --ISR_trace_countdown_;
}

void Application::ISR_capture(std::size_t axis, const AxisInput& input, const AxisOutput& output) {
  const control::HapticLoop<float>::Output& haptic = axes_[axis].ISR_haptic();
  const MotorControl::Output& motor = output.motor;
  const Fault fault = axes_[axis].ISR_fault();
  CaptureEvent event;
  event.flags = (haptic.inside ? capture_flag::inside : 0U) |
                (haptic.limited ? capture_flag::force_limited : 0U) |
                (haptic.slew_limited ? capture_flag::slew_limited : 0U) |
                (haptic.ramping ? capture_flag::ramping : 0U) | (output.enabled ? capture_flag::armed : 0U) |
                (motor.saturated ? capture_flag::saturated : 0U) |
                (input.count_valid ? capture_flag::count_valid : 0U) |
                (motor.excitation_started ? capture_flag::excitation_started : 0U) |
                static_cast<std::uint32_t>(fault) << capture_flag::fault_shift;
  event.force = output.force;
  event.velocity = haptic.velocity;
  capture_.ISR_record(ISR_tick_, event, [&](CaptureSource& source) {
    using enum CaptureChannel;
    const std::int64_t place = Axis::position_of(axes_[axis].ISR_counted(), handover_.ISR_current()[axis]);
    source.set<none>(std::int32_t{0});
    source.set<position>(static_cast<std::int32_t>(haptic.position));
    source.set<velocity>(haptic.velocity);
    source.set<force>(output.force);
    source.set<CaptureChannel::count>(static_cast<std::int32_t>(place));
    source.set<current>(motor.current);
    source.set<current_reference>(motor.current_reference);
    source.set<current_d>(motor.current_d);
    source.set<current_b>(input.motor.current_b);
    source.set<current_c>(input.motor.current_c);
    source.set<voltage>(motor.voltage);
    source.set<voltage_d>(motor.voltage_d);
    source.set<electrical_angle>(motor.electrical_angle);
    source.set<supply>(input.motor.supply_voltage);
    source.set<duty_a>(motor.duty_a);
    source.set<duty_b>(motor.duty_b);
    source.set<duty_c>(motor.duty_c);
    source.set<magnetic_coefficient>(haptic.magnetic_coefficient);
    source.set<distance>(haptic.outside_distance);
    source.set<flags>(event.flags);
  });
}

void Application::ISR_serial_byte(std::uint8_t byte, bool line_error, std::uint32_t time_us) {
  serial_queue_.ISR_push({time_us, byte, line_error});
}

}  // namespace kmax::firmware
