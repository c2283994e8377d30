#include "firmware/drive/axes_settings.hpp"

#include "firmware/drive/axis_configuration.hpp"

namespace kmax::firmware {

void AxesSettings::make(const ParameterValues& values, std::uint32_t restarts, const AllCircumstances& now,
                        const std::array<AxisReport, axis_count>& reports) {
  circumstances_ = now;
  settings_.law = DeviceLaw<axis_count>::settings(values);
  for (std::size_t axis = 0; axis < axis_count; ++axis) {
    const double length = count_length(values, axis);
    const double step =
        control::resampler_step(static_cast<double>(values.real<"position.resolution">(axis)), length);
    scale_[axis] = {length, static_cast<float>(step * length)};

    AxisSetting& setting = settings_.axis[axis];
    setting.encoder_offset = values.whole<"encoder.offset">(axis);
    setting.encoder_direction = values.whole<"encoder.direction">(axis);
    setting.generation = restarts + 1;  // an axis that has not ticked yet has 0
    // Near the position by the new origin: the resampler starts from there.
    const std::int64_t position = Axis::position_of(reports[axis].counted, setting);
    setting.haptic = control::HapticLoop<float>::prepare(haptic_configuration(values, axis), position);
    auto motor = motor_configuration(values, axis, now[axis].winding_temperature, now[axis].current_share);
    motor.modulation_limit = now[axis].modulation_limit;
    setting.motor = MotorControl::prepare(motor);
    setting.compensation =
        control::ForceCompensation<float>::prepare(compensation_configuration(values, axis));
    setting.plausibility = control::MotionPlausibility<float>::prepare(
        plausibility_configuration(values, axis),
        static_cast<float>(Axis::motion_look) / static_cast<float>(tick_rate_hz));
    setting.watch_motion = values.real<"device.hand_force">(axis) > 0.0f;
    setting.excitation = Excitation::prepare(excitation_configuration(values, axis));
    setting.mode = values.choice<DriveMode, "drive.mode">(axis);
    setting.commutated = now[axis].commutated;
    setting.supply = SupplyWindow(values.real<"supply.voltage_min">(), highest_supply(values));
  }
}

}  // namespace kmax::firmware
