#pragma once

#include <cstdint>
#include <functional>
#include <optional>

#include "drivers/as5047p_frames.hpp"
#include "host_tools/virtual_board/board_time.hpp"

namespace kmax::virtual_board {

/// An AS5047P on a bus: AS5047P data sheet, section SPI interface.
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

  /// CSn: false selects.
  void select(bool level);
  /// None: the chip does not drive the line, and the master reads what the pull makes of it.
  std::optional<std::uint16_t> exchange(std::uint16_t mosi, BoardTime now);

  void set_fitted(bool fitted) { fitted_ = fitted; }

 private:
  std::uint16_t answer(std::uint16_t command, BoardTime now);
  std::uint16_t with_flags(std::uint16_t data) const;

  Angle angle_;
  bool fitted_ = true;
  bool selected_ = false;
  unsigned frames_in_select_ = 0;
  std::uint16_t reply_ = 0;
  std::uint16_t errors_ = 0;
};

}  // namespace kmax::virtual_board
