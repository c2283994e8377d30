#pragma once
// What a page says of its own origin, so that somebody else can make the same run and knows what differs from
// his own: when, with which program, on what, with which parameters, and after whom.

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "host_tools/device/device.hpp"
#include "host_tools/report/page.hpp"

namespace kmax::experiment {

struct Provenance {
  std::string date;     ///< 2026-11-26
  std::string program;  ///< with version and commit
  std::string device;   ///< address and what it says of itself; empty: simulated people, without any device
  /// NAME=VALUE, of all parameters of that device that are kept over a restart and are not their defaults,
  /// while the experiment ran.
  std::vector<std::string> parameters;
  std::optional<std::uint64_t> seed;  ///< of a simulated device; of people and of a real one nothing
};

/// Who a device is, in a line: its address and its identification.
std::string identity_of(device::Device& device);

/// The parameters that Provenance lists: of the device, and of this axis. Errors: those of Device::read().
std::vector<std::string> changed_parameters(device::Device& device, std::size_t axis);

/// Of the two papers: what is known of where they were published.
std::vector<std::string> references();

/// The last section of an experiment's page.
report::Section provenance_section(const Provenance& provenance);

}  // namespace kmax::experiment
