#pragma once

#include <vector>

#include "firmware/canopen/communication_rules.hpp"

namespace kmax::firmware::canopen {

inline constexpr std::uint8_t test_node_id = 5;
inline constexpr std::uint32_t bit_31 = 1U << 31;

/// CANopen's settings as a host writes them: with the rules, absolute COB-IDs and the node ID 5.
struct CommunicationWrites {
  Abort write(std::uint16_t index, unsigned subindex, std::uint32_t value) {
    const std::size_t slot = at(index, subindex);
    const Abort abort = check_communication(values, slot, value, test_node_id);
    if (abort == Abort::none) values.set_raw(slot, stored_communication(slot, value, test_node_id));
    return abort;
  }
  std::uint32_t read(std::uint16_t index, unsigned subindex) const {
    return shown_communication(at(index, subindex), values.raw(at(index, subindex)), test_node_id);
  }
  static std::size_t at(std::uint16_t index, unsigned subindex) {
    return slot_at({index, static_cast<std::uint8_t>(subindex)}).value();
  }

  /// The standard's order, from whatever there was. The abort of the first write that was refused.
  Abort remap(std::uint16_t communication, const std::vector<std::uint32_t>& objects,
              std::uint32_t identifier, std::uint32_t type = 255, std::uint32_t event_ms = 0,
              std::uint32_t inhibit_100us = 0) {
    const auto mapping = static_cast<std::uint16_t>(communication + 0x200);
    Abort abort = write(communication, 1, bit_31 | identifier);
    const auto next = [&](std::uint16_t index, unsigned subindex, std::uint32_t value) {
      if (abort == Abort::none) abort = write(index, subindex, value);
    };
    next(mapping, 0, 0);
    unsigned count = 0;
    for (const std::uint32_t object : objects) next(mapping, ++count, object);
    next(mapping, 0, count);
    next(communication, 2, type);
    if (communication >= 0x1800) {
      next(communication, 3, inhibit_100us);
      next(communication, 5, event_ms);
    }
    next(communication, 1, identifier);
    return abort;
  }

  ParameterValues values;
};

}  // namespace kmax::firmware::canopen
