#pragma once

#include <vector>

#include "host_tools/virtual_board/cortex_m/processor.hpp"
#include "host_tools/virtual_board/peripheral.hpp"

// Interleaves the processor with the peripherals' events, in order of time.
//
// The processor runs, and at the beginning of the first block behind the earliest next_event() of all
// peripherals these are advanced, and so on. Register accesses may create earlier events at any moment: after
// every block with an access the limit is taken again, and an access beyond the limit first advances what is
// due. An event is therefore late by less than one block (see processor.hpp) for interrupts, and never for
// what firmware reads.
//
// The order of peripherals whose events fall on the same instant is the order of add(). A peripheral whose
// next_event() does not move on after advance() is a defect and throws std::logic_error.

namespace kmax::virtual_board {

class EventLoop {
 public:
  explicit EventLoop(Processor& processor);
  EventLoop(const EventLoop&) = delete;
  EventLoop& operator=(const EventLoop&) = delete;

  /// Every peripheral with events of its own, the core's SysTick included. It must outlive the loop.
  void add(Peripheral& peripheral) { peripherals_.push_back(&peripheral); }

  /// Runs processor and peripherals until `limit`; never returns RunEnd::sleeping.
  RunEnd run_until(BoardTime limit);

  /// Advances everything that is due at `now` or before, in order of time. Returns next_event(), later than
  /// that.
  BoardTime catch_up(BoardTime now);
  BoardTime next_event() const;

 private:
  Processor& processor_;
  std::vector<Peripheral*> peripherals_;
};

}  // namespace kmax::virtual_board
