#include "host_tools/record/pdo_plan.hpp"

#include <gtest/gtest.h>

#include <array>
#include <vector>

#include "host_tools/base/errors.hpp"
#include "host_tools/record/telemetry_request.hpp"
#include "tests/host_tools/fake_device.hpp"
#include "tests/host_tools/thrown_message.hpp"

namespace kmax::record::pdo_plan_test {

using host_tools_test::FakeDevice;
using host_tools_test::FakeLink;

class PdoPlanTest : public testing::Test {
 protected:
  PdoPlan read() {
    device::Device device(std::make_unique<FakeLink>(fake));
    return read_pdo_plan(device, 9);
  }
  std::string refusal() {
    return host_tools_test::thrown_message<base::DeviceError>([this] { read(); });
  }
  TelemetryRequest of_fake() {
    return TelemetryRequest(
        [this] {
          auto made = std::make_unique<FakeLink>(fake);
          if (lost_requests_from != 0) {
            made->loss = FakeLink::Loss::request;
            made->first_lost = lost_requests_from;
            made->last_lost = 1000;
          }
          return device::Device(std::move(made));
        },
        [this](const std::string& text) { noticed = text; });
  }
  void set_event_times(std::uint32_t ms) {
    for (const std::size_t slot : event_time_slots) values().set_raw(slot, ms);
  }
  std::vector<std::uint32_t> event_times() {
    std::vector<std::uint32_t> all;
    for (const std::size_t slot : event_time_slots) all.push_back(values().raw(slot));
    return all;
  }
  firmware::ParameterValues& values() { return fake->registers.values(); }

  const std::array<std::size_t, 4> event_time_slots = {
      device::Parameter::of<"tpdo1.event_time">().slot(), device::Parameter::of<"tpdo2.event_time">().slot(),
      device::Parameter::of<"tpdo3.event_time">().slot(), device::Parameter::of<"tpdo4.event_time">().slot()};
  std::shared_ptr<FakeDevice> fake = std::make_shared<FakeDevice>();
  int lost_requests_from = 0;  ///< of a connection, from 1; 0: none
  std::string noticed;
};

TEST_F(PdoPlanTest, TheFactorysSettings) {
  values().set_whole<"can.node_state">(127);
  values().set_whole<"can.tpdo_held_back">(3);
  values().set_whole<"info.tick">(777);
  values().set_real<"device.transmission">(0.1F, 1);
  const PdoPlan plan = read();
  EXPECT_EQ(plan.node, 9);
  EXPECT_EQ(plan.identifiers, (std::array<std::uint32_t, 4>{0x189, 0x289, 0x389, 0x489}));
  EXPECT_EQ(plan.period_ticks, 200u);
  EXPECT_EQ(plan.node_state, 127);
  EXPECT_EQ(plan.held_back, 3u);
  EXPECT_EQ(plan.tick, 777u);
  EXPECT_NEAR(plan.count_lengths[1] / plan.count_lengths[0], 2, 1e-6);
}

TEST_F(PdoPlanTest, OtherIdentifiersAndTimesAreFollowed) {
  values().set_whole<"tpdo2.cob_id">(0x40000234);
  set_event_times(5);
  EXPECT_EQ(read().identifiers[1], 0x234u);
  EXPECT_EQ(read().period_ticks, 100u);
}

TEST_F(PdoPlanTest, ASlowBusIsSlower) {
  TelemetryRequest request = of_fake();
  request.ask();
  values().set_whole<"can.bit_rate_in_use">(125000);
  EXPECT_EQ(read().period_ticks, 160u);
}

TEST_F(PdoPlanTest, WhatIsAskedForIsPutBackOnce) {
  {
    TelemetryRequest request = of_fake();
    EXPECT_EQ(read().period_ticks, 200u) << "nothing is asked for yet";
    EXPECT_TRUE(request.ask());
    EXPECT_EQ(read().period_ticks, 20u);
    request.put_back();
    EXPECT_EQ(read().period_ticks, 200u);
    set_event_times(1);  // somebody else's wish
  }
  EXPECT_EQ(read().period_ticks, 20u);
}
TEST_F(PdoPlanTest, OtherEventTimesStayInTheBeginningAndInTheEnd) {
  set_event_times(5);
  {
    TelemetryRequest request = of_fake();
    EXPECT_FALSE(request.ask());
  }
  EXPECT_EQ(read().period_ticks, 100u);
  set_event_times(10);
  {
    TelemetryRequest request = of_fake();
    EXPECT_TRUE(request.ask());
    set_event_times(7);
  }
  EXPECT_EQ(read().period_ticks, 140u);
}
// The first to ask has ended; the second asks again, and is then the one who puts it back.
TEST_F(PdoPlanTest, TwoWhoAskedLeaveTheFactorys) {
  {
    TelemetryRequest second = of_fake();
    {
      TelemetryRequest first = of_fake();
      EXPECT_TRUE(first.ask());
      EXPECT_FALSE(second.ask());
    }
    EXPECT_EQ(read().period_ticks, 200u);
    EXPECT_TRUE(second.ask());
    EXPECT_EQ(read().period_ticks, 20u);
  }
  EXPECT_EQ(read().period_ticks, 200u);
}
TEST_F(PdoPlanTest, ALockedDeviceIsRecordedAsItSends) {
  values().set_whole<"lock.state">(2);
  TelemetryRequest request = of_fake();
  EXPECT_FALSE(request.ask());
  EXPECT_EQ(read().period_ticks, 200u);
  request.put_back();
  EXPECT_EQ(noticed, "");
}
TEST_F(PdoPlanTest, ARequestThatIsCutShortAnywhereIsPutBackToo) {
  const std::vector<std::uint32_t> factory(4, 10);
  int halves = 0;
  for (bool whole = false; !whole;) {
    const int from = ++lost_requests_from;
    ASSERT_LT(from, 100);
    TelemetryRequest request = of_fake();
    try {
      whole = request.ask();
    } catch (const device::LinkError&) {
      halves += event_times() != factory ? 1 : 0;
    }
    lost_requests_from = 0;
    request.put_back();
    EXPECT_EQ(event_times(), factory) << from;
    lost_requests_from = from;
  }
  EXPECT_EQ(halves, 3);
  EXPECT_EQ(noticed, "");
}
TEST_F(PdoPlanTest, ALinkThatIsGoneInTheEndIsSaid) {
  {
    TelemetryRequest request = of_fake();
    request.ask();
    lost_requests_from = 1;
  }
  EXPECT_CONTAINS(noticed, "could not be put back to 10 ms");
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
  EXPECT_CONTAINS(refusal(), "tpdo4.event_time is 2 ms, but tpdo1.event_time 10 ms");
}

}  // namespace kmax::record::pdo_plan_test
