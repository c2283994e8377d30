// The interrupt side of the application.
#include "firmware/application.hpp"

namespace kmax::firmware {

TickOutput Application::ISR_tick(const TickInput& input) {
  const Settings& settings = handover_.ISR_take();
  const std::uint32_t tick = ISR_state_.tick + 1;
  ISR_state_.tick = tick;

  // The main loop is what hears the host and the faults: without it no force may go on.
  constexpr std::uint32_t most_ticks_without_poll = tick_rate_hz / 10;
  const std::uint32_t polls = polls_.load(std::memory_order_relaxed);
  ISR_ticks_without_poll_ = polls == ISR_polls_seen_ ? ISR_ticks_without_poll_ + 1 : 0;
  ISR_polls_seen_ = polls;
  const bool main_loop_stands = ISR_ticks_without_poll_ > most_ticks_without_poll;

  TickOutput output{};
  // The force along one axis' wall belongs to the other axis; it is made one tick later.
  const std::array<float, axis_count> from_other = {tangential_[1], tangential_[0]};
  bool news = false;
  for (std::size_t i = 0; i < axis_count; ++i) {
    const bool enable = enable_[i].load(std::memory_order_relaxed);
    if (main_loop_stands && enable) axes_[i].ISR_trip(Fault::main_loop);
    output.axis[i] = axes_[i].ISR_tick(settings[i], input.axis[i], enable, from_other[i], tick);
    tangential_[i] = output.axis[i].tangential_force;
    const AxisReport& report = axes_[i].ISR_report();
    const AxisReport& last = ISR_state_.axis[i];
    // Between two samples the main loop must not act on a fault that is gone or an enable that has changed.
    news = news || report.haptic.new_sample || report.fault != last.fault || report.enabled != last.enabled ||
           report.count_valid != last.count_valid;
    ISR_state_.axis[i] = report;
  }
  if (news) snapshot_.ISR_publish(ISR_state_);

  const std::uint32_t interval = trace_interval_.load(std::memory_order_relaxed);
  const auto& traced = ISR_state_.axis[trace_axis_.load(std::memory_order_relaxed)].haptic;
  if (interval == 0) {
    ISR_trace_countdown_ = 0;
  } else if (traced.new_sample) {
    // A countdown as long as the interval is left over from a longer one.
    if (ISR_trace_countdown_ == 0 || ISR_trace_countdown_ >= interval) {
      ISR_trace_countdown_ = interval;
      trace_.ISR_push(
          {tick, static_cast<std::int32_t>(traced.position), traced.force, traced.magnetic_coefficient});
    }
    --ISR_trace_countdown_;
  }
  return output;
}

void Application::ISR_serial_byte(std::uint8_t byte, bool line_error, std::uint32_t time_us) {
  serial_queue_.ISR_push({time_us, byte, line_error});
}

}  // namespace kmax::firmware
