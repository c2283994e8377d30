#pragma once

#include <cstdint>
#include <cstring>
#include <span>

namespace kmax::firmware::canopen {

/// Copies `from` to where `to` begins; the two do not overlap. std::copy may not be told that, and calls
/// memmove: 256 bytes of the image that nothing else needs.
inline void copy_bytes(std::span<const std::uint8_t> from, std::span<std::uint8_t> to) {
  if (!from.empty()) std::memcpy(to.data(), from.data(), from.size());
}

}  // namespace kmax::firmware::canopen
