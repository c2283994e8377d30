#pragma once

#include <array>

#include "firmware/object_dictionary/axis_groups.hpp"

namespace kmax::firmware {

using enum Type;

/// What an axis tells: read only.
inline constexpr std::array axis_readings = std::to_array<Entry>({
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
    named_reading("drive.presence", group::drive_status, 6, names::presence,
                  "Whether the board has this axis. no_answer: its gate driver has not answered since the "
                  "start, while another axis' did; declared: drive.declared_absent is yes."),
    reading(
        "drive.gate_driver_faults", group::drive_status, 7, unsigned16, "",
        "What the axis' gate driver said when the drivers' common fault line last fell, a bit each: too much "
        "current in the low side of phase C (1) and in its high side (2), in those of phase B (4 and 8) and "
        "of phase A (16 and 32), over-temperature warning (64) and shut-down (128), motor supply too low "
        "(256), gate supply too low (512) and too high (2048), no answer (4096). 0: nothing; it was another "
        "axis' driver, or interference on the line."),

    reading("measured.tick", group::measured, 1, unsigned32, "ticks",
            "Tick at which these values were taken."),
    reading("measured.position", group::measured, 2, float32, "m", "Position, re-sampled."),
    reading("measured.velocity", group::measured, 3, float32, "m/s", "Estimated velocity."),
    reading("measured.force", group::measured, 4, float32, "N", "Force asked of the device."),
    reading("measured.distance", group::measured, 5, float32, "m",
            "Distance outside the wall; negative inside."),
    reading("measured.magnetic_force", group::measured, 6, float32, "N",
            "Force of the magnetic field, outwards, before instability.softening."),
    reading("measured.magnetic_coefficient", group::measured, 7, float32, "N", "F_MC at work."),
    reading("measured.count", group::measured, 8, integer32, "counts", "Position, re-sampled (low 32 bits).")
        .at_standard_index(0x6064),
    reading("measured.flags", group::measured, 9, unsigned16, "",
            "Bit 0 inside the wall, 1 force limited, 2 slew limited, 3 soft start, 4 armed, 5 motor "
            "saturated: less force than asked for, 6 wall unstable, 7 wall softened."),
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
    reading("measured.winding_temperature", group::measured, 17, float32, "degC",
            "Temperature of the motor's winding, computed from the current."),
    reading("measured.current_limit", group::measured, 18, float32, "A",
            "Current limit in force: current.limit less what the temperatures take."),
    reading("measured.force_made", group::measured, 19, float32, "N",
            "Force at the handle that the measured current makes."),
    reading("measured.commutation_known", group::measured, 20, unsigned8, "",
            "1: a synchronous motor's electrical angle is known, or none is needed."),
    reading("measured.excitation_finished", group::measured, 21, unsigned8, "",
            "1: the present excitation has ended."),
    reading("measured.offset_b", group::measured, 22, float32, "A",
            "What the current sensor of leg B reads at rest, which is taken off. It drifts with the board's "
            "temperature and is tracked."),
    reading("measured.offset_c", group::measured, 23, float32, "A", "The same of leg C."),

    reading("trip.tick", group::trip, 1, unsigned32, "ticks", "Tick of the present fault."),
    reading("trip.position", group::trip, 2, float32, "m", "Position in that tick."),
    reading("trip.velocity", group::trip, 3, float32, "m/s", "Velocity in that tick."),
    reading("trip.force", group::trip, 4, float32, "N", "Force asked for in that tick."),
    reading("trip.current", group::trip, 5, float32, "A", "Motor current in that tick."),
    reading("trip.current_reference", group::trip, 6, float32, "A", "Motor current asked for in that tick."),
    reading("trip.supply", group::trip, 7, float32, "V", "Supply in that tick; 0 on a board that has none."),
    reading("trip.temperature", group::trip, 8, float32, "degC",
            "Power stage's temperature when the fault was seen."),
    reading("trip.winding_temperature", group::trip, 9, float32, "degC",
            "Winding's temperature when the fault was seen."),

    reading("profile.operation_mode_display", group::profile_actual, 1, integer8, "",
            "CiA 402 mode of operation at work.")
        .at_standard_index(0x6061),
    reading("profile.velocity", group::profile_actual, 2, integer32, "counts/s", "Estimated velocity.")
        .at_standard_index(0x606C),
    reading("profile.rated_current", group::profile_actual, 3, unsigned32, "mA",
            "current.limit in whole milliamperes.")
        .at_standard_index(0x6075),
    reading("profile.rated_torque", group::profile_actual, 4, unsigned32, "mN m",
            "Torque at the motor's shaft at current.limit, in whole millinewtonmetres; at least 1.")
        .at_standard_index(0x6076),
    reading("profile.torque", group::profile_actual, 5, integer16, "1/1000",
            "Torque that the measured current makes, in thousandths of profile.rated_torque.")
        .at_standard_index(0x6077),
    reading("profile.current", group::profile_actual, 6, integer16, "1/1000",
            "Current that makes torque, in thousandths of profile.rated_current.")
        .at_standard_index(0x6078),
    reading("profile.supported_modes", group::profile_actual, 7, unsigned32, "",
            "CiA 402 supported drive modes: bit 9 cyclic synchronous torque, bits 16 and 17 haptic and "
            "excitation.")
        .at_standard_index(0x6502),
    reading("profile.device_type", group::profile_actual, 8, unsigned32, "",
            "CiA 402 device type of this axis: servo drive.")
        .at_standard_index(0x67FF),
    reading(
        "profile.digital_inputs", group::profile_actual, 9, unsigned32, "",
        "CiA 402 digital inputs. Bit 16: the emergency stop is pressed or its line open; 17: the gate driver "
        "pulled its fault line and is not reset yet (not seen while bit 16 is set); 18: the encoder's index "
        "has been passed since the start. There are no limit or home switches.")
        .at_standard_index(0x60FD),

    reading("telemetry.current", group::telemetry, 1, integer16, "mA",
            "measured.current, for a PDO; beyond +-32.767 A it stays there."),

    named_reading("guard.verdict", group::guard_status, 1, names::guard_verdict,
                  "Stability check of the present parameters. Not judged: guard.mode is off, or nothing "
                  "renders a wall."),
    reading("guard.failed", group::guard_status, 2, unsigned16, "",
            "Criteria that fail: bit n stands for number n of guard.criterion."),
    named_reading("guard.criterion", group::guard_status, 3, names::guard_criterion,
                  "Criterion with the least margin: among those that fail, or among all when none does."),
    reading("guard.value", group::guard_status, 4, float32, "",
            "What this criterion judges: a stiffness, N/m; for resolution a force, N; for resolution_speed a "
            "speed, m/s."),
    reading("guard.bound", group::guard_status, 5, float32, "", "Its bound, in the same unit."),

    reading("instability.alarms", group::instability_status, 1, unsigned32, "",
            "How often the wall has been called unstable since arming."),
    reading("instability.last_force", group::instability_status, 2, float32, "N",
            "Amplitude of the force in the last alarm, at its strongest."),
    reading("instability.last_amplitude", group::instability_status, 3, float32, "m",
            "Amplitude of the handle then."),
    reading("instability.last_frequency", group::instability_status, 4, float32, "Hz",
            "Frequency of the oscillation then."),
    reading("instability.softening", group::instability_status, 5, float32, "",
            "Factor on all of the wall's force; 1 unless instability.action 'soften' has brought it down."),
});

}  // namespace kmax::firmware
