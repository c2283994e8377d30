#include "firmware/drive/axes_law.hpp"

#include <gtest/gtest.h>

#include <array>
#include <cstddef>
#include <cstdint>

#include "firmware/parameters/parameter_values.hpp"

namespace kmax::firmware::axes_law_test {
namespace {

TEST(AxesLaw, TheAxisAlongIsTheNextOneAndTheFirstAfterTheLast) {
  EXPECT_EQ(axis_along<1>(0), 0u);
  EXPECT_EQ(axis_along<2>(0), 1u);
  EXPECT_EQ(axis_along<2>(1), 0u);
  EXPECT_EQ(axis_along<3>(1), 2u);
  EXPECT_EQ(axis_along<3>(2), 0u);
}

/// One axis after the other makes a force along its surface, driven or not; all feel what they should.
template <std::size_t axes>
void expect_each_feels_what_the_one_before_makes() {
  TangentialInterference<axes> law;
  using Law = TangentialInterference<axes>;
  EXPECT_FALSE(Law::needs_all_positions);
  std::array<float, axes> expected{};
  const auto expect_all = [&] {
    for (std::size_t axis = 0; axis < axes; ++axis)
      EXPECT_EQ(law.ISR_force({}, axis, {}), expected[axis]) << axis;
  };
  expect_all();
  for (const bool driven : {true, false}) {
    for (std::size_t axis = 0; axis < axes; ++axis) {
      control::HapticLoop<float>::Output loop;
      loop.tangential_force = 2.0f + static_cast<float>(axis);
      law.ISR_rendered({}, axis, loop, driven);
      if (axes > 1) expected[(axis + 1) % axes] = driven ? loop.tangential_force : 0.0f;
      expect_all();
    }
  }
}

TEST(AxesLaw, EachAxisFeelsWhatTheOneBeforeMakesWhileItIsDriven) {
  expect_each_feels_what_the_one_before_makes<1>();  // a lone one has none along its surface
  expect_each_feels_what_the_one_before_makes<2>();
  expect_each_feels_what_the_one_before_makes<3>();
}

TEST(AxesLaw, AParallelInterferenceOfEitherCouplesTwoAxes) {
  using Mode = control::InterferenceMode;
  for (const Mode one : {Mode::none, Mode::perpendicular, Mode::parallel}) {
    for (const Mode other : {Mode::none, Mode::perpendicular, Mode::parallel}) {
      ParameterValues values;
      values.set_whole<"interference.mode">(static_cast<std::uint32_t>(one), 0);
      values.set_whole<"interference.mode">(static_cast<std::uint32_t>(other), 1);
      EXPECT_EQ(TangentialInterference<axis_count>::couples(values, 0, 1),
                one == Mode::parallel || other == Mode::parallel);
    }
  }
}

}  // namespace
}  // namespace kmax::firmware::axes_law_test
