#pragma once

#include <cstdint>
#include <vector>

#include "host_tools/virtual_board/stm32f4/advanced_timer.hpp"
#include "tests/host_tools/virtual_board/stm32f4/timer_on_model.hpp"

namespace kmax::virtual_board::testing {

// Bits as RM0090 draws them, written down a second time on purpose.
inline constexpr std::uint32_t cen = 1U << 0, udis = 1U << 1, urs = 1U << 2, opm = 1U << 3, dir = 1U << 4,
                               centre = 1U << 5, arpe = 1U << 7;
inline constexpr std::uint32_t pwm2_preloaded = 0x7878, pwm2_direct = 0x7070, all_legs = 0x555;
inline constexpr std::uint32_t ossi_ossr = 3U << 10, bke = 1U << 12, bkp = 1U << 13, aoe = 1U << 14,
                               moe = 1U << 15;
inline constexpr BoardTime tick = 2;  // 168 MHz

/// TIM1 or TIM8 at 168 MHz, and what it has told the board.
struct AdvancedTimerBench {
  explicit AdvancedTimerBench(AdvancedTimer unit = AdvancedTimer::tim1)
      : model(unit, clocks, interrupts), timer(model, now) {
    model.on_trigger_output([this](BoardTime at) { triggers.push_back(at); });
    model.on_output_change([this](BoardTime at) { changes.push_back(at); });
  }
  static BoardClocks at_168_mhz() {
    BoardClocks fast;
    fast.apb2_timer = tick;
    return fast;
  }
  void load(std::uint32_t top) {
    timer.cr1 = urs | arpe;
    timer.arr = top;
    timer.egr = 1;
    timer.cr1 = urs | arpe | centre;
    triggers.clear();  // MMS = 0 has shown UG
  }
  void count() { timer.cr1 = static_cast<std::uint32_t>(timer.cr1) | cen; }
  void pwm(std::uint32_t top, std::uint32_t mode = pwm2_preloaded) {
    timer.ccmr[0] = mode;
    timer.ccmr[1] = mode & 0xFF;
    timer.ccer = all_legs;
    load(top);
    count();
    timer.bdtr = ossi_ossr | bke | bkp | moe | 21;
    changes.clear();
  }
  void run(BoardTime duration) { run_until(now, now + duration, model); }
  std::uint32_t cnt() { return static_cast<std::uint32_t>(timer.cnt); }
  bool down() { return (static_cast<std::uint32_t>(timer.cr1) & dir) != 0; }
  bool update_flag() { return (static_cast<std::uint32_t>(timer.sr) & 1U) != 0; }

  BoardTime now = 1000;
  BoardClocks clocks = at_168_mhz();
  RecordedInterrupts interrupts;
  AdvancedTimerModel model;
  TimerOnModel timer;
  std::vector<BoardTime> triggers, changes;
};

}  // namespace kmax::virtual_board::testing
