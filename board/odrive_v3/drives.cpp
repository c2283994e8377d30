// The main loop's side of the drives.
#include "board/odrive_v3/drives.hpp"

#include <limits>

#include "drivers/stm32f4/gpio.hpp"

namespace kmax::board::odrive_v3 {

namespace stm32 = drivers::stm32f4;

namespace {

constexpr drivers::NtcThermistor thermistor{};

}  // namespace

Drives::Drives(VoltageVariant variant, ChipBus& bus)
    : supply_({.ratio = supply_divider_ratio(variant)}),
      serial_encoder_(bus, {stm32::gpio(pins::encoder_select.port), pins::encoder_select.number}),
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

void Drives::apply(const firmware::ParameterValues& values) {
  Settings settings;
  float largest_current = 0.0f;
  for (std::size_t axis = 0; axis < firmware::axis_count; ++axis) {
    const bool has_index = values.whole<"encoder.index">(axis) != 0;
    settings.quadrature[axis] = {
        .has_index = has_index,
        // A handle that starts at its rest has its origin there.
        .from_index = has_index && values.whole<"encoder.start">(axis) == 0,
        .counts_per_turn = static_cast<std::uint32_t>(values.whole<"encoder.counts_per_turn">(axis))};
    const float trip = firmware::over_current_factor * values.real<"current.limit">(axis);
    if (trip > largest_current) largest_current = trip;
    const auto motor = values.choice<firmware::MotorKind, "motor.kind">(axis);
    Pwm& pwm = axis == 0 ? pwm0_ : pwm1_;
    static_cast<void>(
        pwm.enable_legs(motor == firmware::MotorKind::dc ? stm32::brushed_motor_legs : stm32::PwmLegs{}));
  }
  // There is one chip select: the first axis that asks has the chip.
  const auto asks = [&values](std::size_t axis) { return values.whole<"encoder.kind">(axis) == 1; };
  if (asks(0)) {
    settings.role = {EncoderRole::chip, asks(1) ? EncoderRole::missing : EncoderRole::lines_beside_chip};
  } else if (asks(1)) {
    settings.role = {EncoderRole::lines_beside_chip, EncoderRole::chip};
  }
  settings.brake = control::BrakeChopper::prepare({.on_voltage = values.real<"supply.brake_voltage">()});
  settings.has_brake = settings.brake.on_voltage > 0.0f;
  bool chip_moves = false;
  for (std::size_t axis = 0; axis < firmware::axis_count; ++axis) {
    const auto role = settings.role[axis], role_before = settings_.role[axis];
    chip_moves = chip_moves || (role == EncoderRole::chip) != (role_before == EncoderRole::chip);
    const bool same = role == role_before && settings.quadrature[axis] == settings_.quadrature[axis];
    settings.encoder_generation[axis] = settings_.encoder_generation[axis] + (same ? 0U : 1U);
  }
  if (chip_moves) serial_encoder_.restart_anew();
  settings_ = settings;
  handover_.offer(settings_);
  gain_ = drivers::gain_for_current(largest_current);
}

void Drives::inhibit_brake(bool inhibited) {
  brake_inhibited_.store(inhibited, std::memory_order_relaxed);
  if (inhibited)
    stm32::GpioPin{stm32::gpio(pins::brake_high_side.port), pins::brake_high_side.number}.write(false);
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
  const stm32::CurrentSample& latest = sampling_.latest();
  for (std::size_t axis = 0; axis < firmware::axis_count; ++axis) {
    const drivers::NtcReading reading = thermistor.ISR_read(latest.temperatures[axis]);
    readings.power_stage_temperature[axis] =
        reading.state == drivers::NtcState::ok ? reading.celsius : std::numeric_limits<float>::quiet_NaN();
  }
  readings.has_power_stage = true;
  readings.supply_voltage = supply_.ISR_volts(latest.supply);
  const auto& counters = sampling_.counters();
  readings.missed_ticks = counters.overruns + counters.axis_mismatches;
  return readings;
}

}  // namespace kmax::board::odrive_v3
