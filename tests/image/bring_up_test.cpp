// The flashed image taken from blank parameters to its first wall, by the tool that leads a person there.
#include <gtest/gtest.h>

#include <memory>

#include "tests/host_tools/bring_up/person_at_the_bench.hpp"
#include "tests/image/image_bench.hpp"

namespace kmax::tests::bring_up_test {

TEST(ImageBringUp, ABlankBoardComesToItsFirstWalls) {
  ImageBench image({{"modbus.baud_rate", std::int64_t{460800}}}, 0.0, "dc_coreless_a");
  image.start();
  device::Device device(std::make_unique<virtual_board::BoardLink>(*image.board));
  bring_up::PersonAtTheBench person(device, image.world.drives(),
                                    [&](bool pressed) { image.board->open_emergency_stop(pressed); });
  EXPECT_TRUE(person.run()) << person.text();
  EXPECT_EQ(person.report.board().serial_number, 0U) << "the report is the caller's";
  EXPECT_FALSE(person.report.next(0).has_value());
  EXPECT_EQ(device.read_number("motor.calibrated"), 1.0);
  for (const auto& [name, truth] : {std::pair("motor.resistance", 2.3), {"motor.torque_constant", 0.0235}})
    EXPECT_NEAR(device.read_number(name) / truth, 1.0, 0.03) << name << ", as the scene has it";
  const auto largest = person.report.number(0, bring_up::Stage::wall, "wall of 0.50 N/mm", "largest_force");
  ASSERT_TRUE(largest.has_value());
  EXPECT_GT(*largest, 0.2);
  EXPECT_LE(*largest, 1.0);
}

}  // namespace kmax::tests::bring_up_test
