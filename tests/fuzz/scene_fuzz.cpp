// Any text as a scene file. What is refused is refused with a SceneError that says where; what is taken in is
// finite everywhere: its numbers, what a board is told of them, and its handles and drives in motion.
#include <cctype>
#include <cmath>
#include <string>
#include <string_view>

#include "firmware/parameters/parameter_values.hpp"
#include "host_tools/simulated_board/scene_parameters.hpp"
#include "host_tools/simulation/scene.hpp"
#include "tests/fuzz/fuzz_input.hpp"

namespace kmax::simulation::scene_fuzz {
namespace {

bool says_where(std::string_view message) {
  constexpr std::string_view source = "fuzzed:";
  return message.starts_with(source) && message.size() > source.size() + 5 &&
         std::isdigit(static_cast<unsigned char>(message[source.size()])) &&
         message.find(": ") != message.npos;
}

void require_finite(std::initializer_list<double> numbers) {
  for (const double number : numbers) require(std::isfinite(number), "a scene was taken that is not finite");
}

/// As a board would, some samples long.
void move(const Scene& scene, std::size_t axis) {
  constexpr double sample = 50e-6;
  const SceneAxis& named = scene.axes[axis];
  CoupledHandle handle = scene.make_handle(axis);
  if (handle.has_operator()) handle.begin_motion();
  for (int i = 0; i < 5; ++i) handle.advance(0.5, 0.0, sample);
  require_finite({handle.position(), handle.velocity(), handle.tip_position(), handle.hand_position(),
                  handle.intended_position(), handle.applied_force(), handle.energy()});
  if (!named.motor) return;
  MotorDrive drive = scene.make_drive(axis);
  Supply supply = scene.make_supply();
  InverterCommand command;
  for (int i = 0; i < 5; ++i) {
    drive.advance(sample, command, supply);
    drive.update_encoder();
  }
  require_finite({drive.shaft_angle(), drive.handle().velocity(), drive.mean_torque(),
                  drive.magnetic_energy(), drive.currents()[0], drive.currents()[1], drive.currents()[2]});
}

void read(std::string_view text) {
  Scene scene;
  try {
    scene = parse_scene(text, "fuzzed", simulated_board::check_parameter);
  } catch (const SceneError& error) {
    return require(says_where(error.what()), error.what());
  }
  require(!scene.axes.empty() && scene.axes.size() <= firmware::axis_count,
          "a scene without axes, or of too many");
  require_finite({scene.duration, scene.measurement.window, scene.measurement.threshold});
  for (const auto& one : simulated_board::assignments_of(scene))
    require(firmware::check_value(firmware::descriptors[one.parameter.entry()], one.raw) ==
                firmware::Refusal::none,
            ("a scene was taken that no board can have: " + one.parameter.name()).c_str());
  try {
    firmware::Application board{firmware::BoardIdentity{}};
    simulated_board::preset(board, simulated_board::assignments_of(scene));
  } catch (const SceneError& error) {
    require(std::string_view(error.what()).starts_with("[parameters] "), error.what());
  }
  for (std::size_t axis = 0; axis < scene.axes.size(); ++axis) {
    require(!integrated_parts(scene.axes[axis]).empty(), "an axis without parts");
    move(scene, axis);
  }
}

}  // namespace
}  // namespace kmax::simulation::scene_fuzz

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  kmax::simulation::scene_fuzz::read({reinterpret_cast<const char*>(data), size});
  return 0;
}
