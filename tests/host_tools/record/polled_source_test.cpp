#include "host_tools/record/polled_source.hpp"

#include <gtest/gtest.h>

#include "host_tools/base/errors.hpp"
#include "tests/host_tools/fake_device.hpp"
#include "tests/host_tools/thrown_message.hpp"

namespace kmax::record::polled_source_test {

using host_tools_test::FakeDevice;
using host_tools_test::FakeLink;
constexpr std::chrono::microseconds any_time{0};

class PolledSourceTest : public testing::Test {
 protected:
  void set_tick(std::uint32_t tick) {
    for (std::size_t axis = 0; axis < 2; ++axis)
      fake->registers.values().set_whole<"measured.tick">(tick, axis);
  }
  std::shared_ptr<FakeDevice> fake = std::make_shared<FakeDevice>();
  FakeLink* link = new FakeLink(fake);
  device::Device device{std::unique_ptr<device::Link>(link)};
};

TEST_F(PolledSourceTest, ARowHasTheAxesValuesAndTheirTicks) {
  auto& values = fake->registers.values();
  values.set_whole<"measured.tick">(500, 0);
  values.set_whole<"measured.tick">(520, 1);
  values.set_real<"measured.position">(0.01F, 0);
  values.set_real<"measured.velocity">(-1.5F, 1);
  values.set_real<"measured.force">(2, 1);
  values.set_real<"measured.current">(3, 0);
  values.set_whole<"measured.flags">(17, 1);
  PolledSource source(device, {0, 1});
  const auto row = source.next(any_time);
  ASSERT_TRUE(row);
  EXPECT_EQ(row->tick, 500u);
  EXPECT_EQ(row->axes[1].tick, 520u);
  EXPECT_EQ(row->axes[0].position, static_cast<double>(0.01F));
  EXPECT_EQ(row->axes[1].velocity, -1.5F);
  EXPECT_EQ(row->axes[1].force, 2);
  EXPECT_EQ(row->axes[0].current, 3);
  EXPECT_EQ(row->axes[1].flags, 17);
  EXPECT_TRUE(source.axes_apart());
  EXPECT_FALSE(source.losses());
}

TEST_F(PolledSourceTest, OneAxisIsOneRequest) {
  PolledSource source(device, {1});
  const int before = link->requests;
  source.next(any_time);
  EXPECT_EQ(link->requests, before + 1);
  EXPECT_FALSE(source.axes_apart());
}

TEST_F(PolledSourceTest, TheSameTickIsNoNewRow) {
  PolledSource source(device, {0});
  set_tick(40);
  EXPECT_TRUE(source.next(any_time));
  EXPECT_FALSE(source.next(any_time));
  set_tick(41);
  EXPECT_TRUE(source.next(any_time));
}

TEST_F(PolledSourceTest, TicksGoOnWhereTheyWrap) {
  PolledSource source(device, {0, 1});
  set_tick(0xFFFFFFF0U);
  source.next(any_time);
  set_tick(5);
  const auto row = source.next(any_time);
  ASSERT_TRUE(row);
  EXPECT_EQ(row->tick, 0x100000005ULL);
  EXPECT_EQ(row->axes[1].tick, 0x100000005ULL);
}

TEST_F(PolledSourceTest, ARestartEndsIt) {
  PolledSource source(device, {0});
  set_tick(1000);
  source.next(any_time);
  set_tick(3);
  EXPECT_CONTAINS(host_tools_test::thrown_message<base::DeviceError>([&] { source.next(any_time); }),
                  "restarted");
}

// Who wants to stop the device must be able to.
TEST_F(PolledSourceTest, TheLinkIsLentTwiceASecond) {
  int lent = 0;
  link->while_waiting = [&] { ++lent; };
  PolledSource source(device, {0});
  const auto start = link->now();
  while (link->now() - start < std::chrono::seconds(3)) source.next(any_time);
  EXPECT_GE(lent, 5);
}

}  // namespace kmax::record::polled_source_test
