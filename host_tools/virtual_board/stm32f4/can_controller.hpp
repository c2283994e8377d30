#pragma once

#include <array>
#include <cstdint>
#include <deque>
#include <optional>

#include "drivers/stm32f4/registers/can.hpp"
#include "host_tools/virtual_board/board_time.hpp"
#include "host_tools/virtual_board/register_block.hpp"
#include "host_tools/virtual_board/stm32f4/can_bus.hpp"
#include "host_tools/virtual_board/stm32f4/can_filters.hpp"

namespace kmax::virtual_board {

/// CAN1: RM0090, chapter Controller area network (bxCAN), sections Operating modes, Test mode, Transmission
/// handling, Reception handling, Error management, bxCAN interrupts, CAN registers.
///
/// Brings its bus with it: advance() and next_event() are those of both, so the board adds only the
/// controller.
///
/// Mailboxes go by identifier, equal ones by number (TXFP = 0); mailboxes written while pending are refused.
/// A FIFO that is full has its newest frame replaced (RFLM = 0). INAK follows INRQ after some clocks, at the
/// end of a frame under way; it falls after 11 recessive bits. Bus-off is left when initialization has been
/// entered and left and 128 times 11 recessive bits have passed. Received bytes beyond DLC read 0xCC:
/// firmware may not rely on them.
///
/// Where the manual is silent: ALST and TERR stay set until the request completes and is acknowledged;
/// entering initialization leaves TEC and REC alone, except in bus-off, when they become 0 with the recovery.
///
/// Refused: TXFP, RFLM, AWUM, ABOM, TTCM, sleep other than after reset, WKUIE, SLKIE, TGT, loop back without
/// silent mode, BTR outside of initialization, writing back TSR or RFxR as read (it clears flags that nobody
/// has looked at).
class CanController final : public RegisterBlock<CanController>, private CanBusNode {
 public:
  CanController(const BoardClocks& clocks, InterruptLines& interrupts, CanBus& bus);
  ~CanController() override { bus_.detach(*this); }

  std::uint32_t read(const Access& access) override;
  void write(const Access& access, std::uint32_t value) override;
  void advance(BoardTime now) override;
  BoardTime next_event() const override;
  void reset(BoardTime now) override;

  /// As CanBus knows it, for CanBus::destroy_frames_of().
  const CanBusNode* node() const { return this; }
  const CanFaultConfinement& errors() const { return errors_; }
  bool bus_off() const { return bus_off_; }
  /// Takes part in the bus: in normal mode, synchronized and not bus-off.
  bool on_bus() const { return mode_ == Mode::normal && !bus_off_ && !self_test(); }

 private:
  enum class Mode : std::uint8_t { sleep, initialization, synchronizing, normal };
  struct Mailbox {
    std::array<std::uint32_t, 4> words{};  ///< TIR, TDTR, TDLR, TDHR
    bool pending = false, on_wire = false, abort = false;
    std::uint32_t status = 0;  ///< RQCP, TXOK, ALST and TERR
  };
  using Received = std::array<std::uint32_t, 4>;  ///< RIR, RDTR, RDLR, RDHR
  struct Fifo {
    std::deque<Received> frames;
    bool full = false, overrun = false;
  };

  // CanBusNode
  BoardTime bit_time() const override { return on_bus() ? configured_bit_time() : 0; }
  bool drives_dominant() const override { return drivers::stm32f4::can_btr::Silent::of(btr_) == 0; }
  bool error_passive() const override { return errors_.passive(); }
  std::optional<drivers::CanFrame> next_frame(BoardTime now) override;
  void on_result(CanOutcome outcome, BoardTime now) override;
  void on_received(const drivers::CanFrame& frame, BoardTime now) override;
  void on_receive_error(CanOutcome kind, BoardTime now) override;
  void on_bus_busy(BoardTime now) override;
  void on_bus_idle(bool after_frame, BoardTime now) override;

  static const RegisterTable<CanController>& registers();
  std::uint32_t read_status() const;
  std::uint32_t status_of_mailboxes() const;
  std::uint32_t fifo_status(unsigned fifo) const;
  std::uint32_t error_status() const;
  std::uint32_t read_mailbox(const Access& access) const;
  std::uint32_t read_fifo(const Access& access) const;
  void write_control(const Access& access, std::uint32_t value);
  void write_status(std::uint32_t value);
  void write_mailbox_status(std::uint32_t value);
  void write_fifo_status(unsigned fifo, std::uint32_t value);
  void write_errors(std::uint32_t value);
  void write_bit_timing(const Access& access, std::uint32_t value);
  void after_write() override { settle(); }
  void write_mailbox(const Access& access, std::uint32_t value);
  void leave_initialization(const Access& access);

  std::optional<unsigned> most_urgent() const;
  std::optional<unsigned> least_urgent() const;
  drivers::CanFrame frame_of(const Mailbox& mailbox) const;
  void complete(Mailbox& mailbox, bool sent);
  void store(const drivers::CanFrame& frame);
  void note_errors(std::uint32_t before, CanOutcome last);
  void begin_self_test_frame(BoardTime now);
  void finish_sequence();
  void settle();

  bool self_test() const { return drivers::stm32f4::can_btr::LoopBack::of(btr_) != 0; }
  BoardTime configured_bit_time() const;

  const BoardClocks& clocks_;
  InterruptLines& interrupts_;
  CanBus& bus_;
  CanFilters filters_;
  Mode mode_ = Mode::sleep;
  std::uint32_t mcr_ = drivers::stm32f4::can_mcr::reset_value;
  std::uint32_t ier_ = 0, btr_ = 0;
  bool error_interrupt_ = false;  ///< ERRI
  std::uint32_t last_error_ = 0;
  std::array<Mailbox, drivers::stm32f4::can_transmit_mailboxes> mailboxes_{};
  std::array<Fifo, drivers::stm32f4::can_fifos> fifos_{};
  CanFaultConfinement errors_;
  bool bus_off_ = false;
  bool wants_initialization_ = false;  ///< INRQ is set, INAK not yet
  BoardTime initialization_at_ = never;
  RecessiveBits recessive_;
  BoardTime self_test_ends_at_ = never;
  std::array<bool, 4> reported_{};  ///< levels of the interrupts, TX first
};

}  // namespace kmax::virtual_board
