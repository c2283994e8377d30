#pragma once

#include <cstdint>

namespace kmax::firmware {

/// A number that a reset leaves as it is, in memory that no start writes to. After power-on such memory holds
/// anything, which is taken for 0.
struct RetainedCount {
  std::uint32_t number, complement;

  std::uint32_t value() const { return complement == ~number ? number : 0; }
  void set(std::uint32_t value) {
    number = value;
    complement = ~value;
  }
};

}  // namespace kmax::firmware
