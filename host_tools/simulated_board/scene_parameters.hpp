#pragma once

#include <vector>

#include "firmware/application.hpp"
#include "host_tools/device/value_text.hpp"
#include "host_tools/simulation/scene.hpp"

namespace kmax::simulated_board {

/// Checks a scene's [parameters] against the object dictionary: what load_scene() asks for every one.
std::optional<std::string> check_parameter(const std::string& name, const simulation::ParameterValue& value);

/// What a board must know to fit the scene's hardware, counts per turn, transmission and mass of each axis,
/// followed by the scene's own parameters, which may say otherwise (a wrongly set-up device is a scene too).
std::vector<device::Assignment> assignments_of(const simulation::Scene& scene);

/// The two parts of that by themselves: what fits the board to the hardware, and what the scene says.
///
/// The hardware of an axis is what its user knows who has built it: counts per turn, transmission, and with a
/// motor its kind and the encoder's. In a scene that is identified also what a calibration finds: the mass,
/// and identified_assignments_of().
std::vector<device::Assignment> hardware_assignments_of(const simulation::Scene& scene);
std::vector<device::Assignment> own_assignments_of(const simulation::Scene& scene);

/// The truth about the scene's motors and how their encoders are mounted, as parameters: what an exact
/// calibration of a handle that started where the scene says would find. The resistance is that of the
/// circuit which the controller drives, with the legs that the current passes: one for a phase, two for a DC
/// motor.
std::vector<device::Assignment> identified_assignments_of(const simulation::Scene& scene);

/// Sets all of them in one transaction before the first tick. Throws simulation::SceneError naming the
/// parameter if the set as a whole is refused.
void preset(firmware::Application& application, const std::vector<device::Assignment>& assignments);

}  // namespace kmax::simulated_board
