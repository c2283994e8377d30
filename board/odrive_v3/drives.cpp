#include "board/odrive_v3/drives.hpp"

#include <limits>

#include "board/odrive_v3/power_hardware.hpp"

#include "drivers/stm32f4/gpio.hpp"

namespace kmax::board::odrive_v3 {

namespace stm32 = drivers::stm32f4;

namespace {

constexpr drivers::NtcThermistor thermistor{};

bool level(PinLocation pin) {
  return stm32::GpioPin{stm32::gpio(pin.port), pin.number}.read();
}

/// The largest gain whose range reaches the over-current trip: finest steps.
drivers::CurrentSenseGain gain_for(float largest_current) {
  using enum drivers::CurrentSenseGain;
  for (const drivers::CurrentSenseGain gain : {x80, x40, x20}) {
    if (drivers::CurrentSense{{.gain = gain}}.range() >= largest_current) return gain;
  }
  return x10;
}

}  // namespace

Drives::Drives(VoltageVariant variant, ChipBus& bus)
    : supply_({.ratio = supply_divider_ratio(variant)}),
      serial_encoder_(bus),
      pwm0_(stm32::tim1()),
      pwm1_(stm32::tim8()),
      encoder0_(stm32::tim3()),
      encoder1_(stm32::tim4()),
      sampling_(stm32::adc(1), stm32::adc(2), stm32::adc(3), stm32::adc_common()) {}

bool Drives::configure(std::uint32_t apb2_hz) {
  return pwm0_.configure() && pwm1_.configure() && encoder0_.configure({}) && encoder1_.configure({}) &&
         sampling_.configure(apb2_hz);
}

bool Drives::start() {
  // The start itself triggers once: as a sample of axis 0.
  sampling_.start(0);
  return stm32::start_phase_shifted(pwm0_, pwm1_);
}

bool Drives::ISR_index_line(std::size_t axis) const {
  return level(axis == 0 ? pins::encoder0_index : pins::encoder1_index);
}

firmware::AxisInput Drives::ISR_measure(std::size_t axis, const stm32::CurrentSample& sample) {
  AxisHardware& hardware = axes_[axis];
  const Settings& settings = axis == 0 ? handover_.ISR_take() : handover_.ISR_current();
  if (hardware.index_generation != settings.index_generation[axis]) {
    hardware.index_generation = settings.index_generation[axis];
    hardware.index.reset(settings.index[axis]);
  }
  firmware::AxisInput input{};
  if (settings.serial_encoder_axis == axis) {
    ISR_take_serial(input);
  } else {
    ISR_read_quadrature(axis, settings, input);
    if (settings.serial_encoder_axis < firmware::axis_count) {
      ISR_begin_serial();
    } else if (serial_encoder_.under_way()) {
      serial_encoder_.ISR_abandon();
    }
  }
  input.motor.present = true;
  input.motor.supply_voltage = supply_.ISR_volts(sample.supply);
  input.motor.current_b = hardware.sense_b.ISR_amperes(sample.phase_b);
  input.motor.current_c = hardware.sense_c.ISR_amperes(sample.phase_c);
  // 2 triggers are 50 us: the converter of supply and temperatures stands still.
  if (!sample.valid || sample.slow_age > 2) {
    input.condition = firmware::Fault::tick_missed;
  } else if (supply_.ISR_saturated(sample.supply)) {
    input.condition = firmware::Fault::over_voltage;
  } else if (hardware.driving && (hardware.sense_b.ISR_saturated(sample.phase_b) ||
                                  hardware.sense_c.ISR_saturated(sample.phase_c))) {
    input.condition = firmware::Fault::current_sense;
  }
  if (calibrating_.load(std::memory_order_relaxed)) ISR_calibrate(hardware, sample);
  supply_code_.store(sample.supply, std::memory_order_relaxed);
  temperature_code_[axis].store(sample.temperatures[axis], std::memory_order_relaxed);
  return input;
}

void Drives::ISR_take_serial(firmware::AxisInput& input) {
  const drivers::As5047pSample angle = serial_encoder_.ISR_take();
  input.count = angle.count;
  input.count_valid = angle.valid;
}

void Drives::ISR_read_quadrature(std::size_t axis, const Settings& settings, firmware::AxisInput& input) {
  AxisHardware& hardware = axes_[axis];
  // The 16-bit counter's step since the last tick, signed.
  const std::uint16_t counter = axis == 0 ? encoder0_.count() : encoder1_.count();
  const auto step = static_cast<std::int16_t>(static_cast<std::uint16_t>(counter - hardware.count));
  hardware.count += static_cast<std::uint32_t>(static_cast<std::int32_t>(step));
  input.count = hardware.count;
  input.count_valid =
      !settings.without_encoder[axis] &&
      (!settings.has_index[axis] || hardware.index.ISR_plausible(hardware.count, ISR_index_line(axis)));
}

void Drives::ISR_calibrate(AxisHardware& hardware, const stm32::CurrentSample& sample) {
  if (!sample.valid) return;
  hardware.offset_b.ISR_add(sample.phase_b);
  hardware.offset_c.ISR_add(sample.phase_c);
}

void Drives::ISR_housekeeping(std::size_t axis, float supply_voltage) {
  watchdog_gate_.ISR_ticked(axis);
  axis_ticks_[axis].store(axis_ticks_[axis].load(std::memory_order_relaxed) + 1, std::memory_order_relaxed);
  if (axis != 0) return;
  // Motors brake while they are driven and a moment after; a supply that is too high for longer is not
  // theirs.
  constexpr std::uint32_t ticks_after_driving = firmware::tick_rate_hz / 5;
  if (axes_[0].driving || axes_[1].driving) {
    ISR_braking_for_ = ticks_after_driving;
  } else if (ISR_braking_for_ != 0) {
    --ISR_braking_for_;
  }
  const bool wanted = brake_.update(handover_.ISR_current().brake, supply_voltage);
  const bool allowed = ISR_braking_for_ != 0 && !brake_inhibited_.load(std::memory_order_relaxed);
  stm32::GpioPin{stm32::gpio(pins::brake_high_side.port), pins::brake_high_side.number}.write(wanted &&
                                                                                              allowed);
  if ((++ISR_ticks_ & 3U) == 0) main_loop_due_.store(true, std::memory_order_relaxed);
}

void Drives::inhibit_brake(bool inhibited) {
  brake_inhibited_.store(inhibited, std::memory_order_relaxed);
  if (inhibited)
    stm32::GpioPin{stm32::gpio(pins::brake_high_side.port), pins::brake_high_side.number}.write(false);
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
  const std::size_t axis = pwm0_.counting_down() ? 1 : 0;
  Pwm& pwm = axis == 0 ? pwm0_ : pwm1_;
  AxisHardware& hardware = axes_[axis];
  firmware::AxisInput input = ISR_measure(axis, sampling_.ISR_read(static_cast<unsigned>(axis)));
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
  ISR_housekeeping(axis, input.motor.supply_voltage);
}

// Instantiated here, where all that it calls can be seen and inlined.
template void Drives::ISR_tick(firmware::Application&, const PowerStage<PowerHardware>&);

void Drives::apply(const firmware::ParameterValues& values) {
  Settings settings;
  float largest_current = 0.0f;
  for (std::size_t axis = 0; axis < firmware::axis_count; ++axis) {
    settings.index[axis].counts_per_turn =
        static_cast<std::uint32_t>(values.whole<"encoder.counts_per_turn">(axis));
    settings.has_index[axis] = values.whole<"encoder.index">(axis) != 0;
    const float trip = firmware::over_current_factor * values.real<"current.limit">(axis);
    if (trip > largest_current) largest_current = trip;
    const auto motor = values.choice<firmware::MotorKind, "motor.kind">(axis);
    Pwm& pwm = axis == 0 ? pwm0_ : pwm1_;
    static_cast<void>(
        pwm.enable_legs(motor == firmware::MotorKind::dc ? stm32::brushed_motor_legs : stm32::PwmLegs{}));
  }
  for (std::size_t axis = 0; axis < firmware::axis_count; ++axis) {
    if (values.whole<"encoder.kind">(axis) != 1) continue;
    // There is one chip select: the first axis that asks has the chip.
    if (settings.serial_encoder_axis == firmware::axis_count) {
      settings.serial_encoder_axis = axis;
    } else {
      settings.without_encoder[axis] = true;
    }
  }
  settings.brake = control::BrakeChopper::prepare({.on_voltage = values.real<"supply.brake_voltage">()});
  for (std::size_t axis = 0; axis < firmware::axis_count; ++axis) {
    const bool same = settings.has_index[axis] == settings_.has_index[axis] &&
                      settings.index[axis].counts_per_turn == settings_.index[axis].counts_per_turn;
    settings.index_generation[axis] = settings_.index_generation[axis] + (same ? 0U : 1U);
  }
  if (settings.serial_encoder_axis != settings_.serial_encoder_axis) serial_encoder_.restart();
  settings_ = settings;
  handover_.offer(settings_);
  gain_ = gain_for(largest_current);
}

void Drives::restart_offset_calibration() {
  calibrating_.store(false, std::memory_order_relaxed);
  std::atomic_signal_fence(std::memory_order_seq_cst);
  for (AxisHardware& hardware : axes_) {
    hardware.sense_b = hardware.sense_c = drivers::CurrentSense{{.gain = gain_}};
    hardware.offset_b.restart();
    hardware.offset_c.restart();
  }
  std::atomic_signal_fence(std::memory_order_seq_cst);
  calibrating_.store(true, std::memory_order_relaxed);
}

OffsetProgress Drives::offset_progress() {
  for (const AxisHardware& hardware : axes_) {
    for (const auto* offset : {&hardware.offset_b, &hardware.offset_c}) {
      if (offset->result() == drivers::OffsetResult::running) return OffsetProgress::running;
    }
  }
  calibrating_.store(false, std::memory_order_relaxed);
  for (AxisHardware& hardware : axes_) {
    for (const auto* offset : {&hardware.offset_b, &hardware.offset_c}) {
      if (offset->result() != drivers::OffsetResult::accepted) return OffsetProgress::refused;
    }
    hardware.sense_b.set_offset(hardware.offset_b.offset());
    hardware.sense_c.set_offset(hardware.offset_c.offset());
  }
  return OffsetProgress::accepted;
}

firmware::BoardReadings Drives::readings() const {
  firmware::BoardReadings readings;
  for (std::size_t axis = 0; axis < firmware::axis_count; ++axis) {
    const drivers::NtcReading reading =
        thermistor.ISR_read(temperature_code_[axis].load(std::memory_order_relaxed));
    readings.power_stage_temperature[axis] =
        reading.state == drivers::NtcState::ok ? reading.celsius : std::numeric_limits<float>::quiet_NaN();
  }
  readings.supply_voltage = supply_.ISR_volts(supply_code_.load(std::memory_order_relaxed));
  const auto& counters = sampling_.counters();
  readings.missed_ticks = counters.overruns + counters.axis_mismatches;
  return readings;
}

}  // namespace kmax::board::odrive_v3
