#pragma once

#include <array>
#include <cstdint>

namespace kmax::drivers {

/// A classical CAN frame (ISO 11898-1). Two frames are equal when the same bits go over the bus, so bytes
/// beyond `length` and the data of a remote frame do not count.
struct CanFrame {
  std::uint32_t identifier = 0;  ///< 11 bits, or 29 when `extended`
  bool extended = false;
  bool remote = false;
  std::uint8_t length = 0;  ///< 0 to 8
  std::array<std::uint8_t, 8> data{};

  constexpr bool valid() const { return length <= 8 && identifier < (extended ? 1U << 29 : 1U << 11); }

  friend constexpr bool operator==(const CanFrame& a, const CanFrame& b) {
    if (a.identifier != b.identifier || a.extended != b.extended || a.remote != b.remote ||
        a.length != b.length) {
      return false;
    }
    for (unsigned i = 0; !a.remote && i < a.length && i < a.data.size(); ++i) {
      if (a.data[i] != b.data[i]) return false;
    }
    return true;
  }
};

/// The arbitration field as the bus sees it, first bit highest: the smaller number wins. Among frames with
/// the same upper 11 bits: standard data, standard remote, then extended ones.
constexpr std::uint32_t can_arbitration(const CanFrame& frame) {
  if (!frame.extended) return frame.identifier << 21 | (frame.remote ? 1U << 20 : 0U);
  const std::uint32_t upper = frame.identifier >> 18;
  const std::uint32_t lower = frame.identifier & 0x3FFFFU;
  return upper << 21 | 1U << 20 /* SRR */ | 1U << 19 /* IDE */ | lower << 1 | (frame.remote ? 1U : 0U);
}

}  // namespace kmax::drivers
