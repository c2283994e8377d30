#pragma once
// Tells an oscillation of an armed axis from what a handle does after its force was removed unseen.
//
// A host that stood still for longer than link.timeout reads the trace of that time afterwards, and sees in
// it the handle leave the place where the force held it. That is no instability of the wall.

#include <cstddef>
#include <vector>

#include "host_tools/device/drive.hpp"

namespace kmax::experiment {

class LateAbort {
 public:
  /// At each look at the trace: the time of its last record, s.
  void looked(double time) { looks_.push_back(time); }

  /// Whether the device, which has `status` after the touch, had removed the force for link.timeout before
  /// `time` of the trace. It cannot have done so earlier than link.timeout after the last look before the
  /// first gap that is as long; a tenth is for requests between two looks.
  bool is_late(double time, const device::DriveStatus& status) const {
    if (device::fault_of(status) != firmware::Fault::link_silent) return false;
    const double timeout = 0.9 * static_cast<double>(status.fault_bound);
    double before = 0.0;
    for (const double look : looks_) {
      if (look - before >= timeout) return time > before + timeout;
      before = look;
    }
    return false;
  }

 private:
  std::vector<double> looks_;
};

}  // namespace kmax::experiment
