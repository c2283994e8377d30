#include "drivers/cortex_m/system_tick.hpp"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <algorithm>
#include <functional>

#include "tests/drivers/fake_register.hpp"

namespace kmax::drivers::cortex_m::system_tick_test {

/// SysTick and the pending bit on a time line of core cycles. Each register access takes time; unless masked,
/// the handler runs between two accesses as soon as a tick is pending.
class Core {
 public:
  struct Registers {
    FakeRegister ctrl, load, val, calib;
  } registers;
  struct Scb {
    FakeRegister icsr;
  } scb;
  SystemTick<Registers, Scb> tick{registers, scb};

  std::uint64_t now = 0;  // cycles since the start
  bool masked = false;
  std::function<unsigned()> access_time = [] { return 3U; };
  unsigned handler_time = 200;
  std::function<void()> handler_body = [] {};

  explicit Core(std::uint32_t core_hz = 168'000'000, std::uint32_t tick_hz = 20'000) : core_hz_(core_hz) {
    started_ = tick.start(core_hz, tick_hz);
    period_ = registers.load.value + 1;
    registers.val.on_read = [this](std::uint32_t) {
      pass(access_time());
      return value();
    };
    scb.icsr.on_read = [this](std::uint32_t) {
      pass(access_time());
      return pending_ ? 1U << 26 : 0U;
    };
  }

  bool started() const { return started_; }
  std::uint64_t period() const { return period_; }
  std::uint64_t true_us() const { return now / (core_hz_ / 1'000'000); }
  std::uint64_t lost() const { return lost_; }

  void pass(std::uint64_t cycles) {
    while (cycles != 0) {
      const std::uint64_t step = std::min(cycles, period_ - now % period_);
      now += step;
      cycles -= step;
      if (now % period_ == 0) {
        if (pending_) ++lost_;
        pending_ = true;
      }
      run_handler();
    }
  }

  void unmask() {
    masked = false;
    run_handler();
  }

  /// 0 on the cycle of the tick, then from reload down to 1.
  std::uint32_t value() const {
    const std::uint64_t phase = now % period_;
    return phase == 0 ? 0 : static_cast<std::uint32_t>(period_ - phase);
  }

 private:
  void run_handler() {
    if (masked || !pending_ || in_handler_) return;
    in_handler_ = true;
    pending_ = false;
    tick.ISR_count();
    pass(handler_time);
    handler_body();
    in_handler_ = false;
    run_handler();
  }

  std::uint32_t core_hz_;
  std::uint64_t period_ = 1;
  std::uint64_t lost_ = 0;
  bool pending_ = false;
  bool in_handler_ = false;
  bool started_ = false;
};

struct PlainSystemTick : testing::Test {
  SystemTickRegisters registers{};
  ScbRegisters scb{};
  SystemTick<> tick{registers, scb};
};

TEST_F(PlainSystemTick, ReloadAndControlAt168MHz) {
  registers.val = 77;
  ASSERT_TRUE(tick.start(168'000'000, 20'000));
  EXPECT_EQ(registers.load, 8'399U);
  EXPECT_EQ(registers.val, 0U);
  EXPECT_EQ(registers.ctrl, 7U);
  EXPECT_EQ(tick.now_us(), 0U);
}

TEST_F(PlainSystemTick, RefusesWhatWouldNotBeExact) {
  EXPECT_FALSE(tick.start(0, 20'000)) << "no cycle in a period";
  EXPECT_FALSE(tick.start(168'000'000, 0));
  EXPECT_FALSE(tick.start(168'000'000, 30'000)) << "33.3 us";
  EXPECT_FALSE(tick.start(168'500'000, 20'000)) << "168.5 cycles in a microsecond";
  EXPECT_FALSE(tick.start(168'000'000, 8)) << "21 million needs more than 24 bits";
  EXPECT_FALSE(tick.start(1'000'000, 1'000'000)) << "a period of one cycle has no counter value";
  EXPECT_EQ(registers.ctrl, 0U);
  EXPECT_FALSE(tick.start(168'000'000, 10)) << "16.8 million, 2^24 is 16.78 million";
  EXPECT_TRUE(tick.start(16'000'000, 20'000));
  EXPECT_EQ(registers.load, 799U);
}

TEST_F(PlainSystemTick, CounterAtZeroIsTheBeginningOfAPeriod) {
  ASSERT_TRUE(tick.start(168'000'000, 20'000));
  tick.ISR_count();
  registers.val = 0;
  EXPECT_EQ(tick.now_us(), 50U);
  registers.val = 8'399;
  EXPECT_EQ(tick.now_us(), 50U);
  registers.val = 8'400 - 168;
  EXPECT_EQ(tick.now_us(), 51U);
  registers.val = 1;
  EXPECT_EQ(tick.now_us(), 99U);
  scb.icsr = 1U << 26;  // tick due, not counted
  registers.val = 0;
  EXPECT_EQ(tick.now_us(), 100U);
  registers.val = 8'400 - 170;
  EXPECT_EQ(tick.now_us(), 101U);
}

TEST_F(PlainSystemTick, WrapsAfter32Bits) {
  // One tick per 100 ms: 42950 ticks reach 2^32 us.
  ASSERT_TRUE(tick.start(160'000'000, 10));
  for (int i = 0; i < 42'949; ++i) tick.ISR_count();
  registers.val = 16'000'000 - 160;
  const std::uint32_t before = tick.now_us();
  EXPECT_EQ(before, 4'294'900'001U);
  tick.ISR_count();
  const std::uint32_t after = tick.now_us();
  EXPECT_EQ(after, 32'705U);
  EXPECT_EQ(after - before, 100'000U);
}

// Every phase of the period, each access crossing the tick at another place, handler running in between.
TEST(SystemTick, EveryPhaseAroundTheTick) {
  for (unsigned phase = 8'300; phase < 8'420; ++phase) {
    for (const bool masked : {false, true}) {
      for (const unsigned access : {1U, 2U, 5U, 40U}) {
        Core core;
        core.pass(8'400 * 3);
        core.masked = masked;
        core.pass(phase);
        core.access_time = [access] { return access; };
        const std::uint64_t earliest = core.true_us();
        const std::uint32_t read = core.tick.now_us();
        EXPECT_GE(read, earliest) << phase << ' ' << masked << ' ' << access;
        EXPECT_LE(read, core.true_us()) << phase << ' ' << masked << ' ' << access;
      }
    }
  }
}

// The time read lies between the true time before and after the call, in every context; from that it follows
// that it never goes back.
RC_GTEST_PROP(SystemTick, ReadsTheTrueTimeInAnyContext, (std::uint32_t seed)) {
  Core core{*rc::gen::element(168'000'000U, 16'000'000U), *rc::gen::element(20'000U, 1'000U)};
  RC_ASSERT(core.started());
  std::uint32_t state = seed | 1U;
  const auto random = [&state](unsigned limit) {
    state = state * 1'664'525U + 1'013'904'223U;
    return (state >> 8) % limit;
  };
  core.access_time = [&] { return random(16) == 0 ? 1 + random(100) : 1 + random(4); };
  core.handler_time = 1 + random(300);
  core.handler_body = [&core] {
    const std::uint64_t earliest = core.true_us();
    const std::uint64_t read = core.tick.now_us();
    RC_ASSERT(read >= earliest);
    RC_ASSERT(read <= core.true_us());
  };
  std::uint64_t previous = 0;
  for (int i = 0; i < 300; ++i) {
    const auto wait = random(4) == 0
                          ? core.period() - core.now % core.period() - std::min<std::uint64_t>(random(12), 5)
                          : random(static_cast<unsigned>(core.period()));
    core.pass(std::min<std::uint64_t>(wait, core.period()));
    const bool mask = random(2) == 0;
    if (mask) {
      core.masked = true;
      core.pass(random(static_cast<unsigned>(core.period() * 9 / 10 - 800 * 9 / 10 + 1)));
    }
    const std::uint64_t earliest = core.true_us();
    const std::uint64_t read = core.tick.now_us();
    RC_ASSERT(core.lost() == 0U);  // masked for more than a period would be outside the contract
    RC_ASSERT(read >= earliest);
    RC_ASSERT(read <= core.true_us());
    RC_ASSERT(read >= previous);
    previous = read;
    core.unmask();
  }
  RC_ASSERT(previous > 0U);
}

// A context that is held up at every access for a whole period: the answer still lies within the call.
TEST(SystemTick, HeldUpAtEveryAccess) {
  Core core;
  core.handler_time = 1;
  core.pass(1'000);
  core.access_time = [&] { return static_cast<unsigned>(core.period()); };
  const std::uint64_t earliest = core.true_us();
  const std::uint32_t read = core.tick.now_us();
  EXPECT_GE(read, earliest);
  EXPECT_LE(read, core.true_us());
}

}  // namespace kmax::drivers::cortex_m::system_tick_test
