#include "host_tools/device/can/can_faults.hpp"

#include <gtest/gtest.h>
#include <linux/can/error.h>

#include "tests/host_tools/thrown_message.hpp"

namespace kmax::device::can_faults_test {

can_frame report(canid_t classes, std::uint8_t controller = 0, std::uint8_t violation = 0) {
  can_frame frame{};
  frame.can_id = classes | CAN_ERR_FLAG;
  frame.can_dlc = CAN_ERR_DLC;
  frame.data[1] = controller;
  frame.data[2] = violation;
  return frame;
}

std::string words_after(const can_frame& frame) {
  CanFaults faults;
  faults.take(frame);
  return faults.words("can0");
}

TEST(CanFaults, SilentWithoutAReport) {
  const CanFaults faults;
  EXPECT_EQ(faults.words("can0"), "");
  EXPECT_FALSE(faults.bus_off());
}

TEST(CanFaults, EachClassInWords) {
  EXPECT_CONTAINS(words_after(report(CAN_ERR_ACK)), "nobody on the bus acknowledges");
  EXPECT_CONTAINS(words_after(report(CAN_ERR_ACK)), "bit rate");
  EXPECT_CONTAINS(words_after(report(CAN_ERR_TRX)), "transceiver");
  EXPECT_CONTAINS(words_after(report(CAN_ERR_PROT, 0, CAN_ERR_PROT_STUFF)), "stuffing");
  EXPECT_CONTAINS(words_after(report(CAN_ERR_PROT, 0, CAN_ERR_PROT_FORM)), "form");
  EXPECT_CONTAINS(words_after(report(CAN_ERR_PROT, 0, CAN_ERR_PROT_BIT0)), "differ");
  EXPECT_CONTAINS(words_after(report(CAN_ERR_CRTL, CAN_ERR_CRTL_TX_PASSIVE)), "error passive");
  EXPECT_CONTAINS(words_after(report(CAN_ERR_CRTL, CAN_ERR_CRTL_RX_WARNING)), "warns");
  EXPECT_CONTAINS(words_after(report(CAN_ERR_CRTL, CAN_ERR_CRTL_RX_OVERFLOW)), "receive overflow");
  EXPECT_CONTAINS(words_after(report(CAN_ERR_TX_TIMEOUT)), "could not send in time");
  EXPECT_CONTAINS(words_after(report(CAN_ERR_BUSERROR)), "errors on the bus");
}

TEST(CanFaults, ALostArbitrationIsNoTrouble) {
  EXPECT_EQ(words_after(report(CAN_ERR_LOSTARB)), "");
}

TEST(CanFaults, TheCauseComesBeforeItsEffect) {
  CanFaults faults;
  faults.take(report(CAN_ERR_ACK));
  faults.take(report(CAN_ERR_CRTL, CAN_ERR_CRTL_TX_PASSIVE));
  EXPECT_CONTAINS(faults.words("can0"), "nobody on the bus acknowledges");
  EXPECT_CONTAINS(faults.words("can0"), "2 reports");
}

TEST(CanFaults, TheControllersCountersAreShown) {
  can_frame frame = report(CAN_ERR_ACK | CAN_ERR_CNT);
  frame.data[6] = 128;
  frame.data[7] = 3;
  EXPECT_CONTAINS(words_after(frame), "128 transmitting and 3 receiving");
}

TEST(CanFaults, BusOffSaysHowToComeBackAndStaysUntilARestart) {
  CanFaults faults;
  faults.take(report(CAN_ERR_BUSOFF));
  EXPECT_TRUE(faults.bus_off());
  EXPECT_CONTAINS(faults.words("can1"), "bus-off");
  EXPECT_CONTAINS(faults.words("can1"), "sudo ip link set can1 type can restart");
  faults.frame_received();  // of another program on this machine, maybe
  EXPECT_TRUE(faults.bus_off());
  EXPECT_CONTAINS(faults.words("can1"), "bus-off");
  faults.take(report(CAN_ERR_RESTARTED));
  EXPECT_FALSE(faults.bus_off());
  EXPECT_EQ(faults.words("can1"), "");
}

TEST(CanFaults, AGoodFrameOrARecoveryEndsTheRest) {
  CanFaults faults;
  faults.take(report(CAN_ERR_ACK));
  faults.frame_received();
  EXPECT_EQ(faults.words("can0"), "");
  faults.take(report(CAN_ERR_CRTL, CAN_ERR_CRTL_TX_PASSIVE));
  faults.take(report(CAN_ERR_CRTL, CAN_ERR_CRTL_ACTIVE));
  EXPECT_EQ(faults.words("can0"), "");
}

}  // namespace kmax::device::can_faults_test
