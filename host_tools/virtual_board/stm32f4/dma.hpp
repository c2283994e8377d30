#pragma once

#include <array>
#include <cstdint>

#include "drivers/stm32f4/registers/dma.hpp"
#include "host_tools/virtual_board/bus.hpp"
#include "host_tools/virtual_board/register_block.hpp"

namespace kmax::virtual_board {

/// DMA2: RM0090, chapter DMA controller. It goes on while the core is halted, hangs or sleeps.
///
/// Modelled: streams that carry a word at each request of their channel from a fixed address in SRAM to a
/// fixed register, in direct mode, once around or circular; NDTR; TCIF. A request is served at the instant at
/// which it is made (silicon: some ten cycles of AHB later, 0.1 us, when the bus is free); of several at one
/// instant the lower stream is first, whatever PL says. What the register refuses stops the board.
///
/// Refused, since no driver uses it: all other directions, widths and increments, bursts, the FIFO, double
/// buffers, interrupts, any change but EN = 0 while a stream is enabled, memory other than SRAM.
class DmaModel final : public RegisterBlock<DmaModel> {
 public:
  static constexpr std::uint32_t size = sizeof(drivers::stm32f4::DmaRegisters);

  explicit DmaModel(Bus& bus) : RegisterBlock("DMA2", registers()), bus_(bus) {}

  void advance(BoardTime now) override;
  BoardTime next_event() const override { return requested_ != 0 ? requested_at_ : never; }
  void reset(BoardTime now) override;

  /// A peripheral raises its request; who listens to another channel does not hear it.
  void request(drivers::stm32f4::DmaRequest request, BoardTime now);
  /// Words that a stream has carried.
  std::uint64_t transfers(unsigned stream) const { return streams_.at(stream).transfers; }

 private:
  struct Stream {
    std::uint32_t cr = 0, ndtr = 0, par = 0, m0ar = 0;
    std::uint32_t left = 0;  ///< of NDTR, while it is enabled
    std::uint64_t transfers = 0;
  };
  static const RegisterTable<DmaModel>& registers();
  std::uint32_t show_status(unsigned half) const { return status_.at(half); }
  void clear_status(unsigned half, std::uint32_t value) { status_.at(half) &= ~value; }
  std::uint32_t show_left(unsigned stream) const;
  void write_control(const Access& access, unsigned stream, std::uint32_t value);
  template <std::uint32_t Stream::*word>
  void write_setting(const Access& access, unsigned stream, std::uint32_t value);
  void carry(unsigned stream, BoardTime now);

  Bus& bus_;
  std::array<Stream, 8> streams_{};
  std::array<std::uint32_t, 2> status_{};
  unsigned requested_ = 0;  ///< a bit for each stream
  BoardTime requested_at_ = 0;
};

}  // namespace kmax::virtual_board
