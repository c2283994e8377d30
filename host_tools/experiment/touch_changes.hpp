#pragma once
// What somebody changes of every touch of an experiment, `--set NAME=VALUE` with the names and units of `kmax
// simulate --set`: the firmware's parameters of wall, velocity estimator and loop, and where device and
// person are simulated, theirs (run-up, delay, compliance, ...). What an experiment itself varies or judges
// is not to be changed here: the message says which option does that.

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "host_tools/experiment/simulated_touch.hpp"
#include "host_tools/simulation/scene.hpp"

namespace kmax::experiment {

/// Who touches, and so what there is to be changed.
enum class Touching : std::uint8_t {
  set_of_people,     ///< simulated, each at several speeds with several pushes
  simulated_person,  ///< one, whose speed and push are the scene's
  device,            ///< whoever holds it
};

/// What the experiment itself varies, and so what is not to be changed.
enum class Varied : std::uint8_t {
  papers_walls,          ///< law, coefficient and mode of the papers' walls
  stiffness_and_speeds,  ///< of a wall that is otherwise anybody's
};

class TouchChanges {
 public:
  /// None.
  TouchChanges() = default;
  /// "NAME=VALUE" each. Throws base::ValueError or simulation::SceneError: an unknown name or one given
  /// twice, one that is not to be changed here, a value that is not allowed, values that do not go together.
  TouchChanges(const std::vector<std::string>& texts, Touching touching,
               Varied varied = Varied::papers_walls);

  bool empty() const { return of_parameters_.empty() && of_scene_.empty(); }
  /// "wall.damping=8", as given, the parameters first.
  std::vector<std::string> words() const;
  /// A sentence, or nothing without any.
  std::string sentence() const;

  /// The firmware's parameters, NAME=VALUE, for a device.
  std::vector<std::string> assignments() const;
  /// Hz, where it is changed.
  std::optional<double> haptic_rate() const;
  bool changes(std::string_view name) const;
  /// Of what is simulated beside the firmware.
  bool of_simulation() const { return !of_scene_.empty(); }

  void apply(TouchSetup& setup) const;
  /// simulated_board::factory_scene() with what is simulated beside the firmware.
  simulation::Scene simulated_device() const;

 private:
  void read();

  std::vector<simulation::SceneSetting> of_parameters_, of_scene_;  ///< names without prefix
  simulation::Scene scene_;                ///< with the values of of_scene_; without any, empty
  control::HapticLoopConfig<float> loop_;  ///< with those of of_parameters_
};

/// What may be changed: names with commas between.
std::string changeable_names(Touching touching);

}  // namespace kmax::experiment
