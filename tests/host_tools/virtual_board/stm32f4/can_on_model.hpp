#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "drivers/stm32f4/can.hpp"
#include "drivers/stm32f4/interrupts.hpp"
#include "host_tools/virtual_board/stm32f4/can_controller.hpp"
#include "host_tools/virtual_board/stm32f4/can_host_node.hpp"
#include "tests/host_tools/virtual_board/stm32f4/register_on_model.hpp"

// The CAN driver on the model of the controller, with its interrupts served, and a bus with time.

namespace kmax::virtual_board::testing {

/// One board on a bus: controller, driver and interrupts.
struct CanBoard {
  using Interrupt = drivers::stm32f4::Interrupt;

  /// Each access takes some core cycles, so that a wait with a bound in reads ends.
  class Register {
   public:
    Register(CanBoard& board, std::size_t offset)
        : board_(&board), offset_(static_cast<std::uint32_t>(offset)) {}
    explicit operator std::uint32_t() const {
      board_->pass_time();
      return board_->model.read({offset_, 4, board_->now()});
    }
    Register& operator=(std::uint32_t word) {
      board_->pass_time();
      board_->model.write({offset_, 4, board_->now()}, word);
      return *this;
    }

   private:
    CanBoard* board_;
    std::uint32_t offset_;
  };
  struct TransmitMailbox {
    Register tir, tdtr, tdlr, tdhr;
  };
  struct ReceiveMailbox {
    Register rir, rdtr, rdlr, rdhr;
  };
  struct Bank {
    Register fr1, fr2;
  };
  struct Registers {
    explicit Registers(CanBoard& b)
        : mcr{b, 0x000},
          msr{b, 0x004},
          tsr{b, 0x008},
          rfr{{b, 0x00C}, {b, 0x010}},
          ier{b, 0x014},
          esr{b, 0x018},
          btr{b, 0x01C},
          mailbox{transmit(b, 0x180), transmit(b, 0x190), transmit(b, 0x1A0)},
          fifo{receive(b, 0x1B0), receive(b, 0x1C0)},
          fmr{b, 0x200},
          fm1r{b, 0x204},
          fs1r{b, 0x20C},
          ffa1r{b, 0x214},
          fa1r{b, 0x21C} {
      for (std::size_t i = 0; i < drivers::stm32f4::can1_filter_banks; ++i) {
        bank.push_back({{b, 0x240 + 8 * i}, {b, 0x244 + 8 * i}});
      }
    }
    static TransmitMailbox transmit(CanBoard& b, std::size_t at) {
      return {{b, at}, {b, at + 4}, {b, at + 8}, {b, at + 12}};
    }
    static ReceiveMailbox receive(CanBoard& b, std::size_t at) {
      return {{b, at}, {b, at + 4}, {b, at + 8}, {b, at + 12}};
    }
    Register mcr, msr, tsr, rfr[2], ier, esr, btr;
    TransmitMailbox mailbox[3];
    ReceiveMailbox fifo[2];
    Register fmr, fm1r, fs1r, ffa1r, fa1r;
    std::vector<Bank> bank;
  };
  struct Pend {
    bool* pending;
    void operator()() const { *pending = true; }
  };
  struct Received {
    drivers::CanFrame frame;
    unsigned fifo;
    std::uint8_t filter;
  };

  CanBoard(CanBus& bus, BoardTime& now) : now_(now), model{clocks, interrupts, bus} {
    clocks.apb1 = units_per_period(42'000'000);
  }
  CanBoard(const CanBoard&) = delete;

  BoardTime now() const { return now_; }
  void pass_time() {
    const BoardTime end = now_ + 10;
    for (BoardTime event = model.next_event(); event <= end; event = model.next_event()) {
      now_ = event;
      model.advance(event);
    }
    now_ = end;
  }

  /// Handlers of all interrupts that are up; false when there was none.
  bool serve() {
    if (!interrupts_enabled) return false;
    bool any = false;
    if (pending || interrupts.level(Interrupt::can1_tx)) {
      pending = false;
      driver.ISR_serve_transmit();
      any = true;
    }
    for (const unsigned fifo : {0U, 1U}) {
      if (!interrupts.level(fifo == 0 ? Interrupt::can1_rx0 : Interrupt::can1_rx1)) continue;
      driver.ISR_receive(fifo, [&](const drivers::CanFrame& frame, std::uint8_t filter) {
        received.push_back({frame, fifo, filter});
      });
      any = true;
    }
    if (interrupts.level(Interrupt::can1_sce)) {
      driver.ISR_serve_status();
      ++status_interrupts;
      any = true;
    }
    return any;
  }

 private:
  BoardTime& now_;

 public:
  BoardClocks clocks;
  RecordedInterrupts interrupts;
  CanController model;
  Registers registers{*this};
  bool pending = false;
  bool interrupts_enabled = true;
  unsigned status_interrupts = 0;
  std::vector<Received> received;
  drivers::stm32f4::Can<Pend, 16, Registers> driver{registers, Pend{&pending}};
};

struct CanBench {
  CanBus bus;
  BoardTime now = 1000;
  CanBoard board{bus, now};

  /// Until `duration` has passed, interrupts served, the main loop every millisecond.
  void run(BoardTime duration) {
    const BoardTime end = now + duration;
    while (now < end) {
      while (board.serve()) {
      }
      if (now >= next_poll) {
        board.driver.poll(static_cast<std::uint32_t>(now / units_per_microsecond));
        next_poll = now + 1000 * units_per_microsecond;
        continue;
      }
      const BoardTime next = std::min({board.model.next_event(), end, next_poll});
      now = std::max(now, next);
      board.model.advance(now);
    }
  }
  void configure(const drivers::stm32f4::CanConfig& config = {}) {
    const auto result = board.driver.configure(config, std::array{drivers::stm32f4::can_filter_accept_all()});
    ASSERT_EQ(result, drivers::stm32f4::CanConfigureResult::ok);
    run(2000 * units_per_microsecond);
    ASSERT_EQ(board.driver.state(), drivers::stm32f4::CanBusState::on_bus);
  }
  BoardTime next_poll = 0;
};

}  // namespace kmax::virtual_board::testing
