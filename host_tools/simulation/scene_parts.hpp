#pragma once
// What is integrated when a scene runs, in words: for a person who reads the result of a run.

#include <string>
#include <vector>

#include "host_tools/simulation/scene.hpp"

namespace kmax::simulation {

// "exact", or a reference integrator with what it goes by: "rk4, 40 substeps per 2 ms".
std::string to_string(const IntegratorConfig& integrator);

// The parts of an axis that are there and so are integrated or computed, in the order from the actuator to
// the person: "DC motor", "device", "delay of 0.5 ms", "structure", "hand and arm", "encoder noise", ... A
// part that the scene does not name does not appear.
std::vector<std::string> integrated_parts(const SceneAxis& axis);

}  // namespace kmax::simulation
