#include "host_tools/experiment/provenance.hpp"

#include <fmt/format.h>

#include "host_tools/device/parameter.hpp"
#include "host_tools/device/value_text.hpp"
#include "host_tools/experiment/paper_numbers.hpp"

namespace kmax::experiment {

std::string identity_of(device::Device& device) {
  std::string text = device.description();
  for (const auto& [name, value] : device.identify()) text += fmt::format(", {} {}", name, value);
  return text;
}

std::vector<std::string> changed_parameters(device::Device& device, std::size_t axis) {
  std::vector<device::Parameter> wanted;
  for (const device::Parameter& parameter : device::all_parameters()) {
    if (parameter.writable() && parameter.definition().persistent &&
        (!parameter.belongs_to_axis() || parameter.axis() == axis))
      wanted.push_back(parameter);
  }
  const std::vector<std::uint32_t> raw = device.read(wanted);
  std::vector<std::string> changed;
  for (std::size_t i = 0; i < wanted.size(); ++i) {
    if (!device::same_value(wanted[i], raw[i], wanted[i].default_raw()))
      changed.push_back(fmt::format("{}={}", wanted[i].name(), device::value_text(wanted[i], raw[i])));
  }
  return changed;
}

std::vector<std::string> references() {
  return {fmt::format("Paper 1: {}", paper::title_1), fmt::format("Paper 2: {}", paper::title_2)};
}

report::Section provenance_section(const Provenance& provenance) {
  report::Section section{"Origin of these numbers", {}, {}, {}};
  section.paragraphs.push_back(fmt::format(
      "Made on {} with {}{}.", provenance.date, provenance.program,
      provenance.device.empty() ? ", on simulated people, without a device" : ", on " + provenance.device));
  if (!provenance.device.empty())
    section.paragraphs.push_back(provenance.parameters.empty()
                                     ? std::string("All parameters are the defaults.")
                                     : fmt::format("Parameters that are not the defaults: {}.",
                                                   fmt::join(provenance.parameters, ", ")));
  if (provenance.seed) {
    section.paragraphs.push_back(fmt::format("Seed of what is simulated by chance: {}.", *provenance.seed));
  } else if (provenance.device.empty()) {
    section.paragraphs.emplace_back(
        "Nothing is left to chance: whoever and whatever is drawn comes from fixed seeds, so the same "
        "sources give the same numbers.");
  }
  for (const std::string& reference : references()) section.paragraphs.push_back(reference);
  return section;
}

}  // namespace kmax::experiment
