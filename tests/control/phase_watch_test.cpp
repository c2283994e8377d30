#include "control/phase_watch.hpp"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <cmath>
#include <limits>
#include <vector>

namespace kmax::control::phase_watch_test {

using Watch = PhaseWatch<float>;
using Currents = PhaseCurrents<float>;

constexpr PhaseWatchConfig<float> config{5.0f, 1.5f, 3000.0f, 20000.0f};
constexpr auto c = Watch::prepare(config);

constexpr Currents dc(float current) {
  return {0.0f, current, -current};
}

TEST(PhaseWatch, LimitsFollowTheConfiguration) {
  EXPECT_FLOAT_EQ(c.over_current, 7.5f);
  EXPECT_FLOAT_EQ(c.present, 0.25f);
  EXPECT_EQ(c.patience, 33u);  // 5 / 3000 s
  PhaseWatchConfig<float> strong = config;
  strong.current_limit = 60.0f;
  EXPECT_FLOAT_EQ(Watch::prepare(strong).present, 3.0f);
  PhaseWatchConfig<float> fast = config;
  fast.bandwidth = 50000.0f;
  EXPECT_EQ(Watch::prepare(fast).patience, 20u);  // never below 1 ms
  PhaseWatchConfig<float> dead = config;
  dead.bandwidth = 0.0f;
  EXPECT_EQ(Watch::prepare(dead).patience, 1'000'000'000u);  // infinite, saturated before the conversion
}

// What a driver asks at a look: of the sample itself first.
PhaseCondition look(Watch& watch, const Watch::Coefficients& with, const Currents& measured,
                    const Currents& reference, bool slow) {
  if (Watch::over_current(with, measured)) return PhaseCondition::over_current;
  return watch.update(with, measured, reference, slow);
}

// What is seen for a number of looks, and the verdicts on them: all are good but the last, which is `last`.
struct Stretch {
  Currents measured, reference;
  bool slow = true;
  std::uint32_t samples = 1;
  PhaseCondition last = PhaseCondition::good;
};

void expect(Watch watch, const std::vector<Stretch>& stretches, const char* what) {
  SCOPED_TRACE(what);
  for (const Stretch& s : stretches) {
    for (std::uint32_t i = 1; i <= s.samples; ++i)
      ASSERT_EQ(look(watch, c, s.measured, s.reference, s.slow),
                i < s.samples ? PhaseCondition::good : s.last)
          << i;
  }
}

constexpr auto open = PhaseCondition::open, sum = PhaseCondition::sum,
               over_current = PhaseCondition::over_current;

TEST(PhaseWatch, CurrentThatVanishesIsFoundAfterThePatienceInEachOfThreePhases) {
  for (const float sign : {1.0f, -1.0f})
    expect({}, {{dc(sign), dc(sign), true, 100}, {dc(0.0f), dc(sign), true, c.patience + 1, open}},
           "a DC motor");
  // The two phases that are left carry the same current.
  const Currents flowing{1.0f, -0.5f, -0.5f};
  for (const Currents& left : {Currents{0.0f, 0.6f, -0.6f}, {0.8f, 0.0f, -0.8f}, {0.8f, -0.8f, 0.0f}})
    expect({}, {{flowing, flowing}, {left, flowing, true, c.patience + 1, open}}, "three phases");
}

// A small force that is gone for three samples and is back, with the fastest loop that can be set: whatever
// the looks fall on, nothing is open. A verdict by the look before alone says it is.
TEST(PhaseWatch, AForceThatBlinksIsNoOpenPhase) {
  for (int period = 4; period <= 13; ++period) {
    Watch watch;
    float current = 0.3f;
    for (int tick = 0; tick < 2000; ++tick) {
      const float reference = tick % period < 3 ? 0.0f : 0.3f;
      if (tick % 8 == 2 || tick % 8 == 7) {
        ASSERT_EQ(watch.update(c, dc(current), dc(reference), true), PhaseCondition::good)
            << period << " " << tick;
      }
      current += 0.54f * (reference - current);
    }
  }
}

TEST(PhaseWatch, CurrentThatNeverComesIsFoundAfterThePatience) {
  expect({}, {{dc(0.0f), dc(1.0f), true, c.patience + 1, open}}, "it never comes");
  expect({}, {{dc(0.0f), dc(1.0f), false, 1000}}, "a fast motor is not judged by it");
}

// A release of the force: the reference goes first, the current follows.
TEST(PhaseWatch, AReleaseOrAReversalIsNoOpenPhase) {
  Watch watch;
  float current = 2.0f;
  for (int i = 0; i < 2000; ++i) {
    const float reference = (i / 50) % 2 == 0 ? 2.0f : (i / 100) % 2 == 0 ? -2.0f : 0.0f;
    // The fastest loop that can be set: an eighth of the sampling frequency.
    current += 0.54f * (reference - current);
    ASSERT_EQ(watch.update(c, dc(current), dc(reference), true), PhaseCondition::good) << i;
  }
}

TEST(PhaseWatch, NoiseBelowPresentSaysNothing) {
  Watch watch;
  for (int i = 0; i < 1000; ++i)
    ASSERT_EQ(watch.update(c, dc(i % 2 == 0 ? 0.2f : 0.0f), dc(0.24f), true), PhaseCondition::good);
}

TEST(PhaseWatch, OverCurrentAndNanTripWhateverTheReference) {
  expect({}, {{dc(7.5f), dc(5.0f)}, {dc(7.6f), dc(5.0f), true, 1, over_current}}, "a DC motor");
  for (const Currents& bad : {Currents{0.0f, -7.6f, 0.0f}, {-7.6f, 3.0f, 3.0f}, {0.0f, std::nanf(""), 0.0f}})
    expect({}, {{bad, {}, false, 1, over_current}}, "three phases");
}

TEST(PhaseWatch, ALimitThatIsNoLimitLetsNoCurrentPass) {
  for (const float limit : {std::nanf(""), -5.0f}) {
    PhaseWatchConfig<float> broken = config;
    broken.current_limit = limit;
    Watch watch;
    EXPECT_EQ(look(watch, Watch::prepare(broken), dc(0.01f), dc(0.0f), true), PhaseCondition::over_current);
  }
}

// A leak to ground: what flows out of B does not come back through C.
TEST(PhaseWatch, CurrentsThatDoNotAddUpAreFoundAfterThePatienceAtAnySpeed) {
  ASSERT_FLOAT_EQ(c.unbalanced, 0.75f);
  for (const bool slow : {true, false}) {
    for (const float leak : {0.8f, -0.8f})
      expect({}, {{{0.0f, 2.0f + leak, -2.0f}, dc(2.0f), slow, c.patience + 1, sum}}, "a leak");
  }
  const Currents flowing{2.0f, -1.0f, -1.0f}, leaking{2.0f, -1.0f, -0.2f};
  expect({}, {{flowing, flowing, true, 1000}, {leaking, flowing, true, c.patience + 1, sum}},
         "three sensors");
}

TEST(PhaseWatch, AShortImbalanceOrOneWithinTheToleranceIsForgiven) {
  const Stretch leaking{{0.0f, 2.8f, -2.0f}, dc(2.0f), true, c.patience},
      within{{0.0f, 2.7f, -2.0f}, dc(2.0f)};
  std::vector<Stretch> rounds;
  for (int round = 0; round < 20; ++round) rounds.insert(rounds.end(), {leaking, within});
  rounds.push_back({within.measured, within.reference, true, 1000});
  expect({}, rounds, "short ones, again and again, then one within the tolerance");
}

TEST(PhaseWatch, AnImpliedSumNeverSpeaks) {
  Watch watch;
  const Currents nonsense{5.0f, 5.0f, 5.0f};
  for (int i = 0; i < 1000; ++i) {
    ASSERT_EQ(watch.update<PhaseSum::implied>(c, nonsense, nonsense, true), PhaseCondition::good);
    // Nor does one that is checked although the third was worked out.
    const float b = 3.3333f * static_cast<float>(i % 7 - 3) / 3.0f, third = 1.1111f;
    ASSERT_EQ(watch.update(c, {-(b + third), b, third}, {-(b + third), b, third}, true),
              PhaseCondition::good);
  }
}

// A wire that comes off loses the current in both phases of a DC motor; it is open, not unbalanced. A sensor
// that fails loses it in one: the same, and the sum would only confirm it.
TEST(PhaseWatch, AnOpenPhaseComesBeforeTheSum) {
  const Currents lost{0.0f, 0.0f, -2.0f};
  expect({}, {{dc(2.0f), dc(2.0f)}, {lost, dc(2.0f), true, c.patience + 1, open}}, "lost");
  expect({}, {{lost, dc(2.0f), true, c.patience + 1, open}}, "never there");
}

// What is watched, with comparisons of floats: the yardstick.
class PlainWatch {
 public:
  PhaseCondition update(const Currents& measured, const Currents& reference, bool slow) {
    const float m[] = {measured.a, measured.b, measured.c};
    const float r[] = {reference.a, reference.b, reference.c};
    for (const float current : m) {
      if (!(std::fabs(current) <= c.over_current)) return PhaseCondition::over_current;
    }
    bool missing = false;
    for (int i = 0; i < 3; ++i)
      missing = missing || (!(std::fabs(r[i]) <= c.present) && std::fabs(m[i]) < c.absent);
    starved_ = missing && slow ? starved_ + 1 : 0;
    unbalanced_ = std::fabs(m[0] + m[1] + m[2]) > c.unbalanced ? unbalanced_ + 1 : 0;
    if (starved_ > c.patience) return PhaseCondition::open;
    return unbalanced_ > c.patience ? PhaseCondition::sum : PhaseCondition::good;
  }

 private:
  std::uint32_t starved_ = 0, unbalanced_ = 0;
};

RC_GTEST_PROP(PhaseWatch, AgreesWithItsPlainForm, ()) {
  Watch watch;
  PlainWatch plain;
  // Currents stay for a while, as faults do, and lie at the thresholds as often as between them.
  const auto pick = [] {
    return *rc::gen::element(0.0f, -0.0f, c.absent, -c.absent, c.present, -c.present, 0.26f, 0.5f, 1.0f,
                             -1.0f, 2.0f, -2.0f, c.over_current, -c.over_current, 7.6f, c.unbalanced, 1e-40f,
                             std::numeric_limits<float>::infinity(),
                             -std::numeric_limits<float>::quiet_NaN());
  };
  const auto stretches = *rc::gen::inRange(1, 8);
  for (int stretch = 0; stretch < stretches; ++stretch) {
    const Currents measured{pick(), pick(), pick()}, reference{pick(), pick(), pick()};
    const bool slow = *rc::gen::arbitrary<bool>();
    const auto samples = *rc::gen::element(1, 2, 20, 33, 34, 35, 100);
    for (int i = 0; i < samples; ++i)
      RC_ASSERT(look(watch, c, measured, reference, slow) == plain.update(measured, reference, slow));
  }
}

TEST(PhaseWatch, ResetGivesTheWholePatienceAgain) {
  const Stretch starving{dc(0.0f), dc(1.0f), true, c.patience + 1, open};
  const Stretch leaking{{0.0f, 2.8f, -2.0f}, dc(2.0f), true, c.patience + 1, sum};
  for (const Stretch& stretch : {starving, leaking}) {
    Watch watch;
    for (std::uint32_t i = 0; i < c.patience; ++i)
      (void)watch.update(c, stretch.measured, stretch.reference, true);
    watch.reset();
    expect(watch, {stretch}, "after a reset");
  }
}

}  // namespace kmax::control::phase_watch_test
