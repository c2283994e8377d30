#include "host_tools/experiment/setting_check.hpp"

#include <fmt/format.h>

#include <stdexcept>

namespace kmax::experiment {

void SettingCheck::operator()(const char* name, double value, double least, double most) const {
  if (value >= least && value <= most) return;
  throw std::invalid_argument(
      fmt::format("{}: {} = {}: allowed is {} to {}", experiment_, name, value, least, most));
}

void SettingCheck::require_somebody(const std::vector<simulation::OperatorModel>& people) const {
  if (!people.empty()) return;
  throw std::invalid_argument(
      fmt::format("{}: nobody to hold the handle; give at least one person", experiment_));
}

}  // namespace kmax::experiment
