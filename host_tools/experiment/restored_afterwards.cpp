#include "host_tools/experiment/restored_afterwards.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "host_tools/device/parameter.hpp"
#include "host_tools/device/value_text.hpp"

namespace kmax::experiment {

RestoredAfterwards::RestoredAfterwards(device::Device& device, std::size_t axis,
                                       const std::vector<std::string>& changed, Notice notice)
    : device_(device), notice_(std::move(notice)) {
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
  } catch (const std::exception& error) {
    tell(error.what());
  }
}

void RestoredAfterwards::tell(const char* why) const noexcept {
  if (!notice_) return;
  try {
    std::string text = fmt::format("the parameters of the experiment have not been put back ({}); set", why);
    for (const device::Assignment& assignment : before_)
      text += fmt::format(" {}={}", assignment.parameter.name(),
                          device::value_text(assignment.parameter, assignment.raw));
    notice_(text);
  } catch (...) {
    // Nobody is there to be told.
  }
}

}  // namespace kmax::experiment
