#include "host_tools/check/parameter_case.hpp"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "firmware/drive/stability_case.hpp"

namespace kmax::check::parameter_case_test {

using firmware::ParameterValues;

template <typename Scalar>
std::array<double, 13> numbers_of(const control::StabilityCase<Scalar>& c) {
  const auto number = [](Scalar value) { return static_cast<double>(value); };
  return {number(c.stiffness),       number(c.wall_damping),   number(c.magnetic_coefficient),
          number(c.magnetic_length), number(c.period),         number(c.delay),
          number(c.quantum),         number(c.mass),           number(c.damping),
          number(c.friction),        number(c.operator_force), number(c.operator_speed),
          number(c.force_limit)};
}

TEST(ParameterCase, ANumberIsTheOneThatTheUserWroteAndTheHandIsTheCallers) {
  ParameterValues values;
  values.set_real<"haptic.rate">(500);
  values.set_real<"wall.magnetic_length">(0.002f);
  values.set_real<"device.mass">(0.06f);
  const auto c = parameter_case(values, 0, {0.2, 500, 2, 100, 9});
  EXPECT_EQ(c.period, 0.002);
  EXPECT_EQ(c.magnetic_length, 0.002);
  EXPECT_EQ(c.mass, 0.06);
  EXPECT_EQ(c.hand.hand_mass, 0.2);
  EXPECT_EQ(c.hand.arm_damping, 9);
}

// What is listed is what is read: any other parameter of the axis may take any value without a change.
TEST(ParameterCase, TheListedParametersAreThoseThatCount) {
  for (const std::size_t axis : {std::size_t{0}, std::size_t{1}}) {
    const auto listed = parameters_of_case(axis);
    for (const device::Parameter& parameter : device::all_parameters()) {
      if (!parameter.writable()) continue;
      bool changes = false;
      for (const auto& law : firmware::names::wall_law) {
        ParameterValues values;
        values.set_whole<"wall.law">(law.value, axis);
        values.set_real<"position.resolution">(0.001f, axis);
        // Wide enough for gain and offset to show.
        for (const float widest : {2.0f, 50.0f}) {
          values.set_real<"wall.adaptive_force_max">(widest, axis);
          for (const float offset : {0.0f, 0.8f}) {
            values.set_real<"wall.adaptive_offset">(offset, axis);
            values.set_real<"wall.adaptive_gain">(offset * 3, axis);
            ParameterValues changed = values;
            const std::size_t slot = firmware::slot_of(parameter.entry(), parameter.axis());
            const auto& entry = parameter.definition();
            const double middle = entry.values.empty() ? 0.5 * entry.minimum + 0.5 * entry.maximum : 0;
            changed.set_raw(
                slot, firmware::raw_from_number(
                          entry.type, entry.type == firmware::Type::float32 ? middle : std::trunc(middle)));
            const auto a = parameter_case(values, axis), b = parameter_case(changed, axis);
            changes = changes || numbers_of(a) != numbers_of(b);
          }
        }
      }
      const bool is_listed = std::find(listed.begin(), listed.end(), parameter) != listed.end();
      EXPECT_EQ(changes, is_listed) << parameter.name() << " for axis " << axis;
    }
  }
}

// The device's own check before arming must not be of another case than the one that is explained here.
RC_GTEST_PROP(ParameterCase, TheFirmwaresGuardJudgesTheSameCase, ()) {
  ParameterValues values;
  const std::size_t axis = *rc::gen::inRange<std::size_t>(0, 2);
  for (const device::Parameter& parameter : parameters_of_case(axis)) {
    const firmware::Entry& entry = parameter.definition();
    const std::size_t slot = firmware::slot_of(parameter.entry(), parameter.axis());
    if (entry.type == firmware::Type::float32 && *rc::gen::arbitrary<bool>()) {
      const double share = *rc::gen::inRange(0, 1001) * 1e-3;
      values.set_raw(slot,
                     firmware::raw_from_number(
                         entry.type, entry.minimum + std::pow(share, 8) * (entry.maximum - entry.minimum)));
    }
  }
  values.set_whole<"wall.law">((*rc::gen::elementOf(std::to_array(firmware::names::wall_law))).value, axis);
  const auto here = parameter_case(values, axis);
  const auto there = firmware::stability_case(values, axis);
  const auto ours = numbers_of(here), guards = numbers_of(there);
  for (std::size_t i = 0; i < ours.size(); ++i)
    RC_ASSERT(std::abs(ours[i] - guards[i]) <= 1e-6 * std::max(std::abs(ours[i]), 1e-9));
  RC_ASSERT(here.detection_share == static_cast<double>(there.detection_share));
}

}  // namespace kmax::check::parameter_case_test
