#pragma once

#include <concepts>
#include <cstdint>
#include <optional>

namespace kmax::drivers {

/// One chip on a bus of 16-bit frames: the way from a chip's driver to whatever moves the bits.
///
///   select(true)    chip select active; the caller leaves the chip its set-up time
///   exchange(word)  one frame out and one in; none: it did not end in time
///   delay_us(n)     at least n microseconds
template <typename Candidate>
concept SpiChip = requires(Candidate chip, bool selected, std::uint16_t word, std::uint32_t microseconds) {
  {chip.select(selected)};
  { chip.exchange(word) } -> std::same_as<std::optional<std::uint16_t>>;
  {chip.delay_us(microseconds)};
};

/// One frame with a chip select of its own around it. A microsecond before and after: DRV8301 and AS5047P ask
/// for less than half of one between select and clock and between two frames, and the chip selects of the
/// ODrive's gate drivers are on PC13 and PC14, which take 0.1 us and more to move. 2 us and the frame.
std::optional<std::uint16_t> exchange_selected(SpiChip auto& chip, std::uint16_t word) {
  chip.select(true);
  chip.delay_us(1);
  const std::optional<std::uint16_t> reply = chip.exchange(word);
  chip.select(false);
  chip.delay_us(1);
  return reply;
}

}  // namespace kmax::drivers
