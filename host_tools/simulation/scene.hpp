#pragma once
// A scene: what a simulated run consists of, in a TOML file. It names its parts; a part that is not named is
// not there and is not integrated (a scene without [operator] is a handle that nobody holds).
//
// docs/scenes.md lists every table and key, from scene_keys.hpp. A further axis has its tables as
// [axis1.device] and so on, as many as the firmware has axes.
//
// Numbers are in SI units, or texts with a unit that converts ("60 g"). Those that are not given keep the
// defaults of the model structs. The wall that a motion aims at is by default the one of the parameters
// `wall.position` and `wall.side` (`axis1.wall...` for the second axis); a motion that names another one is
// refused.
//
// Refused with SceneError, whose text begins with file:line:column and gives the key, its value and what is
// allowed: syntax errors, unknown keys (with what may have been meant), wrong types, values out of range,
// parts that contradict each other.
// Names and values of [parameters] are checked by a function that the caller passes, because the object
// dictionary is not known here, but for the number of axes.

#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <stdexcept>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "host_tools/simulation/contact_measure.hpp"
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
  double window = 1.0;                 // s
  double threshold = unstable_motion;  // m
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

// A value in place of what the file says, or added to it: what `--set NAME=VALUE` is.
struct SceneSetting {
  std::string name;   // "device.mass", "axis1.motion.hold_time", "seed", "parameters.wall.stiffness"
  std::string value;  // as a person writes it: "60 g", "true"
};

// A setting of a part that the scene does not name is refused: it would be a scene of another kind.
Scene load_scene(const std::string& path, const ParameterCheck& check = {},
                 std::span<const SceneSetting> settings = {});

// `source` stands for the file name in messages.
Scene parse_scene(std::string_view text, std::string_view source, const ParameterCheck& check = {},
                  std::span<const SceneSetting> settings = {});

// "exact", or a reference integrator with what it goes by: "rk4, 40 substeps per 2 ms".
std::string to_string(const IntegratorConfig& integrator);

// The parts of an axis that are there and so are integrated or computed, in the order from the actuator to
// the person: "DC motor", "device", "delay of 0.5 ms", "structure", "hand and arm", "encoder noise", ... A
// part that the scene does not name does not appear.
std::vector<std::string> integrated_parts(const SceneAxis& axis);

}  // namespace kmax::simulation
