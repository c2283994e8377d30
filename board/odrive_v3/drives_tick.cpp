// The interrupt side of the drives.
#include "board/odrive_v3/drives.hpp"
#include "board/odrive_v3/power_hardware.hpp"
#include "drivers/stm32f4/gpio.hpp"

namespace kmax::board::odrive_v3 {

namespace stm32 = drivers::stm32f4;

namespace {

bool level(PinLocation pin) {
  return stm32::GpioPin{stm32::gpio(pin.port), pin.number}.read();
}

}  // namespace

template <std::size_t axis>
firmware::AxisInput Drives::ISR_measure(const Settings& settings, const stm32::CurrentSample& sample) {
  AxisHardware& hardware = axes_[axis];
  // Before anything is stored that may lie where the compiler takes the sample to be: they stay in registers.
  const std::uint16_t phase_b = sample.phase_b, phase_c = sample.phase_c, supply = sample.supply;
  const bool driving = hardware.driving;
  firmware::Fault condition = firmware::Fault::none;
  // 2 triggers are 50 us: the converter of supply and temperatures stands still.
  if (!sample.valid || sample.slow_age > 2) [[unlikely]] {
    condition = firmware::Fault::tick_missed;
  } else if (supply_.ISR_saturated(supply)) [[unlikely]] {
    condition = firmware::Fault::over_voltage;
  } else if (hardware.sense_b.ISR_saturated(phase_b) || hardware.sense_c.ISR_saturated(phase_c))
      [[unlikely]] {
    // Amplifiers of a bridge that is off may read anything.
    if (driving) condition = firmware::Fault::current_sense;
  }
  if (calibrating_.load(std::memory_order_relaxed)) [[unlikely]]
    ISR_calibrate(hardware, sample);
  const float current_b = hardware.sense_b.ISR_amperes(phase_b);
  const float current_c = hardware.sense_c.ISR_amperes(phase_c);
  const Count count = ISR_read_count<axis>(settings, driving);
  // Named in full: what is filled with zeros first is filled by a function of the library.
  return {.count = count.count,
          .count_valid = count.valid,
          .condition = condition,
          .motor = {.present = true,
                    .supply_voltage = supply_.ISR_volts(supply),
                    .current_b = current_b,
                    .current_c = current_c},
          .reference_generation = count.reference_generation,
          .referenced = count.referenced};
}

template <std::size_t axis>
Drives::Count Drives::ISR_read_count(const Settings& settings, bool driving) {
  if (axes_[axis].encoder_generation != settings.encoder_generation[axis]) [[unlikely]]
    ISR_configure_encoder(axis, settings);
  if (settings.role[axis] != EncoderRole::lines) [[unlikely]] {
    if (settings.role[axis] == EncoderRole::chip) return ISR_take_serial();
    ISR_begin_serial();
    if (settings.role[axis] == EncoderRole::missing) return {};
  }
  return ISR_read_quadrature<axis>(driving);
}

Drives::Count Drives::ISR_take_serial() {
  const drivers::As5047pSample angle = serial_encoder_.ISR_take();
  return {.count = angle.count,
          .valid = angle.valid,
          .referenced = false,
          .reference_generation = serial_generations | angle.reference_generation};
}

template <std::size_t axis>
Drives::Count Drives::ISR_read_quadrature(bool driving) {
  const auto index_line = [] { return level(axis == 0 ? pins::encoder0_index : pins::encoder1_index); };
  const std::uint16_t counter = axis == 0 ? encoder0_.count() : encoder1_.count();
  return axes_[axis].counter.ISR_read(counter, index_line, driving);
}

void Drives::ISR_configure_encoder(std::size_t axis, const Settings& settings) {
  axes_[axis].encoder_generation = settings.encoder_generation[axis];
  axes_[axis].counter.configure(settings.quadrature[axis]);
  // Nobody would take the frame any more.
  if (settings.role[axis] == EncoderRole::lines && serial_encoder_.under_way()) serial_encoder_.ISR_abandon();
}

void Drives::ISR_calibrate(AxisHardware& hardware, const stm32::CurrentSample& sample) {
  if (!sample.valid) return;
  hardware.offset_b.ISR_add(sample.phase_b);
  hardware.offset_c.ISR_add(sample.phase_c);
}

void Drives::ISR_brake(const control::BrakeChopper::Coefficients& coefficients, float supply_voltage) {
  // Motors brake while they are driven and a moment after; a supply that is too high for longer is not
  // theirs.
  constexpr std::uint32_t ticks_after_driving = firmware::tick_rate_hz / 5;
  if (axes_[0].driving || axes_[1].driving) {
    ISR_braking_for_ = ticks_after_driving;
  } else if (ISR_braking_for_ != 0) {
    --ISR_braking_for_;
  }
  const bool wanted = brake_.update(coefficients, supply_voltage);
  const bool allowed = ISR_braking_for_ != 0 && !brake_inhibited_.load(std::memory_order_relaxed);
  ISR_brake_on_ = wanted && allowed;
  stm32::GpioPin{stm32::gpio(pins::brake_high_side.port), pins::brake_high_side.number}.write(ISR_brake_on_);
}

bool Drives::ISR_ticks_have_stopped() {
  bool stopped = false;
  for (std::size_t axis = 0; axis < firmware::axis_count; ++axis) {
    const std::uint32_t ticks = axis_ticks_[axis].load(std::memory_order_relaxed);
    stopped = stopped || ticks == axis_ticks_seen_[axis];
    axis_ticks_seen_[axis] = ticks;
  }
  // Twice in a row: after an erase, in which the core stood still, this may come before the second axis'
  // tick.
  ISR_silent_calls_ = stopped ? ISR_silent_calls_ + 1 : 0;
  if (ISR_silent_calls_ < 2) return false;
  ISR_disarm();
  main_loop_due_.store(true, std::memory_order_relaxed);
  return true;
}

template <typename Stage>
[[gnu::flatten]] void Drives::ISR_tick(firmware::Application& application, const Stage& stage) {
  if (pwm0_.counting_down()) {
    ISR_tick_of<1>(application, stage);
  } else {
    ISR_tick_of<0>(application, stage);
  }
}

template <std::size_t axis, typename Stage>
void Drives::ISR_tick_of(firmware::Application& application, const Stage& stage) {
  Pwm& pwm = axis == 0 ? pwm0_ : pwm1_;
  AxisHardware& hardware = axes_[axis];
  const Settings& settings = axis == 0 ? handover_.ISR_take() : handover_.ISR_current();
  const stm32::CurrentSample& sample = sampling_.ISR_read(axis);
  firmware::AxisInput input = ISR_measure<axis>(settings, sample);
  // Before the condition: a line interrupt in between must be found as what it is.
  const bool bridge_fell = hardware.arm_failed || (hardware.driving && !pwm.armed());
  if (const firmware::Fault condition = stage.ISR_condition(); condition != firmware::Fault::none)
    input.condition = condition;
  // MOE fell, or would not rise, without anybody saying why: the break input.
  if (bridge_fell && input.condition == firmware::Fault::none) input.condition = firmware::Fault::power_stage;

  const firmware::AxisOutput& output = application.ISR_tick(axis, input);
  const bool has_duty =
      output.enabled && pwm.ISR_set_duty({output.motor.duty_a, output.motor.duty_b, output.motor.duty_c});
  if (!has_duty) {
    pwm.disarm();
    hardware.driving = hardware.arm_failed = false;
    // The next arming begins without voltage.
    pwm.ISR_set_ticks({no_voltage_ticks, no_voltage_ticks, no_voltage_ticks});
  } else if (!hardware.driving) {
    hardware.driving = pwm.arm();
    hardware.arm_failed = !hardware.driving;
    if (stage.ISR_condition() != firmware::Fault::none) pwm.disarm();
  }
  watchdog_gate_.ISR_ticked(axis);
  axis_ticks_[axis].store(axis_ticks_[axis].load(std::memory_order_relaxed) + 1, std::memory_order_relaxed);
  if constexpr (axis == 0) {
    if (settings.has_brake || ISR_brake_on_) ISR_brake(settings.brake, input.motor.supply_voltage);
  } else {
    if (application.ISR_round_begins()) main_loop_due_.store(true, std::memory_order_relaxed);
  }
}

// Instantiated here, where all that it calls can be seen and inlined.
template void Drives::ISR_tick(firmware::Application&, const PowerStage<PowerHardware>&);

}  // namespace kmax::board::odrive_v3
