#include "host_tools/device/guard_words.hpp"

#include <gtest/gtest.h>

#include "tests/host_tools/thrown_message.hpp"

namespace kmax::device::guard_words_test {

using control::Criterion;
using firmware::GuardFinding;
using Verdict = GuardFinding::Verdict;

GuardFinding failed(Criterion criterion, float value, float bound, unsigned others = 0) {
  const unsigned bits = others | 1U << static_cast<unsigned>(criterion);
  return {.verdict = Verdict::fail,
          .criterion = criterion,
          .failed = static_cast<std::uint16_t>(bits),
          .value = value,
          .bound = bound};
}

TEST(GuardWords, SayNothingOfWhatHasNotFailed) {
  EXPECT_EQ(guard_words({}), "");
  EXPECT_EQ(guard_words({.verdict = Verdict::pass, .value = 1000.0f, .bound = 4000.0f}), "");
}

TEST(GuardWords, SayTheNumbersTheRuleAndWhatToDo) {
  EXPECT_EQ(
      guard_words(failed(Criterion::colgate, 5500.0f, 2000.0f)),
      "wall.stiffness 5500 N/m exceeds 2000 N/m (Colgate: (b - |B|) / (T/2 + delay)); lower wall.stiffness, "
      "raise haptic.rate or current.bandwidth, or guard.damping if the device has more ('kmax check' "
      "explains)");
}

TEST(GuardWords, AValueOnItsBoundDoesNotExceedIt) {
  EXPECT_CONTAINS(guard_words(failed(Criterion::colgate, 2000.0f, 2000.0f)),
                  "wall.stiffness 2000 N/m must be below 2000 N/m");
}

TEST(GuardWords, EveryCriterionOfTheGuardHasItsOwnUnitAndRemedy) {
  for (const Criterion criterion : firmware::guard_criteria) {
    const std::string words = guard_words(failed(criterion, 3.0f, 2.0f));
    EXPECT_CONTAINS(words, std::string("3 ") + std::string(unit_of(criterion)));
    EXPECT_CONTAINS(words, std::string("exceeds 2 ") + std::string(unit_of(criterion)));
    EXPECT_EQ(words.find("does not know"), std::string::npos) << words;
  }
  EXPECT_EQ(unit_of(Criterion::resolution), "N");
  EXPECT_EQ(unit_of(Criterion::resolution_speed), "m/s");
  EXPECT_EQ(unit_of(Criterion::field_slope), "N/m");
}

TEST(GuardWords, WithoutDampingOrFrictionTheyAskForIt) {
  EXPECT_CONTAINS(guard_words(failed(Criterion::colgate, 1000.0f, 0.0f)), "guard.damping is not above");
  EXPECT_CONTAINS(
      guard_words(failed(Criterion::field_slope, 1000.0f, -5.0f)),
      "no field passes while guard.damping is not above the magnitude of wall.damping, or guard.friction");
  EXPECT_CONTAINS(guard_words(failed(Criterion::abbott_okamura, 1000.0f, -5.0f)),
                  "guard.friction is not above |B| step / T: lower wall.damping");
  EXPECT_CONTAINS(guard_words(failed(Criterion::abbott_okamura, 1000.0f, 0.0f)),
                  "guard.damping or guard.friction is 0: measure them ('kmax calibrate')");
}

TEST(GuardWords, NameTheOthersThatFail) {
  const unsigned others = 1U << static_cast<unsigned>(Criterion::abbott_okamura) |
                          1U << static_cast<unsigned>(Criterion::field_slope);
  EXPECT_CONTAINS(guard_words(failed(Criterion::colgate, 5500.0f, 2000.0f, others)),
                  "; fails too: abbott_okamura, field_slope");
}

TEST(GuardWords, ACriterionOfALaterFirmwareIsNotMadeUp) {
  EXPECT_CONTAINS(guard_words(failed(static_cast<Criterion>(12), 3.0f, 2.0f)), "does not know");
  EXPECT_EQ(name_of(static_cast<Criterion>(12)), "unknown");
  EXPECT_EQ(name_of(Criterion::field_slope), "field_slope");
  EXPECT_EQ(name_of(Verdict::not_judged), "not_judged");
}

}  // namespace kmax::device::guard_words_test
