#pragma once

#include <cstdint>
#include <functional>
#include <optional>

#include "drivers/as5047p_frames.hpp"
#include "host_tools/virtual_board/board_time.hpp"

namespace kmax::virtual_board {

/// How the select reaches the chip, s. `filter`: 3.3 kohm in series and 82 pF to ground at GPIO7 (schematic
/// of v3.5, vendor's pinout), with 20 pF of wire and pin (guess); 0 with the solder jumper J20 closed. It
/// passes the thresholds, 0.3 and 0.7 of the supply, after 1.2 time constants. `set_up`: from the select to
/// the first clock edge, and the shortest pause between two selects (data sheet, from memory: 350 ns each).
struct SelectTiming {
  double filter = 3.3e3 * 102e-12;
  double set_up = 350e-9;
};

/// An AS5047P on a bus: AS5047P data sheet, section SPI interface.
///
/// A frame whose select came too late, or after too short a pause, is not the chip's: it does not answer.
///
/// The reply to a command is shifted out in the next frame. A command with wrong parity, or an address that
/// does not exist, sets ERRFL, and EF in all replies until ERRFL is read; the reply to such a command is 0
/// with EF. A select without a frame, or with two, is a framing error. The angle is that of the moment at
/// which the command ends.
///
/// Not modelled and refused: writing (PROG, SETTINGS, ZPOS). Reading ZPOSM, ZPOSL, SETTINGS1 and 2 is refused
/// as well.
class As5047pChip {
 public:
  /// Angle in counts of 1/16384 turn at an instant; only the lower 14 bits are used.
  using Angle = std::function<std::int64_t(BoardTime now)>;

  explicit As5047pChip(Angle angle) : angle_(std::move(angle)) {}

  /// CSn, as the master drives it: false selects.
  void select(bool level, BoardTime now);
  /// A frame that began at `began` and whose last bit is sampled now. None: the chip does not drive the line,
  /// and the master reads what the pull makes of it.
  std::optional<std::uint16_t> exchange(std::uint16_t mosi, BoardTime now, BoardTime began);

  void set_select_timing(const SelectTiming& timing) { timing_ = timing; }
  /// Frames that were not the chip's.
  std::uint64_t late_selects() const { return late_selects_; }
  void set_fitted(bool fitted) { fitted_ = fitted; }

 private:
  std::uint16_t answer(std::uint16_t command, BoardTime now);
  std::uint16_t with_flags(std::uint16_t data) const;

  Angle angle_;
  SelectTiming timing_;
  BoardTime ready_at_ = 0;     ///< from then on a frame may begin
  BoardTime released_at_ = 0;  ///< CSn high at the chip
  std::uint64_t late_selects_ = 0;
  bool fitted_ = true;
  bool selected_ = false;
  unsigned frames_in_select_ = 0;
  std::uint16_t reply_ = 0;
  std::uint16_t errors_ = 0;
};

}  // namespace kmax::virtual_board
