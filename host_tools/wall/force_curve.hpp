#pragma once

#include <filesystem>

#include "firmware/parameters/parameter_values.hpp"

namespace kmax::wall {

/// Draws force against distance for the plain, the magnetic and the adaptive law with the other parameters
/// given, the adaptive one at rest and at 0.5 m/s towards the wall. Throws plot::FigureError.
void write_force_curves(const firmware::ParameterValues& values, std::size_t axis,
                        const std::filesystem::path& picture);

}  // namespace kmax::wall
