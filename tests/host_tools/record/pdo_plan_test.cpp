#include "host_tools/record/pdo_plan.hpp"

#include <gtest/gtest.h>

#include "host_tools/base/errors.hpp"
#include "tests/host_tools/fake_device.hpp"
#include "tests/host_tools/thrown_message.hpp"

namespace kmax::record::pdo_plan_test {
namespace {
using host_tools_test::FakeDevice;
using host_tools_test::FakeLink;

class PdoPlanTest : public testing::Test {
 protected:
  PdoPlan read() {
    device::Device device(std::make_unique<FakeLink>(fake));
    return read_pdo_plan(device, 9);
  }
  std::string refusal() {
    return host_tools_test::thrown_message<device::DeviceError>([this] { read(); });
  }
  firmware::ParameterValues& values() { return fake->registers.values(); }

  std::shared_ptr<FakeDevice> fake = std::make_shared<FakeDevice>();
};

TEST_F(PdoPlanTest, TheFactorysSettings) {
  values().set_whole<"can.node_state">(127);
  values().set_whole<"can.tpdo_held_back">(3);
  values().set_whole<"info.tick">(777);
  values().set_real<"device.transmission">(0.1F, 1);
  const PdoPlan plan = read();
  EXPECT_EQ(plan.node, 9);
  EXPECT_EQ(plan.identifiers, (std::array<std::uint32_t, 4>{0x189, 0x289, 0x389, 0x489}));
  EXPECT_EQ(plan.period_ticks, 20u);
  EXPECT_EQ(plan.node_state, 127);
  EXPECT_EQ(plan.held_back, 3u);
  EXPECT_EQ(plan.tick, 777u);
  EXPECT_NEAR(plan.count_lengths[1] / plan.count_lengths[0], 2, 1e-6);
}

TEST_F(PdoPlanTest, OtherIdentifiersAndTimesAreFollowed) {
  values().set_whole<"tpdo2.cob_id">(0x40000234);
  for (const std::size_t entry :
       {firmware::entry_of<"tpdo1.event_time">(), firmware::entry_of<"tpdo2.event_time">(),
        firmware::entry_of<"tpdo3.event_time">(), firmware::entry_of<"tpdo4.event_time">()})
    values().set_raw(firmware::slot_of(entry, 0), 5);
  EXPECT_EQ(read().identifiers[1], 0x234u);
  EXPECT_EQ(read().period_ticks, 100u);
}

TEST_F(PdoPlanTest, ASlowBusIsSlower) {
  values().set_whole<"can.bit_rate_in_use">(125000);
  EXPECT_EQ(read().period_ticks, 160u);
}

TEST_F(PdoPlanTest, AnyOtherMappingIsRefusedByName) {
  values().set_whole<"tpdo3.mapped_2">(0x20120420);
  EXPECT_CONTAINS(refusal(), "tpdo3.mapped_2 is 0x20120420 instead of 0x28120320");
}
TEST_F(PdoPlanTest, SoIsAnotherCount) {
  values().set_whole<"tpdo4.mapped_count">(3);
  EXPECT_CONTAINS(refusal(), "tpdo4.mapped_count is 0x3 instead of 0x4");
}
TEST_F(PdoPlanTest, SoIsAPdoThatIsOff) {
  values().set_whole<"tpdo1.cob_id">(0xC0000180);
  EXPECT_CONTAINS(refusal(), "tpdo1.cob_id says that the PDO is switched off");
}
TEST_F(PdoPlanTest, SoIsOneThatWaitsForSync) {
  values().set_whole<"tpdo2.transmission_type">(1);
  EXPECT_CONTAINS(refusal(), "tpdo2.transmission_type is 1 instead of 255");
}
TEST_F(PdoPlanTest, SoAreTimesThatDiffer) {
  values().set_whole<"tpdo4.event_time">(2);
  EXPECT_CONTAINS(refusal(), "tpdo4.event_time is 2 ms, but tpdo1.event_time 1 ms");
}

}  // namespace
}  // namespace kmax::record::pdo_plan_test
