#pragma once

#include <cstdint>

// Who may interrupt whom, for the whole board: 0 is the most urgent, 15 the least.
//
// The microsecond clock is exact only in contexts that do not outrank the tick, so nothing that asks for the
// time may stand above it.

namespace kmax::board::odrive_v3::priority {

inline constexpr std::uint8_t tick = 0;
inline constexpr std::uint8_t serial = 8;

static_assert(tick < serial);

}  // namespace kmax::board::odrive_v3::priority
