#include "host_tools/experiment/restored_afterwards.hpp"

#include <algorithm>

#include "host_tools/device/parameter.hpp"

namespace kmax::experiment {

RestoredAfterwards::RestoredAfterwards(device::Device& device, std::size_t axis,
                                       const std::vector<std::string>& changed)
    : device_(device) {
  std::vector<device::Parameter> parameters;
  for (const std::string& text : changed) {
    const device::Parameter parameter = device::resolve(text.substr(0, text.find('=')), axis);
    if (std::find(parameters.begin(), parameters.end(), parameter) == parameters.end())
      parameters.push_back(parameter);
  }
  const std::vector<std::uint32_t> raw = device_.read(parameters);
  for (std::size_t i = 0; i < parameters.size(); ++i) before_.push_back({parameters[i], raw[i]});
}

RestoredAfterwards::~RestoredAfterwards() {
  try {
    device_.apply(before_);
  } catch (const std::exception&) {
    // The link is gone, and with it the way to put anything back.
  }
}

}  // namespace kmax::experiment
