#pragma once

#include <array>

#include "control/haptic_loop.hpp"
#include "firmware/fault.hpp"
#include "firmware/object_dictionary/entry.hpp"

namespace kmax::firmware {

/// Records that exist once per axis. Holding registers for what is set, input registers for what is read.
namespace group {
inline constexpr Group wall{"wall", 0x2000, Scope::axis, 0x0000};
inline constexpr Group interference{"interference", 0x2001, Scope::axis, 0x0040};
inline constexpr Group position{"position", 0x2002, Scope::axis, 0x0060};
inline constexpr Group velocity{"velocity", 0x2003, Scope::axis, 0x0070};
inline constexpr Group haptic{"haptic", 0x2004, Scope::axis, 0x0080};
inline constexpr Group force{"force", 0x2005, Scope::axis, 0x0090};
inline constexpr Group passivity{"passivity", 0x2006, Scope::axis, 0x00A0};
inline constexpr Group guard{"guard", 0x2007, Scope::axis, 0x00B0};
inline constexpr Group device{"device", 0x2008, Scope::axis, 0x00D0};
inline constexpr Group motor{"motor", 0x2009, Scope::axis, 0x00E0};
inline constexpr Group current{"current", 0x200A, Scope::axis, 0x0100};
inline constexpr Group encoder{"encoder", 0x200B, Scope::axis, 0x0110};
inline constexpr Group temperature{"temperature", 0x200C, Scope::axis, 0x0130};
inline constexpr Group drive{"drive", 0x2010, Scope::axis, 0x0200};
inline constexpr Group drive_status{"drive", 0x2011, Scope::axis, 0x0000};
inline constexpr Group measured{"measured", 0x2012, Scope::axis, 0x0020};
}  // namespace group

/// What each choice is called; the numbers are the enumerations' own.
namespace names {
template <typename Enumeration>
constexpr NamedValue named(std::string_view name, Enumeration value) {
  return {name, static_cast<std::int32_t>(value)};
}
using namespace control;
inline constexpr NamedValue wall_law[] = {named("none", WallKind::none), named("plain", WallKind::plain),
                                          named("magnetic", WallKind::magnetic),
                                          named("adaptive", WallKind::adaptive)};
inline constexpr NamedValue wall_side[] = {{"-1", -1}, {"+1", 1}};
inline constexpr NamedValue adaptive_relation[] = {named("linear", AdaptiveRelation::linear),
                                                   named("square", AdaptiveRelation::square),
                                                   named("square_root", AdaptiveRelation::square_root)};
inline constexpr NamedValue adaptive_velocity[] = {named("approach", AdaptiveVelocity::approach),
                                                   named("speed", AdaptiveVelocity::speed)};
inline constexpr NamedValue adaptive_mode[] = {named("instant", AdaptiveMode::instant),
                                               named("latched", AdaptiveMode::latched),
                                               named("peak_hold", AdaptiveMode::peak_hold)};
inline constexpr NamedValue interference_mode[] = {named("none", InterferenceMode::none),
                                                   named("perpendicular", InterferenceMode::perpendicular),
                                                   named("parallel", InterferenceMode::parallel)};
inline constexpr NamedValue rounding[] = {named("nearest", Rounding::nearest),
                                          named("floor", Rounding::floor),
                                          named("hysteresis", Rounding::hysteresis)};
inline constexpr NamedValue velocity_estimator[] = {
    named("difference", VelocityEstimatorKind::difference),
    named("low_pass", VelocityEstimatorKind::low_pass), named("foaw", VelocityEstimatorKind::foaw),
    named("foaw_end_fit", VelocityEstimatorKind::foaw_end_fit),
    named("tracking", VelocityEstimatorKind::tracking)};
// Modes that would remove a danger are listed only when this firmware has them: a guard that is accepted and
// ignored is worse than none. Plain data of parts to come (motor, supply) can be stored already and say so.
inline constexpr NamedValue passivity_mode[] = {{"off", 0}};
inline constexpr NamedValue guard_mode[] = {{"off", 0}};
inline constexpr NamedValue motor_kind[] = {{"dc", 0}, {"pmsm", 1}};
inline constexpr NamedValue encoder_kind[] = {{"quadrature", 0}, {"as5047p", 1}};
inline constexpr NamedValue encoder_index[] = {{"none", 0}, {"once_per_turn", 1}};
inline constexpr NamedValue encoder_direction[] = {{"-1", -1}, {"+1", 1}};
}  // namespace names

using enum Type;

inline constexpr std::array axis_entries = std::to_array<Entry>({
    choice("wall.law", group::wall, 1, names::wall_law, 1,
           "Wall law: no force, plain spring (paper 1 eq. 3), magnetic field of constant coefficient (eqs. "
           "5-6), "
           "or of a coefficient that follows the velocity (eqs. 5-7).")
        .disarmed_only(),
    real("wall.position", group::wall, 2, "m", -1000, 1000, 0, "Where the wall's surface is.")
        .disarmed_only(),
    choice("wall.side", group::wall, 3, names::wall_side, 1,
           "Free space is on this side of the surface, and the wall pushes towards it.")
        .disarmed_only(),
    real("wall.stiffness", group::wall, 4, "N/m", 0, 1e6, 1000, "Stiffness K inside the wall."),
    real("wall.damping", group::wall, 5, "N s/m", 0, 1000, 0,
         "Damping B inside the wall; spring and damper together never pull the handle in."),
    real("wall.magnetic_coefficient", group::wall, 6, "N", 0, 100, 2,
         "Magnetic coefficient F_MC of the law 'magnetic': the field's force at the surface and inside."),
    real("wall.magnetic_length", group::wall, 7, "m", 1e-6, 1, 0.001,
         "Length x_0 over which the field decays outside: a quarter of F_MC is left at x_0."),
    real("wall.adaptive_gain", group::wall, 8, "N", 0, 100, 2.4, "Gain of eq. 7, F_MC = gain V_k + offset."),
    real("wall.adaptive_offset", group::wall, 9, "N", 0, 100, 0.8, "Offset of eq. 7."),
    real("wall.adaptive_velocity_max", group::wall, 10, "m/s", 0.001, 100, 2.4,
         "V_max of eq. 7: V_k = V / V_max, bounded to 0..1."),
    choice("wall.adaptive_relation", group::wall, 11, names::adaptive_relation, 0,
           "Relation between V_k and F_MC: V_k itself, its square, or its square root."),
    real("wall.adaptive_force_min", group::wall, 12, "N", 0, 100, 0.8,
         "Lower bound of the adaptive F_MC; must not exceed wall.adaptive_force_max."),
    real("wall.adaptive_force_max", group::wall, 13, "N", 0, 100, 2,
         "Upper bound of the adaptive F_MC. A wide interval gives eq. 7 to the letter (3.2 N at V_max)."),
    choice("wall.adaptive_velocity", group::wall, 14, names::adaptive_velocity, 0,
           "Which velocity V is: only motion towards the wall, or the speed in either direction."),
    choice("wall.adaptive_mode", group::wall, 15, names::adaptive_mode, 0,
           "How F_MC follows V: at once, latched at contact, or held at its peak and decaying."),
    real("wall.adaptive_hold_time", group::wall, 16, "s", 0, 60, 1.2,
         "Time constant with which a peak_hold F_MC decays to its value at rest."),

    choice("interference.mode", group::interference, 1, names::interference_mode, 0,
           "Disturbance of paper 1 section 2: none, along the wall's normal (eq. 2), or along its surface "
           "(eq. 4; "
           "the interference force goes to the other axis).")
        .disarmed_only(),
    real("interference.force", group::interference, 2, "N", -100, 100, 0,
         "Interference force F_I while inside."),
    real("interference.background_force", group::interference, 3, "N", -100, 100, 0,
         "Background force F_B along the normal, outwards positive."),
    real("interference.onset_time", group::interference, 4, "s", 0, 3600, 0,
         "Time t_0 after contact at which F_B sets in; parallel mode only."),

    real(
        "position.resolution", group::position, 1, "m", 0, 1, 0,
        "Step to which the position is re-quantized (paper 2); 0 keeps the encoder's own. Rounded to a whole "
        "number of encoder counts, see measured.resolution.")
        .disarmed_only(),
    choice("position.rounding", group::position, 2, names::rounding, 0,
           "How a position between two steps is rounded; hysteresis holds the old step until it is a whole "
           "step off.")
        .disarmed_only(),

    choice("velocity.estimator", group::velocity, 1, names::velocity_estimator, 2,
           "Velocity estimator: finite difference, low-passed difference, first-order adaptive windowing "
           "with the "
           "best fit or the end fit, or a tracking loop.")
        .disarmed_only(),
    whole("velocity.window", group::velocity, 2, unsigned8, "samples", 1, 16, 16,
          "Widest window of foaw and foaw_end_fit.")
        .disarmed_only(),
    real("velocity.bandwidth", group::velocity, 3, "Hz", 0.1, 5000, 100,
         "Bandwidth of low_pass and tracking.")
        .disarmed_only(),
    real("velocity.limit", group::velocity, 4, "m/s", 0, 1000, 5,
         "Trip level: a faster handle removes the force with a fault; 0 turns it off."),

    real("haptic.rate", group::haptic, 1, "Hz", 100, 20000, 20000,
         "Rate of the haptic loop; must divide the tick rate of 20000 Hz.")
        .disarmed_only(),

    real("force.limit", group::force, 1, "N", 0, 1000, 3.3,
         "Largest force that is ever asked of the device."),
    real("force.slew_limit", group::force, 2, "N/s", 0, 1e9, 0, "Fastest change of the force; 0: no limit."),
    real("force.ramp_time", group::force, 3, "s", 0, 60, 0.2, "Soft start: time from arming to full force."),

    choice("passivity.mode", group::passivity, 1, names::passivity_mode, 0,
           "Time-domain passivity control. This firmware offers only 'off'.")
        .disarmed_only(),

    choice("guard.mode", group::guard, 1, names::guard_mode, 0,
           "Stability check before arming. This firmware offers only 'off'.")
        .disarmed_only(),
    real("guard.damping", group::guard, 2, "N s/m", 0, 1000, 0,
         "Viscous damping the stability check may count on. Not used by this version."),
    real("guard.friction", group::guard, 3, "N", 0, 100, 0,
         "Coulomb friction the stability check may count on. Not used by this version."),
    real("guard.operator_force", group::guard, 4, "N", 0, 1000, 0,
         "Force F_h of the operator in paper 2's resolution criterion. Not used by this version."),
    real("guard.operator_speed", group::guard, 5, "m/s", 0, 100, 0,
         "Speed v of the operator in paper 2's resolution criterion. Not used by this version."),

    real("device.transmission", group::device, 1, "m/rad", 1e-6, 10, 0.05,
         "Handle travel per radian of the motor shaft.")
        .disarmed_only(),
    real("device.mass", group::device, 2, "kg", 1e-4, 100, 0.045,
         "Mass felt at the handle. Not used by this version.")
        .disarmed_only(),

    choice("motor.kind", group::motor, 1, names::motor_kind, 0,
           "Brushed DC motor or permanent-magnet synchronous.")
        .disarmed_only(),
    real("motor.resistance", group::motor, 2, "ohm", 1e-4, 1000, 1, "Winding (phase) resistance.")
        .disarmed_only(),
    real("motor.inductance", group::motor, 3, "H", 1e-7, 1, 1e-3, "Winding (phase) inductance.")
        .disarmed_only(),
    real("motor.torque_constant", group::motor, 4, "N m/A", 1e-5, 100, 0.05,
         "Torque per ampere (synchronous motor: of q current, amplitude).")
        .disarmed_only(),
    whole("motor.pole_pairs", group::motor, 5, unsigned8, "", 1, 64, 7, "Pole pairs of a synchronous motor.")
        .disarmed_only(),
    real("motor.electrical_offset", group::motor, 6, "rad", -7, 7, 0,
         "Electrical angle of a synchronous motor where the position is zero.")
        .disarmed_only(),

    real("current.limit", group::current, 1, "A", 0.1, 120, 5,
         "Largest motor current; a phase that carries half as much again trips the axis.")
        .disarmed_only(),
    real("current.bandwidth", group::current, 2, "rad/s", 1, 50000, 3000, "Bandwidth of the current loop.")
        .disarmed_only(),

    choice("encoder.kind", group::encoder, 1, names::encoder_kind, 0,
           "Encoder: quadrature lines, or an AS5047P on the serial peripheral interface.")
        .disarmed_only(),
    whole("encoder.counts_per_turn", group::encoder, 2, unsigned32, "counts", 4, 1e9, 8192,
          "Counts per turn of the motor shaft (quadrature: four times the lines).")
        .disarmed_only(),
    choice("encoder.direction", group::encoder, 3, names::encoder_direction, 1,
           "+1: counts grow with the handle's position; -1: they fall.")
        .disarmed_only(),
    whole("encoder.offset", group::encoder, 4, integer32, "counts", -2147483648.0, 2147483647.0, 0,
          "Count at which the position is zero.")
        .disarmed_only(),
    choice("encoder.index", group::encoder, 5, names::encoder_index, 0,
           "Index line of a quadrature encoder. With one, a cable that comes off is found at once, when the "
           "index has been passed once: all lines "
           "then read high away from the index.")
        .disarmed_only(),

    real("temperature.limit", group::temperature, 1, "degC", -40, 200, 100,
         "Trip level of the power stage's temperature."),

    whole(
        "drive.controlword", group::drive, 1, unsigned16, "", 0, 65535, 0,
        "CiA 402 controlword: 6 shutdown, 7 switch on, 15 enable operation, 2 quick stop, 0 disable voltage, "
        "128 fault reset (rising edge).")
        .volatile_value()
        .at_standard_index(0x6040),

    reading("drive.statusword", group::drive_status, 1, unsigned16, "", "CiA 402 statusword.")
        .at_standard_index(0x6041),
    reading("drive.error_code", group::drive_status, 2, unsigned16, "",
            "CiA 402 error code of the present fault; 0: none.")
        .at_standard_index(0x603F),
    reading("drive.refusal", group::drive_status, 3, unsigned16, "",
            "Why the last request to enable operation was refused; 0: it was not."),
    reading("drive.fault_value", group::drive_status, 4, float32, "",
            "The number that tripped the present fault."),
    reading("drive.fault_bound", group::drive_status, 5, float32, "", "The bound it passed."),

    reading("measured.tick", group::measured, 1, unsigned32, "ticks",
            "Tick at which these values were taken."),
    reading("measured.position", group::measured, 2, float32, "m", "Position, re-sampled."),
    reading("measured.velocity", group::measured, 3, float32, "m/s", "Estimated velocity."),
    reading("measured.force", group::measured, 4, float32, "N", "Force asked of the device."),
    reading("measured.distance", group::measured, 5, float32, "m",
            "Distance outside the wall; negative inside."),
    reading("measured.magnetic_force", group::measured, 6, float32, "N",
            "Force of the magnetic field, outwards."),
    reading("measured.magnetic_coefficient", group::measured, 7, float32, "N", "F_MC at work."),
    reading("measured.count", group::measured, 8, integer32, "counts", "Position, re-sampled (low 32 bits)."),
    reading("measured.flags", group::measured, 9, unsigned16, "",
            "Bit 0 inside the wall, 1 force limited, 2 slew limited, 3 soft start, 4 armed."),
    reading("measured.count_length", group::measured, 10, float32, "m", "Handle travel per encoder count."),
    reading("measured.resolution", group::measured, 11, float32, "m", "Position step that is really in use."),
    reading("measured.limited_samples", group::measured, 12, unsigned32, "samples",
            "Haptic samples since arming whose force was limited."),
    reading("measured.armed_samples", group::measured, 13, unsigned32, "samples",
            "Haptic samples since arming."),
    reading("measured.current", group::measured, 14, float32, "A",
            "Motor current that makes torque, measured; 0 on a board without current sensors."),
    reading("measured.current_reference", group::measured, 15, float32, "A", "Motor current asked for."),
    reading("measured.temperature", group::measured, 16, float32, "degC",
            "Temperature of the axis' power stage."),
});

}  // namespace kmax::firmware
