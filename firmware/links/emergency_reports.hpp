#pragma once

#include <array>
#include <cstdint>

#include "firmware/board_interface/can_port.hpp"
#include "firmware/canopen/emergency.hpp"
#include "firmware/drive/fault.hpp"
#include "firmware/object_dictionary/entry.hpp"

namespace kmax::firmware {

/// What an emergency message can be about, at one moment.
struct EmergencyCauses {
  std::array<Fault, axis_count> faults{};
  std::array<float, axis_count> fault_values{};  ///< in the fault's unit
  CanState can_state = CanState::absent;
  std::uint32_t identity_conflicts = 0;  ///< counted
  std::uint32_t frames_lost = 0;         ///< counted
};

/// Emergency messages of CANopen for every fault of an axis, when it comes and when it goes, and for the bus'
/// own troubles. What is only counted is over when it has not happened for a while. Main loop only.
class EmergencyReports {
 public:
  void poll(const EmergencyCauses& now, canopen::Emergency& emergency, std::uint32_t now_us);

 private:
  EmergencyCauses reported_;
  std::uint32_t overrun_us_ = 0, conflict_us_ = 0;
};

}  // namespace kmax::firmware
