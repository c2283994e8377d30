#pragma once

#include <cstdint>

#include "drivers/can_frame.hpp"
#include "firmware/canopen/abort_code.hpp"
#include "firmware/object_dictionary/cob_id.hpp"

namespace kmax::firmware::canopen {

/// SYNC consumer of CiA 301 (7.2.5; object 0x1005). This device does not generate SYNC; it takes one with or
/// without a counter, whose value means nothing here. Main loop only. Cost: constant.
class Sync {
 public:
  /// May `raw` be written to object 0x1005? Not if it asks for generating (bit 30), for a 29-bit identifier,
  /// or for a restricted identifier. Bit 31 has no meaning there and is left alone.
  static constexpr Abort check(std::uint32_t raw) {
    const std::uint32_t id = raw & ~cob_id::invalid;
    return id > cob_id::identifier || cob_id::restricted(id) ? Abort::value_range : Abort::none;
  }

  /// Object 0x1005.
  void configure(std::uint32_t raw) { identifier_ = raw & cob_id::identifier; }

  /// Is it a SYNC? Not with another length than 0 or 1.
  bool receive(const drivers::CanFrame& frame) const {
    return frame.identifier == identifier_ && !frame.extended && !frame.remote && frame.length <= 1;
  }

  std::uint32_t identifier() const { return identifier_; }

 private:
  std::uint32_t identifier_ = cob_id::sync;
};

}  // namespace kmax::firmware::canopen
