#include "drivers/stm32f4/phase_shifted_pwm.hpp"

#include <gtest/gtest.h>

#include "tests/drivers/fake_register.hpp"

// What needs hardware that acts is tested on the virtual board's timers; here, what happens when it does not.

namespace kmax::drivers::stm32f4::phase_shifted_pwm_test {

constexpr ThreePhasePwmConfig typical{
    .half_period_ticks = 4200, .dead_time_code = 21, .minimum_low_ticks = 252};

struct Pair {
  Pair() {
    // The part of UG that the driver looks at: 0, or ARR when the direction is down.
    for (FakeTimer* timer : {&leader_timer, &follower_timer}) {
      timer->egr.on_write = [timer](std::uint32_t) {
        timer->cnt.value = (timer->cr1.value & 1U << 4) != 0 ? timer->arr.value : 0;
      };
    }
  }
  FakeTimer leader_timer, follower_timer;
};

TEST(StartPhaseShifted, StopsBothWhenTheFollowerDoesNotFollow) {
  Pair pair;
  ThreePhasePwm<FakeTimer> leader{pair.leader_timer, typical}, follower{pair.follower_timer, typical};
  ASSERT_TRUE(leader.configure() && follower.configure());
  EXPECT_FALSE(start_phase_shifted(leader, follower));
  EXPECT_FALSE(leader.running());
  EXPECT_FALSE(follower.running());
}

TEST(StartPhaseShifted, RefusesDifferentPeriodsAndDisarms) {
  Pair pair;
  ThreePhasePwm<FakeTimer> leader{pair.leader_timer, typical}, follower{pair.follower_timer, {4199, 21, 252}};
  ASSERT_TRUE(leader.configure() && follower.configure());
  pair.leader_timer.bdtr.value |= 1U << 15;
  pair.follower_timer.bdtr.value |= 1U << 15;
  EXPECT_FALSE(start_phase_shifted(leader, follower));
  EXPECT_FALSE(leader.armed() || follower.armed());
  EXPECT_FALSE(leader.running() || follower.running());
}

TEST(StartPhaseShifted, RefusesAFollowerThatDoesNotTakeTheDirection) {
  Pair pair;
  pair.follower_timer.cr1.on_read = [](std::uint32_t word) { return word & ~(1U << 4); };
  ThreePhasePwm<FakeTimer> leader{pair.leader_timer, typical}, follower{pair.follower_timer, typical};
  ASSERT_TRUE(leader.configure() && follower.configure());
  EXPECT_FALSE(start_phase_shifted(leader, follower));
  EXPECT_FALSE(leader.running());
}

TEST(StartPhaseShifted, LeavesTheUpdateEventAsTriggerAndTheFollowerFree) {
  Pair pair;
  // Trigger mode: the leader's CEN sets the follower's.
  pair.leader_timer.cr1.on_write = [&](std::uint32_t word) {
    if ((word & 1U) != 0 && (pair.follower_timer.smcr.value & 7U) == 6) pair.follower_timer.cr1.value |= 1;
  };
  ThreePhasePwm<FakeTimer> leader{pair.leader_timer, typical}, follower{pair.follower_timer, typical};
  ASSERT_TRUE(leader.configure() && follower.configure());
  ASSERT_TRUE(start_phase_shifted(leader, follower));
  EXPECT_EQ(pair.leader_timer.cr2.value, 2U << 4);
  EXPECT_EQ(pair.follower_timer.smcr.value & 7U, 0U);
  EXPECT_FALSE(leader.armed() || follower.armed());
}

}  // namespace kmax::drivers::stm32f4::phase_shifted_pwm_test
