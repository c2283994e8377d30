#pragma once

#include <cstdint>
#include <deque>
#include <functional>
#include <optional>
#include <utility>

#include "drivers/stm32f4/interrupts.hpp"
#include "drivers/stm32f4/registers/usart.hpp"
#include "host_tools/virtual_board/board_time.hpp"
#include "host_tools/virtual_board/register_block.hpp"

namespace kmax::virtual_board {

/// USART2 or UART4 as an asynchronous port on APB1: RM0090, chapter Universal synchronous asynchronous
/// receiver transmitter (USART), sections Transmitter, Receiver, Parity control, USART interrupts, USART
/// registers. A bit lasts BRR periods of PCLK1 (16-fold oversampling).
///
/// Transmitter: a byte in DR goes to the shift register at once if that is idle (TXE), else after the stop
/// bits of the byte before; TC when both are empty. Setting TE sends an idle frame first. Clearing UE or TE
/// drops what is being sent, of which the line gets nothing.
///
/// Receiver: RXNE in the middle of the first stop bit, together with PE, FE or NE of that byte; a byte that
/// ends while RXNE is set is lost with ORE. IDLE one frame after the latest byte. Error flags and IDLE are
/// cleared by reading SR and then DR, RXNE by reading DR, TC by reading SR and then writing DR; RXNE and TC
/// also by writing them 0.
///
/// Refused: DMA and error interrupt (EIE), 8-fold oversampling, nine data bits, seven with parity, 1.5 and
/// 0.5 stop bits, break, mute mode, LIN, synchronous, half-duplex, smartcard, IrDA, CTS/RTS; BRR below 16 or
/// changed while enabled; writing DR while the transmitter is off or still full (the byte would be lost),
/// reading DR while the port is off, except right after a read of SR, which is how a program drops old flags
/// before it starts.
class UsartModel final : public RegisterBlock<UsartModel> {
 public:
  static constexpr std::uint32_t size = sizeof(drivers::stm32f4::UsartRegisters);

  /// `interrupt`: usart2 or uart4.
  UsartModel(const BoardClocks& clocks, InterruptLines& lines, drivers::stm32f4::Interrupt interrupt);

  void advance(BoardTime now) override;
  BoardTime next_event() const override;
  /// Bytes that are still to come from outside are kept.
  void reset(BoardTime now) override;

  /// The world sends a byte at the port's own baud rate. Its start bit falls at `now` or, if an earlier byte
  /// is still under way then, right behind that. `parity_ok` means something only with parity enabled. A byte
  /// whose start bit falls while the receiver is off is lost. `now` is not in the past.
  void receive(std::uint8_t byte, bool parity_ok, bool framing_ok, BoardTime now);
  /// The byte to be received next is disturbed: NE comes with it.
  void add_noise() { noise_pending_ = true; }
  /// Bytes that have not begun or ended yet.
  std::size_t bytes_to_come() const { return incoming_.size() + (receiving_ ? 1 : 0); }

  /// Called when the last stop bit of a byte has left.
  void on_transmitted(std::function<void(std::uint8_t, BoardTime end_of_stop_bit)> callback) {
    on_transmitted_ = std::move(callback);
  }
  /// Called when the transmitter starts (true) or ceases (false) to shift a frame out.
  void on_transmitting(std::function<void(bool, BoardTime)> callback) {
    on_transmitting_ = std::move(callback);
  }

  /// Duration of a frame as set up at present; 0 without a baud rate.
  BoardTime frame_time() const;

 private:
  struct Incoming {
    std::uint8_t byte;
    bool parity_ok;
    bool framing_ok;
    bool noise;
    BoardTime earliest;
  };
  struct Reception {
    Incoming incoming;
    BoardTime sampled;  // middle of the first stop bit
    BoardTime end;
  };

  static const RegisterTable<UsartModel>& registers();
  bool enabled() const { return drivers::stm32f4::usart_cr1::Enable::of(cr1_) != 0; }
  bool receiver_on() const;
  bool transmitter_on() const;
  BoardTime bit_time() const;
  BoardTime reception_start() const;
  void begin_reception(BoardTime now);
  void end_reception();
  void end_frame(BoardTime now);
  void load_shift_register(BoardTime now);
  void drop_transmission(BoardTime now);
  std::uint32_t read_status();
  void write_status(std::uint32_t value);
  void write_baud_rate(const Access& access, std::uint32_t value);
  void write_control_1(const Access& access, std::uint32_t value);
  void write_control_2(const Access& access, std::uint32_t value);
  void write_data(const Access& access, std::uint32_t value);
  std::uint32_t read_data(const Access& access);
  void after_write() override { update_interrupt(); }
  void update_interrupt();

  const BoardClocks& clocks_;
  InterruptLines& lines_;
  drivers::stm32f4::Interrupt interrupt_;
  std::function<void(std::uint8_t, BoardTime)> on_transmitted_;
  std::function<void(bool, BoardTime)> on_transmitting_;

  std::uint32_t sr_, brr_ = 0, cr1_ = 0, cr2_ = 0;
  std::uint32_t status_seen_ = 0;  // flags that a read of SR has shown, until the DR access that clears them
  bool level_ = false;

  std::uint32_t received_ = 0;
  std::deque<Incoming> incoming_;
  std::optional<Reception> receiving_;
  BoardTime line_free_ = 0;  // end of the latest byte from outside
  BoardTime idle_at_ = never;
  bool noise_pending_ = false;

  std::optional<std::uint8_t> data_;      // transmit data register
  std::optional<std::uint8_t> shifting_;  // nothing during an idle frame
  BoardTime frame_end_ = never;           // `never`: the transmitter is idle
};

}  // namespace kmax::virtual_board
