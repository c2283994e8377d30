#pragma once

#include <cstddef>

#include "drivers/stm32f4/registers/timer.hpp"
#include "host_tools/virtual_board/peripheral.hpp"
#include "tests/host_tools/virtual_board/stm32f4/register_on_model.hpp"

namespace kmax::virtual_board::testing {

/// The block that a timer's driver takes, with a model behind it.
struct TimerOnModel {
  using Layout = drivers::stm32f4::TimerRegisters;
  TimerOnModel(Peripheral& model, const BoardTime& now)
      : cr1(model, offsetof(Layout, cr1), now),
        cr2(model, offsetof(Layout, cr2), now),
        smcr(model, offsetof(Layout, smcr), now),
        dier(model, offsetof(Layout, dier), now),
        sr(model, offsetof(Layout, sr), now),
        egr(model, offsetof(Layout, egr), now),
        ccmr{{model, offsetof(Layout, ccmr[0]), now}, {model, offsetof(Layout, ccmr[1]), now}},
        ccer(model, offsetof(Layout, ccer), now),
        cnt(model, offsetof(Layout, cnt), now),
        psc(model, offsetof(Layout, psc), now),
        arr(model, offsetof(Layout, arr), now),
        rcr(model, offsetof(Layout, rcr), now),
        ccr{{model, offsetof(Layout, ccr[0]), now},
            {model, offsetof(Layout, ccr[1]), now},
            {model, offsetof(Layout, ccr[2]), now},
            {model, offsetof(Layout, ccr[3]), now}},
        bdtr(model, offsetof(Layout, bdtr), now) {}

  RegisterOnModel cr1, cr2, smcr, dier, sr, egr;
  RegisterOnModel ccmr[2];
  RegisterOnModel ccer, cnt, psc, arr, rcr;
  RegisterOnModel ccr[4];
  RegisterOnModel bdtr;
};

/// What a board does up to `end`: every event that is due, in the order of time. Returns their number.
template <typename... Models>
unsigned run_until(BoardTime& now, BoardTime end, Models&... models) {
  unsigned events = 0;
  for (;;) {
    BoardTime next = never;
    ((next = models.next_event() < next ? models.next_event() : next), ...);
    if (next > end || next == never) break;
    now = next;
    ++events;
    (models.advance(now), ...);
  }
  now = end;
  return events;
}

}  // namespace kmax::virtual_board::testing
