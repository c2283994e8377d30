// What the edge takes from its queue, by the application behind it.
#include "firmware/links/canopen_edge.hpp"

#include <gtest/gtest.h>

#include "firmware/application.hpp"

namespace kmax::firmware::canopen_edge_test {
namespace {

TEST(CanopenEdge, OfAFloodAPollTakesSixteenFrames) {
  Application application(BoardIdentity{});
  CanReadings readings;
  readings.state = CanState::active;
  application.can().set_readings(readings);
  const auto poll = [&application](std::uint32_t now_us) {
    application.poll(now_us);
    drivers::CanFrame sent;
    while (application.can().next_frame(sent)) {
    }
  };
  poll(0);
  const Entry& entry = entry_at(entry_of<"capture.samples">());
  for (std::uint8_t number = 1; number <= 40; ++number) {
    application.can().ISR_frame(
        {.identifier = 0x601,
         .length = 8,
         .data = {0x23, static_cast<std::uint8_t>(entry.index()),
                  static_cast<std::uint8_t>(entry.index() >> 8), entry.object_subindex(), number, 0, 0, 0}});
  }
  for (const int taken : {16, 32, 40, 40}) {
    poll(50);
    EXPECT_EQ(application.values().whole<"capture.samples">(), taken);
  }
}

}  // namespace
}  // namespace kmax::firmware::canopen_edge_test
