// The serial port over USB as a third link: commander, transactions and silence, through the whole firmware.
#include <gtest/gtest.h>

#include "tests/board/bench.hpp"

namespace kmax::board::usb_link_test {
namespace {

using firmware::address_of;
using firmware::Fault;
using firmware::words_for;

class UsbLink : public BenchOfWalls {
 protected:
  /// As Bench::request(), over USB.
  Bytes request(const Bytes& pdu) {
    bench.board().receive_usb(firmware::modbus::adu(1, pdu));
    for (int i = 0; i < 4; ++i) {
      bench.run_ticks(1);
      const Bytes reply = bench.board().transmitted_usb();
      if (reply.empty()) continue;
      EXPECT_EQ(firmware::modbus::reference_crc(reply), 0);
      return Bytes(reply.begin() + 1, reply.end() - 2);
    }
    return {};
  }
  int write(std::uint16_t address, const Words& words) {
    return Bench::exception_of(request(firmware::modbus::multiple_request(address, words)));
  }
  int set(std::string_view name, double number) {
    return write(address_of(name, 0), words_for(name, number));
  }
  int command(std::uint16_t word) { return write(address_of("drive.controlword", 0), {word}); }
  bool arm() {
    command(0x06);
    command(0x0F);
    bench.run_ticks(3);
    return bench.state() == DriveState::operation_enabled;
  }
};

constexpr int busy = 6;

TEST_F(UsbLink, ReadsAndWritesAsTheSerialLineDoes) {
  EXPECT_EQ(set("wall.stiffness", 1234), 0);
  EXPECT_EQ(bench.get("wall.stiffness"), 1234);
  EXPECT_EQ(set("wall.stiffness", -1), 3);
  // A reply of several packets.
  EXPECT_EQ(request({4, 0, 0, 0, 2}).size(), bench.request({4, 0, 0, 0, 2}).size());
}

TEST_F(UsbLink, ATransactionOfOneLinkKeepsTheOtherOut) {
  ASSERT_EQ(set("transaction.control", 1), 0);
  EXPECT_EQ(set("wall.stiffness", 800), 0);
  EXPECT_EQ(bench.set("wall.stiffness", 900), busy);
  EXPECT_EQ(bench.set("transaction.control", 1), busy);
  EXPECT_NE(bench.get("wall.stiffness"), 800);
  EXPECT_EQ(set("transaction.control", 2), 0);
  EXPECT_EQ(bench.get("wall.stiffness"), 800);
  ASSERT_EQ(bench.set("transaction.control", 1), 0);
  EXPECT_EQ(set("wall.stiffness", 700), busy);
  EXPECT_EQ(bench.set("transaction.control", 0), 0);
  EXPECT_EQ(set("wall.stiffness", 700), 0);
}

TEST_F(UsbLink, ItsTransactionEndsWithItsSilence) {
  ASSERT_EQ(set("transaction.control", 1), 0);
  EXPECT_EQ(set("wall.stiffness", 800), 0);
  bench.run_ms(2'100);
  EXPECT_EQ(bench.set("wall.stiffness", 900), 0);
  EXPECT_NE(set("wall.stiffness", 950), 0);
  EXPECT_EQ(bench.get("wall.stiffness"), 900) << "what was held up takes no effect by itself";
}

TEST_F(UsbLink, CommandsTheAxisThatItArmed) {
  ASSERT_TRUE(arm());
  EXPECT_NE(bench.set("wall.stiffness", 123), 0) << "another's axis";
  EXPECT_EQ(set("wall.stiffness", 900), 0);
  bench.command(0x06);
  bench.run_ticks(3);
  EXPECT_NE(bench.state(), DriveState::operation_enabled) << "anybody may disarm it";
}

TEST_F(UsbLink, PulledOutWhileArmedTheForceIsGoneWithinTheTimeOut) {
  bench.preset("device.hand_force", 0);  // scripted handles jump
  bench.preset("link.timeout", 0.3);
  bench.preset("link.loss", 0);
  bench.run_ms(5);
  ASSERT_TRUE(arm());
  bench.device.stand_at(-1000);
  for (int i = 0; i < 20; ++i) {
    bench.run_ms(50);
    ASSERT_FALSE(request({3, 0, 0, 0, 1}).empty());
  }
  EXPECT_GT(bench.force(), 0.5f);
  // Nothing comes any more. The other link's host lives on, which does not count.
  for (int i = 0; i < 6; ++i) {
    bench.run_ms(40);
    (void)bench.get("wall.stiffness");
  }
  EXPECT_GT(bench.force(), 0.0f) << "not yet";
  bench.run_ms(70);
  EXPECT_EQ(bench.force(), 0.0f);
  EXPECT_EQ(bench.get("drive.error_code"), firmware::error_code_of(Fault::link_silent));
}

TEST_F(UsbLink, TheSilenceOfTheOtherLinkDoesNotCount) {
  bench.preset("link.timeout", 0.3);
  ASSERT_TRUE(arm());
  for (int i = 0; i < 20; ++i) {
    bench.run_ms(50);
    ASSERT_FALSE(request({3, 0, 0, 0, 1}).empty());
  }
  EXPECT_EQ(bench.state(), DriveState::operation_enabled);
}

TEST_F(UsbLink, ARequestThatFloodsWaitsForRoomAndIsAnsweredInTheEnd) {
  for (int i = 0; i < 20; ++i) bench.board().receive_usb(Bytes(64, 0xEE));
  bench.run_ticks(40);
  (void)bench.board().transmitted_usb();
  EXPECT_EQ(set("wall.stiffness", 500), 0);
}

TEST_F(UsbLink, CountsWhatComesOverItApartFromTheSerialLine) {
  const double serial_errors = bench.get("counters.crc_errors");
  ASSERT_FALSE(request({3, 0, 0, 0, 1}).empty());
  EXPECT_EQ(bench.get("counters.usb_modbus_requests"), 1);
  EXPECT_EQ(bench.get("counters.usb_modbus_errors"), 0);
  bench.board().receive_usb(Bytes(20, 0xEE));
  bench.run_ticks(4);
  EXPECT_EQ(bench.get("counters.usb_modbus_errors"), 1);
  EXPECT_EQ(bench.get("counters.crc_errors"), serial_errors);
  bench.application().usb().set_readings({.resets = 1,
                                          .suspensions = 2,
                                          .refused_requests = 3,
                                          .frames_lost = 4,
                                          .frames_not_sent = 5,
                                          .frames_refused = 6});
  EXPECT_EQ(bench.get("counters.usb_resets"), 1);
  EXPECT_EQ(bench.get("counters.usb_suspensions"), 2);
  EXPECT_EQ(bench.get("counters.usb_refused_requests"), 3);
  EXPECT_EQ(bench.get("counters.usb_frames_lost"), 4);
  EXPECT_EQ(bench.get("counters.usb_frames_not_sent"), 5);
  EXPECT_EQ(bench.get("counters.usb_frames_refused"), 6);
}

TEST_F(UsbLink, ANodeThatIsReachedOverUsbNeedsNoBus) {
  auto& can = bench.application().can();
  drivers::CanFrame frame;
  for (int i = 0; i < 20 && can.next_frame(frame); ++i) {
  }  // boot-up
  bool answered = false;
  can.take({.identifier = 0x601, .length = 8, .data = {0x40, 0x00, 0x10, 0, 0, 0, 0, 0}});
  for (int i = 0; i < 20 && can.next_frame(frame); ++i) answered = answered || frame.identifier == 0x581;
  EXPECT_TRUE(answered);
}

}  // namespace
}  // namespace kmax::board::usb_link_test
