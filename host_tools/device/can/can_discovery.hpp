#pragma once

#include <array>
#include <chrono>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace kmax::device {

/// A CANopen node that was found on a bus. What it was not asked, or did not answer, is missing.
struct FoundNode {
  std::uint8_t node = 0;
  std::optional<std::uint8_t> state{};  ///< NMT state of its heartbeat: 4 stopped, 5 operational, 127 pre-
  std::optional<std::uint32_t> device_type{};              ///< 0x1000
  std::optional<std::array<std::uint32_t, 4>> identity{};  ///< 0x1018: vendor, product, revision, serial
  std::string name{};                                      ///< 0x1008
  bool in_use = false;  ///< another program talks to it, so it was not asked
};

struct CanDiscoverySettings {
  std::chrono::milliseconds listening{500};  ///< for heartbeats and conversations of others
  std::chrono::milliseconds response_timeout{60};
  std::size_t asked_at_once = 16;  ///< nodes whose answers may be outstanding
};

/// Finds the CANopen nodes on a bus (as open_can_port() takes it): listens for a while, then reads the device
/// type of every node ID, and the identity of those that answer. Takes a second with the settings above.
///
/// A node that answers no SDO (stopped, or listening only) is found if it sends heartbeats. A node in whose
/// SDO conversation with somebody else a request would end that one's transfer is not asked: one whose
/// conversation was heard, and one that another kmax holds (CanNodeLock).
///
/// Ordered by node ID. Errors: LinkError.
std::vector<FoundNode> discover_nodes(const std::string& bus, const CanDiscoverySettings& settings = {});

}  // namespace kmax::device
