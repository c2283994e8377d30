#pragma once

#include <array>
#include <cstdint>
#include <optional>

#include "firmware/parameters/parameter_values.hpp"

namespace kmax::firmware {

/// CANopen's own settings as the last start, or the last save since, left them: what a reset of the
/// communication brings back (CiA 301, 7.3.2.2).
class PowerOnCommunication {
 public:
  void take(const ParameterValues& values) { at_power_on_ = part_of(values); }
  void put_back(ParameterValues& values) const {
    for (std::size_t i = 0; i < at_power_on_.size(); ++i) values.set_raw(first_communication_slot + i, at_power_on_[i]);
  }
  /// Of a set that is being saved.
  void note_saving(const ParameterValues& values) { saving_ = part_of(values); }
  void finish_saving(bool saved) {
    if (saving_ && saved) at_power_on_ = *saving_;
    saving_.reset();
  }

 private:
  using Part = std::array<std::uint32_t, communication_entries.size()>;

  static Part part_of(const ParameterValues& values) {
    Part part{};
    for (std::size_t i = 0; i < part.size(); ++i) part[i] = values.raw(first_communication_slot + i);
    return part;
  }

  Part at_power_on_{};
  std::optional<Part> saving_;
};

}  // namespace kmax::firmware
