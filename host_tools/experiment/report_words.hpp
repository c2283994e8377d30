#pragma once
// Words and numbers that the experiments' reports write in one way.

#include <cstddef>
#include <optional>
#include <string>

#include "host_tools/simulation/device_model.hpp"

namespace kmax::experiment {

/// A table's "yes" or "no".
std::string yes_no(bool value);

/// A rank correlation, "+0.87"; "-" where there is none.
std::string rank_text(const std::optional<double>& rank);

/// "1 person", "12 people".
std::string people_words(std::size_t count);

/// What the simulated device makes of a force: "clipped at 3.3 N", "not clipped".
std::string clipping_words(const simulation::DeviceModel& device);

}  // namespace kmax::experiment
