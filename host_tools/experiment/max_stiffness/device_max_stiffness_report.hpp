#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "host_tools/experiment/max_stiffness/device_max_stiffness.hpp"
#include "host_tools/report/page.hpp"

namespace kmax::experiment {

/// A row for each condition: K_max beside the paper's, each with where it comes from.
report::Table device_stiffness_table(const std::vector<DeviceStiffnessResult>& results);

/// A row for each touch.
report::Table device_touch_table(const std::vector<DeviceStiffnessResult>& results);

/// What was done, in sentences.
std::vector<std::string> device_stiffness_words(const DeviceStiffnessSettings& settings,
                                                const TouchLimits& limits, const std::string& device);

/// max_stiffness.md, .html, both tables as .csv, and a picture of every touch's oscillation over its
/// stiffness, if there are touches. Returns the names written. Throws plot::FigureError, std::runtime_error.
std::vector<std::filesystem::path> write_device_stiffness(const std::vector<DeviceStiffnessResult>& results,
                                                          const DeviceStiffnessSettings& settings,
                                                          const TouchLimits& limits,
                                                          const std::string& device,
                                                          const std::filesystem::path& folder,
                                                          const std::string& picture_ending);

}  // namespace kmax::experiment
