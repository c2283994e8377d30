#pragma once

#include <array>

#include "firmware/object_dictionary/axis_groups.hpp"

namespace kmax::firmware {

using enum Type;

/// A CiA 402 option code: 16 bits signed, whatever its choices.
constexpr Entry stop_option(std::string_view name, std::uint8_t subindex, std::span<const NamedValue> values,
                            std::int32_t default_value, std::uint16_t index, std::string_view help) {
  Entry e = choice(name, group::profile, subindex, values, default_value, help).at_standard_index(index);
  e.type = integer16;
  e.persistent = false;
  return e;
}

/// What can be set of an axis.
inline constexpr std::array axis_settings = std::to_array<Entry>({
    choice("wall.law", group::wall, 1, names::wall_law, 1,
           "Wall law: no force, plain spring (paper 1 eq. 3), magnetic field of constant coefficient (eqs. "
           "5-6), or of a coefficient that follows the velocity (eqs. 5-7).")
        .disarmed_only(),
    real("wall.position", group::wall, 2, "m", -1000, 1000, 0, "Where the wall's surface is.")
        .disarmed_only(),
    choice("wall.side", group::wall, 3, names::wall_side, 1,
           "Free space is on this side of the surface, and the wall pushes towards it.")
        .disarmed_only(),
    real("wall.stiffness", group::wall, 4, "N/m", 0, 1e6, 1000, "Stiffness K inside the wall.")
        .only_lower("wall.stiffness_ceiling"),
    real("wall.damping", group::wall, 5, "N s/m", 0, 1000, 0,
         "Damping B inside the wall; spring and damper together never pull the handle in.")
        .only_lower("wall.damping_ceiling"),
    real("wall.magnetic_coefficient", group::wall, 6, "N", 0, 100, 2,
         "Magnetic coefficient F_MC of the law 'magnetic': the field's force at the surface and inside.")
        .only_lower("force.ceiling"),
    real("wall.magnetic_length", group::wall, 7, "m", 1e-6, 1, 0.001,
         "Length x_0 over which the field decays outside: a quarter of F_MC is left at x_0.")
        .disarmed_only(),
    real("wall.adaptive_gain", group::wall, 8, "N", 0, 100, 2.4, "Gain of eq. 7, F_MC = gain V_k + offset."),
    real("wall.adaptive_offset", group::wall, 9, "N", 0, 100, 0.8, "Offset of eq. 7."),
    real("wall.adaptive_velocity_max", group::wall, 10, "m/s", 0.001, 100, 2.4,
         "V_max of eq. 7: V_k = V / V_max, bounded to 0..1."),
    choice("wall.adaptive_relation", group::wall, 11, names::adaptive_relation, 0,
           "Relation between V_k and F_MC: V_k itself, its square, or its square root."),
    real("wall.adaptive_force_min", group::wall, 12, "N", 0, 100, 0.8,
         "Lower bound of the adaptive F_MC; must not exceed wall.adaptive_force_max.")
        .only_lower(),
    real("wall.adaptive_force_max", group::wall, 13, "N", 0, 100, 2,
         "Upper bound of the adaptive F_MC. A wide interval gives eq. 7 to the letter (3.2 N at V_max).")
        .only_lower("force.ceiling"),
    choice("wall.adaptive_velocity", group::wall, 14, names::adaptive_velocity, 0,
           "Which velocity V is: only motion towards the wall, or the speed in either direction."),
    choice("wall.adaptive_mode", group::wall, 15, names::adaptive_mode, 0,
           "How F_MC follows V: at once, latched at contact, or held at its peak and decaying."),
    real("wall.adaptive_hold_time", group::wall, 16, "s", 0, 60, 1.2,
         "Time constant with which a peak_hold F_MC decays to its value at rest."),
    real("wall.stiffness_ceiling", group::wall, 17, "N/m", 0, 1e6, 0,
         "How far wall.stiffness may be raised while the axis is armed; 0: it can only be lowered.")
        .disarmed_only(),
    real("wall.damping_ceiling", group::wall, 18, "N s/m", 0, 1000, 0,
         "How far wall.damping may be raised while the axis is armed; 0: it can only be lowered.")
        .disarmed_only(),
    whole("wall.damping_window", group::wall, 19, unsigned8, "samples", 0, 16, 0,
          "Haptic samples that wall.damping takes its velocity over, as a difference; 0: it has that of "
          "velocity.estimator.")
        .disarmed_only(),
    real("wall.touch_stiffness", group::wall, 20, "N/m", 0, 1e6, 0,
         "Stiffness at the moment of contact, which grows to wall.stiffness while the contact is calm; 0: "
         "all of it at once.")
        .disarmed_only(),
    real("wall.growth_time", group::wall, 21, "s", 0.001, 60, 0.2,
         "Time constant of that growth; a contact that is not calm falls back four times as fast.")
        .disarmed_only(),
    real("wall.calm_velocity", group::wall, 22, "m/s", 0, 100, 0.01,
         "A contact is calm while the handle is no faster than this.")
        .disarmed_only(),

    choice("interference.mode", group::interference, 1, names::interference_mode, 0,
           "Disturbance of paper 1 section 2: none, along the wall's normal (eq. 2), or along its surface "
           "(eq. 4; the interference force goes to the other axis).")
        .disarmed_only(),
    real("interference.force", group::interference, 2, "N", -100, 100, 0,
         "Interference force F_I while inside.")
        .only_nearer_zero("force.ceiling"),
    real("interference.background_force", group::interference, 3, "N", -100, 100, 0,
         "Background force F_B along the normal, outwards positive.")
        .only_nearer_zero("force.ceiling"),
    real("interference.onset_time", group::interference, 4, "s", 0, 3600, 0,
         "Time t_0 after contact at which F_B sets in; parallel mode only.")
        .only_higher(),

    real("position.resolution", group::position, 1, "m", 0, 1, 0,
         "Step to which the position is re-quantized (paper 2); 0 keeps the encoder's own. Rounded to a "
         "whole number of encoder counts, see measured.resolution.")
        .disarmed_only(),
    choice("position.rounding", group::position, 2, names::rounding, 0,
           "How a position between two steps is rounded; hysteresis holds the old step until it is a whole "
           "step off.")
        .disarmed_only(),

    choice("velocity.estimator", group::velocity, 1, names::velocity_estimator, 2,
           "Velocity estimator: finite difference, low-passed difference, first-order adaptive windowing "
           "with the best fit or the end fit, a tracking loop, or the time between edges of the position.")
        .disarmed_only(),
    whole("velocity.window", group::velocity, 2, unsigned8, "samples", 1, 16, 16,
          "Widest window of foaw and foaw_end_fit, in samples that they take: each up to 10 kHz, every "
          "second one beyond.")
        .disarmed_only(),
    real("velocity.bandwidth", group::velocity, 3, "Hz", 0.1, 5000, 100,
         "Bandwidth of low_pass and tracking.")
        .disarmed_only(),
    real("velocity.limit", group::velocity, 4, "m/s", 0, 1000, 5,
         "Trip level: a faster handle removes the force with a fault; 0 turns it off.")
        .only_lower()
        .off_at_zero(),

    real("haptic.rate", group::haptic, 1, "Hz", 100, 20000, 20000,
         "Rate of the haptic loop; must divide the tick rate of 20000 Hz.")
        .disarmed_only(),

    real("force.limit", group::force, 1, "N", 0, 1000, 3.3, "Largest force that is ever asked of the device.")
        .only_lower("force.ceiling"),
    real("force.slew_limit", group::force, 2, "N/s", 0, 1e9, 0, "Fastest change of the force; 0: no limit.")
        .only_lower()
        .off_at_zero(),
    real("force.ramp_time", group::force, 3, "s", 0, 60, 0.2, "Soft start: time from arming to full force.")
        .only_higher(),
    real("force.ceiling", group::force, 4, "N", 0, 1000, 0,
         "How far force.limit, and what acts without a push of the hand (field, interference, background), "
         "may be raised while the axis is armed; 0: they can only be lowered.")
        .disarmed_only(),

    choice("guard.mode", group::guard, 1, names::guard_mode, 0,
           "Stability check of the wall against the device: off; warn arms all the same and sets the "
           "statusword's warning; refuse does not arm and, while armed, takes no parameters that would fail. "
           "guard.verdict tells. How the adaptive law's field follows the velocity is not judged.")
        .disarmed_only(),
    real("guard.damping", group::guard, 2, "N s/m", 0, 1000, 0,
         "Viscous damping b at the handle that the stability check may count on.")
        .only_lower(),
    real("guard.friction", group::guard, 3, "N", 0, 100, 0,
         "Coulomb friction f_c of the handle that may be counted on, by the stability check too, which does "
         "not subtract what compensation.limit allows to be taken away; compensation.limit must be below it.")
        .only_lower(),
    real("guard.operator_force", group::guard, 4, "N", 0, 1000, 0,
         "Force F_h of the operator in paper 2's resolution criteria; 0: not known, they are not judged.")
        .disarmed_only(),
    real("guard.operator_speed", group::guard, 5, "m/s", 0, 100, 0,
         "Speed v of the operator in paper 2's resolution criteria; 0: not known.")
        .disarmed_only(),
    real("guard.delay", group::guard, 6, "s", 0, 1, 0,
         "Delay from a command to its force at the handle, beyond the current loop's own (1 / "
         "current.bandwidth and 0.65 ticks).")
        .only_higher(),

    choice("instability.action", group::instability, 1, names::instability_action, 1,
           "What is done about a wall that oscillates under the hand (faster than 15 Hz, not dying down): "
           "nothing; warn; soften, the wall's force is halved for every 0.1 s until it is still, and stays "
           "so until disarmed; or trip, no force and the fault unstable_wall.")
        .only_higher(),
    real("instability.force", group::instability, 2, "N", 0.01, 1000, 0.3,
         "How far the force must swing to either side to be called an oscillation.")
        .only_lower(),
    real("instability.amplitude", group::instability, 3, "m", 1e-6, 1, 8e-5,
         "How far the handle must swing to either side to be called an oscillation.")
        .only_lower(),

    real("device.transmission", group::device, 1, "m/rad", 1e-6, 10, 0.05,
         "Handle travel per radian of the motor shaft.")
        .disarmed_only(),
    real("device.mass", group::device, 2, "kg", 1e-4, 100, 0.045,
         "Mass felt at the handle, the rotor's inertia included. Used by the spin-out watch and by the "
         "eigenvalues of 'kmax check'.")
        .disarmed_only(),
    real("device.hand_force", group::device, 3, "N", 0, 1000, 5,
         "Largest force of a hand: a handle that gains more energy than the motor and such a hand can have "
         "given it has spun out (encoder slipped, wrong commutation) and trips. 0 turns the watch off.")
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

    real("motor.inductance_q", group::motor, 7, "H", 0, 1, 0,
         "Inductance of the torque-making (q) axis of a salient synchronous motor; 0: as motor.inductance.")
        .disarmed_only(),
    choice("motor.calibrated", group::motor, 8, names::no_or_yes, 0,
           "Whether the values of motor and encoder have been identified; 'kmax calibrate' says yes. A "
           "synchronous motor is not armed otherwise, but after a calibration in this power cycle.")
        .disarmed_only(),
    choice("motor.commutation_known", group::motor, 9, names::no_or_yes, 0,
           "Whether 'kmax calibrate' has found the rotor's electrical angle in this power cycle. Forgotten "
           "when the counts or their meaning change; see measured.commutation_known.")
        .disarmed_only()
        .volatile_value(),

    real("current.limit", group::current, 1, "A", 0.1, 120, 5,
         "Largest motor current; a phase that carries half as much again trips the axis.")
        .disarmed_only(),
    real("current.bandwidth", group::current, 2, "rad/s", 1, 15700, 3000,
         "Bandwidth (-3 dB) of the current loop, up to an eighth of the tick rate.")
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
           "Index line of a quadrature encoder. When it is first passed after a start, counts are referred "
           "to it: the index is at a whole number of turns. From then on a cable that comes off is found at "
           "once, since all lines read high away from the index.")
        .disarmed_only(),
    choice("encoder.start", group::encoder, 6, names::encoder_start, 0,
           "Where the handle is when the device starts: anywhere, or always in the same rest, so that counts "
           "from there mean the same after every start.")
        .disarmed_only(),

    real("temperature.limit", group::temperature, 1, "degC", -40, 200, 100,
         "Trip level of the power stage's temperature.")
        .only_lower(),
    real("temperature.derating", group::temperature, 2, "degC", 0, 100, 20,
         "The current limit falls in proportion over this much below a trip level, of power stage and motor.")
        .only_higher(),
    real("temperature.motor_limit", group::temperature, 3, "degC", 0, 300, 120,
         "Trip level of the winding's computed temperature; 0 turns it off.")
        .only_lower()
        .off_at_zero(),
    real("temperature.ambient", group::temperature, 4, "degC", -40, 100, 25,
         "Temperature around the motor, at which it is taken to start.")
        .only_higher(),
    real("temperature.winding_capacity", group::temperature, 5, "J/K", 0.01, 1e5, 15,
         "Heat capacity of the winding.")
        .disarmed_only(),
    real("temperature.winding_resistance", group::temperature, 6, "K/W", 0.01, 1000, 3,
         "Thermal resistance from winding to case.")
        .only_higher(),
    real("temperature.case_capacity", group::temperature, 7, "J/K", 0.01, 1e6, 150,
         "Heat capacity of the motor's case.")
        .disarmed_only(),
    real("temperature.case_resistance", group::temperature, 8, "K/W", 0.01, 1000, 8,
         "Thermal resistance from case to ambient.")
        .only_higher(),

    whole("drive.controlword", group::drive, 1, unsigned16, "", 0, 65535, 0,
          "CiA 402 controlword: 6 shutdown, 7 switch on, 15 enable operation, 2 quick stop, 0 disable "
          "voltage, 128 fault reset (rising edge).")
        .volatile_value()
        .at_standard_index(0x6040),
    choice(
        "drive.mode", group::drive_mode, 1, names::drive_mode, 0,
        "What an armed axis does: render the wall, follow excitation.* without a wall (identification and "
        "self-test), or make profile.target_torque. profile.operation_mode is the same in CiA 402's numbers.")
        .disarmed_only()
        .volatile_value(),
    whole(
        "drive.commander", group::drive_mode, 2, unsigned16, "", 0, 65535, 0,
        "Number of whoever is about to arm the axis, of its own choice. Not 0: link.timeout then goes by how "
        "long link.sign_of_life has not been written with this number over the link that armed the axis, and "
        "nothing else keeps it armed. Back to 0 when the axis is disarmed, or was not armed.")
        .volatile_value(),
    choice(
        "drive.declared_absent", group::drive_mode, 3, names::no_or_yes, 0,
        "yes: the board has no such axis, or it is not to be used. Its current sensors, its encoder and its "
        "settings are left alone, and it cannot be armed. A gate driver that is there and reports a fault "
        "holds up all axes nevertheless: the fault line is common.")
        .disarmed_only(),

    choice("excitation.kind", group::excitation, 1, names::excitation_kind, 0,
           "What is excited: a voltage or a current vector in the stator's frame, a torque-making current in "
           "the rotor's frame, or the handle's position through a spring and damper. A DC motor has "
           "magnitudes only.")
        .volatile_value(),
    whole("excitation.run", group::excitation, 2, unsigned16, "", 0, 65535, 0,
          "A number other than the one at arming starts the excitation, another one starts it anew.")
        .volatile_value(),
    real("excitation.bias", group::excitation, 3, "", -200, 200, 0, "Steady part, V or A.").volatile_value(),
    real("excitation.alternation", group::excitation, 4, "", -200, 200, 0,
         "Amplitude of a square wave, V or A.")
        .volatile_value(),
    whole("excitation.half_period", group::excitation, 5, unsigned32, "ticks", 0, 1e6, 0,
          "Half a period of the square wave; 0: none.")
        .volatile_value(),
    choice("excitation.alternation_axis", group::excitation, 6, names::alternation_axis, 0,
           "The square wave acts along the vector, or a quarter electrical turn ahead.")
        .volatile_value(),
    real("excitation.angle", group::excitation, 7, "rad", -7, 7, 0,
         "Electrical angle of the vector at the start.")
        .volatile_value(),
    real("excitation.angle_rate", group::excitation, 8, "rad/s", -10000, 10000, 0,
         "Electrical speed at which the vector turns.")
        .volatile_value(),
    real("excitation.angle_span", group::excitation, 9, "rad", 0, 10000, 0,
         "The vector stands after having turned this far.")
        .volatile_value(),
    real("excitation.ramp", group::excitation, 10, "s", 0, 10, 0.05, "Time in which the amplitudes come up.")
        .volatile_value(),
    real("excitation.duration", group::excitation, 11, "s", 0, 60, 1,
         "Nothing is excited any more after this time.")
        .volatile_value(),
    real("excitation.travel", group::excitation, 12, "m", 0, 1, 0.001,
         "Trip level: how far the handle may be from where it was when the axis was armed.")
        .only_lower()
        .volatile_value(),
    real("excitation.stiffness", group::excitation, 13, "N/m", 0, 1e5, 200, "Spring of kind 'position'.")
        .volatile_value(),
    real("excitation.damping", group::excitation, 14, "N s/m", 0, 1000, 2, "Damper of kind 'position'.")
        .volatile_value(),
    real("excitation.speed", group::excitation, 15, "m/s", 0, 10, 0.005,
         "Speed of the point that kind 'position' follows.")
        .volatile_value(),
    real("excitation.stroke", group::excitation, 16, "m", -1, 1, 0,
         "How far that point moves from the start.")
        .volatile_value(),

    real("compensation.dead_time", group::compensation, 1, "s", 0, 5e-6, 0,
         "Dead time of the bridge that is made up for; 0: not.")
        .disarmed_only(),
    real("compensation.dead_time_current", group::compensation, 2, "A", 0.001, 100, 0.1,
         "Current within which that goes smoothly through zero.")
        .disarmed_only(),
    real("compensation.limit", group::compensation, 3, "N", 0, 100, 0,
         "Bound on friction, cogging and gravity compensation together; 0: off. Must be below "
         "guard.friction, so that a handle at rest cannot be moved by it.")
        .disarmed_only(),
    real("compensation.friction", group::compensation, 4, "N", 0, 100, 0,
         "Coulomb friction that is made up for.")
        .disarmed_only(),
    real("compensation.friction_velocity", group::compensation, 5, "m/s", 0.001, 10, 0.02,
         "Velocity up to which friction compensation grows from zero.")
        .disarmed_only(),
    whole("compensation.cogging_periods", group::compensation, 6, unsigned16, "", 0, 1024, 0,
          "Cogging periods in a turn of the shaft; 0: none.")
        .disarmed_only(),
    real("compensation.cogging_cosine_1", group::compensation, 7, "N", -100, 100, 0, "Cogging at the handle.")
        .disarmed_only(),
    real("compensation.cogging_sine_1", group::compensation, 8, "N", -100, 100, 0, "Cogging at the handle.")
        .disarmed_only(),
    real("compensation.cogging_cosine_2", group::compensation, 9, "N", -100, 100, 0,
         "Second harmonic of the cogging.")
        .disarmed_only(),
    real("compensation.cogging_sine_2", group::compensation, 10, "N", -100, 100, 0,
         "Second harmonic of the cogging.")
        .disarmed_only(),
    real("compensation.gravity_constant", group::compensation, 11, "N", -100, 100, 0,
         "Force of gravity or of a spring on the handle, its constant part.")
        .disarmed_only(),
    real("compensation.gravity_cosine", group::compensation, 12, "N", -100, 100, 0,
         "Its part with the cosine of the shaft's angle.")
        .disarmed_only(),
    real("compensation.gravity_sine", group::compensation, 13, "N", -100, 100, 0,
         "Its part with the sine of the shaft's angle.")
        .disarmed_only(),

    choice("profile.operation_mode", group::profile, 1, names::operation_mode, -1,
           "CiA 402 modes of operation: -1 haptic, -2 excitation, 10 cyclic synchronous torque. drive.mode "
           "in the standard's numbers; writing either sets both.")
        .disarmed_only()
        .volatile_value()
        .at_standard_index(0x6060),
    whole("profile.target_torque", group::profile, 2, integer16, "1/1000", -32768, 32767, 0,
          "Torque asked for in mode torque, in thousandths of profile.rated_torque, along +x, within "
          "profile.max_torque; profile.target_force is added to it, and force.limit bounds the sum. 0 "
          "whenever the axis is not armed.")
        .volatile_value()
        .at_standard_index(0x6071),
    whole("profile.max_torque", group::profile, 3, unsigned16, "1/1000", 0, 32767, 1000,
          "Bound on profile.target_torque.")
        .volatile_value()
        .at_standard_index(0x6072),
    choice("profile.polarity", group::profile, 4, names::polarity, 0,
           "CiA 402 polarity: 192 (bits 7 and 6) turns position and velocity round. encoder.direction in the "
           "standard's numbers; writing either sets both.")
        .disarmed_only()
        .volatile_value()
        .at_standard_index(0x607E),
    stop_option("profile.quick_stop_option", 5, names::quick_stop_option, 6, 0x605A,
                "After a quick stop, which removes the force at once: 0 goes on to 'switch on disabled', 6 "
                "stays in 'quick stop active' until the voltage is disabled."),
    stop_option("profile.shutdown_option", 6, names::disable_drive, 0, 0x605B,
                "0: shutdown removes the force at once."),
    stop_option("profile.disable_option", 7, names::disable_drive, 0, 0x605C,
                "0: disabling the operation removes the force at once."),
    stop_option("profile.halt_option", 8, names::halt_option, 1, 0x605D,
                "1: controlword bit 8 in mode torque; the torque goes to zero within force.slew_limit, the "
                "axis stays armed."),
    stop_option("profile.fault_option", 9, names::disable_drive, 0, 0x605E,
                "0: a fault removes the force at once."),
    real("profile.target_force", group::profile, 10, "N", -1000, 1000, 0,
         "Force asked for in mode torque at the handle, along +x; added to what profile.target_torque makes "
         "there, and force.limit bounds the sum. 0 whenever the axis is not armed.")
        .volatile_value(),
    stop_option("profile.abort_connection_option", 11, names::abort_connection_option, 1, 0x6007,
                "1: losing its commander is a fault of the axis; link.loss says how its force goes."),
});

}  // namespace kmax::firmware
