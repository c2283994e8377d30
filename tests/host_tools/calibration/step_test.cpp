#include "host_tools/calibration/step.hpp"

#include <gtest/gtest.h>

#include "board/odrive_v3/description.hpp"

namespace kmax::calibration::step_test {

// A gain of 80 reads up to 30 A: what is asked for there must leave the amplifiers longer to settle.
TEST(MotorKnowledge, AsksForNoMoreVoltageThanTheCurrentControllersGiveAtItsCurrent) {
  MotorKnowledge known;
  known.electronics = &board::odrive_v3::description;
  known.supply = 24.0;
  for (const auto& [current_limit, share] :
       {std::pair{10.0, 0.76}, {30.0, 0.84}, {60.0, 0.87}, {100.0, 0.875}}) {
    known.current_limit = current_limit;
    EXPECT_LT(known.largest_voltage(), share * known.supply) << current_limit << " A";
    EXPECT_GT(known.largest_voltage(), 0.96 * share * known.supply) << current_limit << " A";
  }
}

}  // namespace kmax::calibration::step_test
