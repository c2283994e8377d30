// The stability guard over any allowed set of parameters, and as a rule for axes that are armed.
#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "control/adaptive_coefficient.hpp"
#include "firmware/drive/axis_configuration.hpp"
#include "firmware/drive/stability_case.hpp"
#include "firmware/parameters/parameter_migration.hpp"
#include "tests/firmware/drive/guarded_parameters.hpp"

namespace kmax::firmware::stability_guard_properties_test {
namespace {

using control::Criterion;
using Verdict = GuardFinding::Verdict;

double ratio(const control::CriterionResult<float>& result) {
  return static_cast<double>(result.value) / std::max(static_cast<double>(result.bound), 1e-300);
}

// Whatever the mode, relation and velocity: the law never commands more, and at V_max it commands that.
RC_GTEST_PROP(GuardField, LargestCoefficientIsNeverExceededAndIsReached, ()) {
  ParameterValues values;
  const auto set_real = [&](std::string_view name, double low, double high) {
    const double value = low + (high - low) * *rc::gen::inRange(0, 1001) / 1000.0;
    values.set_raw(slot_of(entry_named(name), 0), raw_from_number(Type::float32, value));
    return static_cast<float>(value);
  };
  values.set_whole<"wall.law">(3);
  values.set_whole<"wall.adaptive_mode">(*rc::gen::inRange(0U, 3U));
  values.set_whole<"wall.adaptive_relation">(*rc::gen::inRange(0U, 3U));
  values.set_whole<"wall.adaptive_velocity">(*rc::gen::inRange(0U, 2U));
  set_real("wall.adaptive_gain", 0, 5);
  set_real("wall.adaptive_offset", 0, 3);
  const float most_speed = set_real("wall.adaptive_velocity_max", 0.01, 5);
  const float least = set_real("wall.adaptive_force_min", 0, 3);
  set_real("wall.adaptive_force_max", static_cast<double>(least), 6);
  const float largest = stability_case(values, 0).magnetic_coefficient;
  const auto config = wall_configuration<float>(values, 0).adaptive;
  const auto prepared = control::AdaptiveCoefficient<float>::prepare(config, 0.001f);
  control::AdaptiveCoefficient<float> coefficient;
  float reached = 0.0f;
  const auto step = [&](float velocity, bool inside) {
    reached = std::max(reached, coefficient.update(prepared, velocity, inside));
    RC_ASSERT(reached <= largest);
  };
  for (int i = 0; i < 50; ++i) {
    const float velocity = most_speed * static_cast<float>(*rc::gen::inRange(-3000, 3001)) / 1000.0f;
    step(velocity, *rc::gen::arbitrary<bool>());
  }
  step(0.0f, false);
  step(-2.0f * most_speed, true);
  RC_ASSERT(reached >= largest * 0.999999f);
}

// Any allowed set, its extremes above all: a whole finding of finite numbers, and the one that is named is
// the worst by the criteria's own results.
RC_GTEST_PROP(GuardOnAnySet, FindsFiniteNumbersAndNamesTheWorst, ()) {
  ParameterValues values;
  for (std::size_t entry = 0; entry < axis_settings.size(); ++entry) {
    const Entry& e = entry_at(entry);
    if (*rc::gen::inRange(0, 4) == 0) continue;
    double number = e.default_value;
    if (!e.values.empty()) {
      number = e.values[*rc::gen::inRange<std::size_t>(0, e.values.size())].value;
    } else {
      const int where = *rc::gen::inRange(0, 4);
      const double share = std::pow(*rc::gen::inRange(0, 1001) / 1000.0, 6.0);
      number = where == 0 ? e.minimum : where == 1 ? e.maximum : e.minimum + share * (e.maximum - e.minimum);
    }
    const std::uint32_t raw = raw_from_number(e.type, number);
    if (check_value(descriptors[entry], raw) == Refusal::none) values.set_raw(slot_of(entry, 0), raw);
  }
  values.set_whole<"guard.mode">(2);
  values.set_whole<"drive.mode">(0);
  const GuardFinding found = guard_finding(values, 0);
  RC_ASSERT(std::isfinite(found.value) && std::isfinite(found.bound) && found.value >= 0.0f);
  const auto judged = stability_case(values, 0);
  unsigned failed = 0;
  bool applies = false;
  for (const Criterion criterion : guard_criteria) {
    const auto result = control::judge_closed_form(criterion, judged);
    applies = applies || result.applies;
    if (result.applies && !result.pass) failed |= bit(criterion);
  }
  const bool is_judged = applies && values.whole<"wall.law">() != 0;
  if (!is_judged) {
    RC_ASSERT(found == GuardFinding{});
    return;
  }
  RC_ASSERT(found.failed == failed);
  RC_ASSERT(found.verdict == (failed != 0 ? Verdict::fail : Verdict::pass));
  RC_ASSERT((failed == 0) == ((failed & bit(found.criterion)) == 0));
  for (const Criterion criterion : guard_criteria) {
    const auto result = control::judge_closed_form(criterion, judged);
    if (!result.applies || (failed != 0 && result.pass)) continue;
    const auto named = control::judge_closed_form(found.criterion, judged);
    RC_ASSERT(found.value == named.value && found.bound == named.bound);
    // A bound of 0 or beyond reach has no margin to compare by.
    if (std::min(named.bound, result.bound) <= 0.0f || std::max(named.bound, result.bound) > 1e29f) continue;
    RC_ASSERT(ratio(named) >= ratio(result) * 0.999999);
  }
}

class GuardOfArmedAxes : public Guard {
 protected:
  GuardOfArmedAxes() {
    for (const std::size_t axis : {0U, 1U}) {
      set("guard.mode", 2, axis);
      set("guard.damping", 5, axis);
      set("guard.friction", 1, axis);
    }
    now = values;
  }
  BrokenRule check(bool first, bool second) const {
    ArmedAxes armed;
    armed.axis = {first, second};
    return check_guard(values, now, armed);
  }
  ParameterValues now;
};

TEST_F(GuardOfArmedAxes, RefusesWhatWouldBreakAnArmedAxisAndNamesTheParameterThatWouldChange) {
  EXPECT_EQ(check(true, true).refusal, Refusal::none);
  set("force.limit", 4, 1);
  set("guard.damping", 0.01, 1);
  EXPECT_EQ(check(false, false).refusal, Refusal::none);
  EXPECT_EQ(check(true, false).refusal, Refusal::none) << "the other axis is not armed";
  for (const bool other : {false, true}) {
    EXPECT_EQ(check(other, true).refusal, Refusal::guard_refused);
    EXPECT_EQ(check(other, true).slot, slot_of(entry_named("guard.damping"), 1))
        << "not force.limit, which is not judged";
  }
}

TEST_F(GuardOfArmedAxes, OnlyModeRefuseRefuses) {
  set("wall.stiffness", 1e6);
  EXPECT_EQ(check(true, false).refusal, Refusal::guard_refused);
  EXPECT_EQ(check(true, false).slot, slot_of(entry_named("wall.stiffness"), 0));
  for (const double mode : {0.0, 1.0}) {
    set("guard.mode", mode);
    EXPECT_EQ(check(true, true).refusal, Refusal::none) << mode;
  }
}

TEST_F(GuardOfArmedAxes, ASlotIsNamedEvenWhereNothingWouldChange) {
  set("wall.stiffness", 1e6, 1);
  now = values;
  EXPECT_EQ(owner_of(check(true, true).slot).axis, 1U);
}

// What is listed is what the guard reads: nothing else of an axis may change its finding, and each of these
// does somewhere.
TEST(GuardEntries, AreThoseThatCount) {
  for (std::size_t entry = 0; entry < axis_settings.size(); ++entry) {
    const Entry& e = entry_at(entry);
    bool counts = false;
    for (const NamedValue& law : names::wall_law) {
      for (const float widest : {2.0f, 50.0f}) {
        for (const float offset : {0.0f, 0.8f}) {
          ParameterValues values;
          values.set_whole<"guard.mode">(1);
          values.set_whole<"wall.law">(law.value);
          values.set_real<"guard.damping">(5);
          values.set_real<"guard.operator_force">(1);
          values.set_real<"guard.operator_speed">(0.1f);
          values.set_real<"position.resolution">(0.001f);
          values.set_real<"wall.adaptive_force_max">(widest);
          values.set_real<"wall.adaptive_offset">(offset);
          values.set_real<"wall.adaptive_gain">(3 * offset);
          const auto judged = [&values] {
            std::array<float, 2 * guard_criteria.size() + 1> all{};
            all.back() = guard_finding(values, 0).verdict == Verdict::not_judged ? 0.0f : 1.0f;
            for (std::size_t i = 0; i < guard_criteria.size(); ++i) {
              const auto result = control::judge_closed_form(guard_criteria[i], stability_case(values, 0));
              all[2 * i] = result.value;
              all[2 * i + 1] = result.bound;
            }
            return all;
          };
          const auto before = judged();
          std::vector<double> numbers{e.minimum, e.maximum, 0.5 * e.minimum + 0.5 * e.maximum};
          if (!e.values.empty()) {
            numbers.clear();
            for (const NamedValue& named : e.values) numbers.push_back(named.value);
          }
          for (const double number : numbers) {
            const ParameterValues kept = values;
            values.set_raw(slot_of(entry, 0),
                           raw_from_number(e.type, e.type == Type::float32 ? number : std::trunc(number)));
            counts = counts || judged() != before;
            values = kept;
          }
        }
      }
    }
    const bool listed = std::find(guard_entries.begin(), guard_entries.end(), entry) != guard_entries.end();
    EXPECT_EQ(counts, listed) << e.name;
  }
}

// Stores of firmware that had no guard.delay and knew only "off".
TEST(GuardSettings, AStoreWithoutTheDelayKeepsAllElse) {
  const ParameterValues before;
  ParameterMigration migration(before);
  for (std::size_t i = 0; i < persistent_count; ++i) {
    const std::size_t slot = persistent_slots[i];
    if (owner_of(slot).entry == entry_named("guard.delay")) continue;
    std::uint32_t raw = before.raw(slot);
    if (owner_of(slot).entry == entry_named("guard.damping")) raw = raw_from_number(Type::float32, 0.5);
    migration.take(persistent_identity(i), raw);
  }
  const ParameterValues& taken = migration.finish();
  for (const std::size_t axis : {0U, 1U}) {
    EXPECT_EQ(taken.real<"guard.delay">(axis), 0.0f);
    EXPECT_EQ(taken.real<"guard.damping">(axis), 0.5f);
    EXPECT_EQ(taken.whole<"guard.mode">(axis), 0);
  }
  EXPECT_EQ(migration.report().defaulted, 2);
  EXPECT_EQ(migration.report().dropped, 0);
}

TEST(GuardNames, AreThoseOfTheCriteria) {
  EXPECT_EQ(names::guard_criterion[static_cast<std::size_t>(Criterion::abbott_okamura)].name,
            "abbott_okamura");
  EXPECT_EQ(names::guard_criterion[static_cast<std::size_t>(Criterion::field_slope)].name, "field_slope");
  EXPECT_EQ(names::guard_criterion[static_cast<std::size_t>(Criterion::resolution_speed)].name,
            "resolution_speed");
  for (std::size_t i = 0; i < control::criterion_count; ++i)
    EXPECT_EQ(names::guard_criterion[i].value, static_cast<int>(i));
}

}  // namespace
}  // namespace kmax::firmware::stability_guard_properties_test
