#pragma once

#include <cstdint>
#include <functional>

#include "host_tools/virtual_board/board_time.hpp"
#include "host_tools/virtual_board/register_block.hpp"

namespace kmax::virtual_board {

/// SPI3 as a master: RM0090, chapter Serial peripheral interface, sections Configuring the SPI in master
/// mode, Data transmission and reception procedures, Status flags, Error flags.
///
/// A word written to DR goes to the shift register one APB clock later if that is free (TXE rises), else
/// waits in the buffer. A frame takes 16 bits of the prescaled clock. RXNE rises, the word behind it having
/// been exchanged with the world, half a bit before the end, with the last sampling edge; BSY falls at the
/// end, unless the buffer holds the next word, which then follows without a gap. RXNE still up at that
/// moment: OVR, and the new word is lost.
///
/// Refused: all but 16 bits, MSB first, full duplex, master, CPOL 0 and CPHA 1, software NSS with SSI = 1;
/// CRC, DMA, interrupts (RXNEIE, TXEIE, ERRIE), SSOE and I2S; writing DR while SPE = 0 or TXE = 0; clearing
/// SPE while a frame is under way; changing the settings while SPE = 1. SR is read-only.
class SpiModel final : public RegisterBlock<SpiModel> {
 public:
  /// Given the word that went out and the end of its frame, returns the one that came in. All chips whose
  /// select is low see it; the board ands their outputs, and reads the pull's level where nobody drives.
  using Wire = std::function<std::uint16_t(std::uint16_t mosi, BoardTime now)>;

  explicit SpiModel(const BoardClocks& clocks) : RegisterBlock("SPI3", registers()), clocks_(clocks) {}
  /// Must be set before the first frame.
  void on_frame(Wire wire) { wire_ = std::move(wire); }
  /// The frame under way, or the last one.
  BoardTime frame_began() const { return began_at_; }

  void advance(BoardTime now) override;
  BoardTime next_event() const override { return next_event_; }
  void reset(BoardTime now) override;

  bool busy() const { return shifting_; }
  std::uint64_t overruns() const { return overruns_; }

 private:
  static const RegisterTable<SpiModel>& registers();
  void write_cr1(const Access& access, std::uint32_t value);
  std::uint32_t read_status();
  std::uint32_t read_data();
  void write_data(const Access& access, std::uint32_t value);
  void after_write() override { schedule(); }
  void begin_frame(BoardTime now);
  void schedule();
  BoardTime bit_time() const;

  const BoardClocks& clocks_;
  Wire wire_;
  std::uint32_t cr1_ = 0;
  bool buffer_full_ = false;
  std::uint16_t buffer_ = 0;
  bool shifting_ = false;
  bool sampled_ = false;  ///< the last bit of the frame under way has been sampled
  std::uint16_t shift_ = 0;
  BoardTime began_at_ = 0, begins_at_ = 0, sampled_at_ = 0, ends_at_ = 0;
  bool received_ = false;
  std::uint16_t received_word_ = 0;
  bool overrun_ = false;
  bool overrun_half_cleared_ = false;  ///< DR has been read, SR not yet
  std::uint64_t overruns_ = 0;
  BoardTime next_event_ = never;
};

}  // namespace kmax::virtual_board
