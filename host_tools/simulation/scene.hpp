#pragma once
// A scene: what a simulated run consists of, in a TOML file. It names its parts; a part that is not named is
// not there and is not integrated (a scene without [operator] is a handle that nobody holds).
//
//   name = "touch"                  optional; the file name without ending
//   description = "..."             optional
//   duration = 5.0                  s, from the start of the motion
//   seed = 1                        for parts with noise
//   identified = true               whether a board starts with the values of the scene's motors, as after a
//                                   calibration; false: with the factory's
//
//   [device]                        required: device_model.hpp; also start_position (m), start_velocity (m/s)
//   [structure]                     device_model.hpp: the handle behind a compliant structure
//   [operator]                      operator_model.hpp; in [axis1.operator] also same_person = true: the hand
//                                   is that of axis 0's person, so that grip and arm answer to the background
//                                   forces of both axes, which stand at right angles. Without [motion] the
//                                   person stays at the start
//   [motion]                        intended_motion.hpp; needs [operator]
//   [encoder]                       encoder_config.hpp; also kind = "quadrature" (default) or "as5047p", and
//                                   reversed = true: it counts downwards; select_filtered = false: an
//                                   AS5047P's select passes no filter (jumper J20). Without a motor: a count,
//                                   without index, chip or mounting, but with noise and dropouts if asked for
//   [motor]                         kind = "ideal" (as without the table: a force source with the device's
//                                   force limit), "dc" (brushed_dc_motor.hpp) or "pmsm"
//                                   (synchronous_motor.hpp; also inductance for inductance_d and
//                                   inductance_q). Also defects = ["phase_b_open", ...] (defect.hpp) of a
//                                   real motor, which are there from the beginning
//   [inverter] [current_sensor]     inverter.hpp, current_sensor.hpp; need a motor that is not ideal
//   [integrator]                    integrator_config.hpp, one for all axes: kind = "exact" (default),
//                                   "semi_implicit_euler", "rk4" or "adaptive", with substeps or tolerance
//                                   where the kind has them. Of the mechanical parts: circuits are always
//                                   solved exactly
//   [supply]                        supply.hpp, one for all axes; its divider_ratio says which variant of the
//                                   board it is, 11 that for 24 V and 19 that for 56 V. part_ratings = false:
//                                   its parts bear everything
//   [spikes]                        spikes.hpp: interference on the lines of a virtual board. Also
//   at_samples, index,
//                                   emergency_stop, fault_line, encoder = true or false
//   [parameters]                    firmware parameters, `wall.stiffness = 5500` or `"wall.stiffness" = 5500`
//   [measurement]                   window (s, the end of the hold phase that is judged), threshold (m)
//   [axis1.device] [axis1.structure] [axis1.operator] [axis1.motion] [axis1.encoder] [axis1.motor]
//   [axis1.inverter] [axis1.current_sensor]   a second axis, and so on, as many as the firmware has
//
// SI units. Numbers that are not given keep the defaults of the model structs. The wall that a motion aims at
// is by default the one of the parameters `wall.position` and `wall.side` (`axis1.wall...` for the second
// axis); a motion that names another one is refused.
//
// Refused with SceneError, whose text begins with file:line:column and gives the key, its value and what is
// allowed: syntax errors, unknown keys (with what may have been meant), wrong types, values out of range,
// parts that contradict each other.
// Names and values of [parameters] are checked by a function that the caller passes, because the object
// dictionary is not known here, but for the number of axes.

#include <cstdint>
#include <functional>
#include <optional>
#include <stdexcept>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "host_tools/simulation/coupled_handle.hpp"
#include "host_tools/simulation/defect.hpp"
#include "host_tools/simulation/device_model.hpp"
#include "host_tools/simulation/encoder_config.hpp"
#include "host_tools/simulation/integrator_config.hpp"
#include "host_tools/simulation/intended_motion.hpp"
#include "host_tools/simulation/motor_drive.hpp"
#include "host_tools/simulation/operator_model.hpp"
#include "host_tools/simulation/spikes.hpp"
#include "host_tools/simulation/supply.hpp"

namespace kmax::simulation {

class SceneError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

struct Measurement {
  double window = 1.0;          // s
  double threshold = 0.165e-3;  // m
};

using ParameterValue = std::variant<bool, std::int64_t, double, std::string>;

struct SceneParameter {
  std::string name;
  ParameterValue value;
  std::string where;  // file:line:column, for a later error message
};

struct SceneAxis {
  DeviceModel device;
  HandleStart start;
  std::optional<OperatorModel> person;
  bool same_person = false;  // as axis 0's; of a further axis
  std::optional<IntendedMotionConfig> motion;
  EncoderConfig encoder;
  std::optional<MotorConfig> motor;  // none: ideal
  InverterConfig inverter;
  CurrentSensorConfig current_sensor;
  std::vector<Defect> defects;  // of the motor's axis, from the beginning

  CoupledHandle make_handle(const IntegratorConfig& integrator = {}) const;
  // The handle behind its motor, without the device's force limit. Throws std::logic_error without a motor.
  MotorDrive make_drive(std::uint64_t seed, const IntegratorConfig& integrator = {}) const;
};

struct Scene {
  std::string name;
  std::string description;
  double duration = 5.0;
  std::uint64_t seed = 1;
  bool identified = true;
  std::vector<SceneAxis> axes;  // 1 to firmware::axis_count
  std::vector<SceneParameter> parameters;
  Measurement measurement;
  std::optional<SupplyConfig> supply;
  std::optional<SpikesConfig> spikes;
  IntegratorConfig integrator;

  // A seed of its own for the noise of that axis, made from the scene's.
  std::uint64_t seed_of(std::size_t axis) const;
  // The axis' make_handle() and make_drive(), with the scene's integrator and the axis' seed.
  CoupledHandle make_handle(std::size_t axis) const { return axes.at(axis).make_handle(integrator); }
  MotorDrive make_drive(std::size_t axis) const {
    return axes.at(axis).make_drive(seed_of(axis), integrator);
  }
  Supply make_supply() const { return Supply(supply.value_or(SupplyConfig{})); }
};

// Returns what is wrong with a parameter, or nothing if it is right.
using ParameterCheck =
    std::function<std::optional<std::string>(const std::string& name, const ParameterValue& value)>;

Scene load_scene(const std::string& path, const ParameterCheck& check = {});

// `source` stands for the file name in messages.
Scene parse_scene(std::string_view text, std::string_view source, const ParameterCheck& check = {});

// "exact", or a reference integrator with what it goes by: "rk4, 40 substeps per 2 ms".
std::string to_string(const IntegratorConfig& integrator);

// The parts of an axis that are there and so are integrated or computed, in the order from the actuator to
// the person: "DC motor", "device", "delay of 0.5 ms", "structure", "hand and arm", "encoder noise", ... A
// part that the scene does not name does not appear.
std::vector<std::string> integrated_parts(const SceneAxis& axis);

}  // namespace kmax::simulation
