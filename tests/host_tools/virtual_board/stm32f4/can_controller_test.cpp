// RM0090, chapter Controller area network (bxCAN), register by register.
#include "host_tools/virtual_board/stm32f4/can_controller.hpp"

#include <gtest/gtest.h>

#include "drivers/stm32f4/interrupts.hpp"
#include "host_tools/virtual_board/stm32f4/can_host_node.hpp"
#include "tests/host_tools/virtual_board/model_bench.hpp"

namespace kmax::virtual_board::can_controller_test {

using drivers::CanFrame;
using drivers::stm32f4::Interrupt;

constexpr std::uint32_t mcr = 0x00, msr = 0x04, tsr = 0x08, rf0r = 0x0C, ier = 0x14, esr = 0x18, btr = 0x1C;
constexpr std::uint32_t ti0r = 0x180, tdt0r = 0x184, ri0r = 0x1B0, rdt0r = 0x1B4, rdl0r = 0x1B8;
constexpr std::uint32_t fmr = 0x200, fm1r = 0x204, fs1r = 0x20C, ffa1r = 0x214, fa1r = 0x21C, bank0 = 0x240;
constexpr std::uint32_t btr_500k = 0x033F'0003;
constexpr BoardTime bit = 84 * 8;

struct Bench : testing::ModelBench {
  Bench() : ModelBench({&can}, 100'000) { clocks.apb1 = units_per_period(42'000'000); }
  void initialize() {
    write(mcr, 0x0001'0001);
    run(bit);
    write(btr, btr_500k);
    write(fs1r, 1);
    write(fa1r, 1);
    write(fmr, 0x2A1C'0E00);
  }
  void join() {
    initialize();
    write(mcr, 0x0001'0000);
    run(12 * bit);
    ASSERT_EQ(read(msr) & 3U, 0U);
  }
  void request(unsigned mailbox, std::uint32_t identifier) {
    write(ti0r + 16 * mailbox, identifier << 21 | 1U);
  }
  CanBus bus;
  CanController can{clocks, interrupts, bus};
};

TEST(CanController, ResetValues) {
  Bench bench;
  EXPECT_EQ(bench.read(mcr), 0x0001'0002U);
  EXPECT_EQ(bench.read(msr), 0x0000'0C02U);
  EXPECT_EQ(bench.read(tsr), 0x1C00'0000U);
  EXPECT_EQ(bench.read(fmr), 0x2A1C'0E01U);
  EXPECT_EQ(bench.read(esr), 0U);
  bench.join();
  bench.request(0, 1);
  bench.can.reset(bench.now);
  EXPECT_EQ(bench.read(msr), 0x0000'0C02U);
  EXPECT_EQ(bench.read(tsr), 0x1C00'0000U);
}

// Section Initialization mode; figure bxCAN operating modes.
TEST(CanController, InitializationHandshake) {
  Bench bench;
  bench.write(mcr, 0x0001'0001);
  EXPECT_EQ(bench.read(msr) & 3U, 2U) << "not at once";
  bench.run(bit);
  EXPECT_EQ(bench.read(msr) & 3U, 1U);
  bench.write(btr, btr_500k);
  const BoardTime left = bench.now;
  bench.write(mcr, 0x0001'0000);
  bench.run(11 * bit - 1);
  EXPECT_EQ(bench.read(msr) & 1U, 1U) << "eleven recessive bits";
  bench.run(1);
  EXPECT_EQ(bench.read(msr) & 1U, 0U);
  EXPECT_EQ(bench.now - left, 11 * bit);
}

TEST(CanController, InitializationWaitsForTheFrameUnderWay) {
  Bench bench;
  CanHostNode host{bench.bus, 500'000};
  bench.join();
  host.send({.identifier = 1, .length = 8}, bench.now);
  bench.run(50 * bit);
  EXPECT_NE(bench.read(msr) & 0x200U, 0U) << "RXM";
  bench.write(mcr, 0x0001'0001);
  bench.run(20 * bit);
  EXPECT_EQ(bench.read(msr) & 1U, 0U);
  bench.run(100 * bit);
  EXPECT_EQ(bench.read(msr) & 1U, 1U);
  EXPECT_EQ(bench.read(rf0r) & 3U, 1U) << "the frame was received to its end";
}

// Section Transmission handling, Transmit priority: by identifier, then by mailbox number.
TEST(CanController, MailboxesByIdentifierThenByNumber) {
  Bench bench;
  CanHostNode host{bench.bus, 500'000};
  std::vector<std::uint32_t> order;
  host.on_frame(
      [&](const CanFrame& frame, BoardTime) { order.push_back(frame.identifier * 16 + frame.length); });
  bench.join();
  for (unsigned i = 0; i < 3; ++i) bench.write(tdt0r + 16 * i, i);
  CanHostNode other{bench.bus, 500'000};
  other.send({.identifier = 0x7FF}, bench.now);  // the bus is taken while the mailboxes are filled
  bench.run(bit);
  bench.request(0, 0x300);
  bench.request(1, 0x100);
  EXPECT_EQ(bench.read(tsr) & 0xFF00'0000U, 0x3200'0000U) << "LOW0, TME2, CODE 2";
  bench.request(2, 0x100);
  EXPECT_EQ(bench.read(tsr) & 0xFF00'0000U, 0x2000'0000U) << "LOW0, none empty, CODE 0";
  EXPECT_THROW(bench.request(0, 5), RefusedAccess);
  bench.run(1000 * bit);
  EXPECT_EQ(order, (std::vector<std::uint32_t>{0x7FF0, 0x1001, 0x1002, 0x3000}));
  EXPECT_EQ(bench.read(tsr), 0x1C03'0303U);
  bench.write(tsr, 0x0000'0100);
  EXPECT_EQ(bench.read(tsr), 0x1C03'0003U) << "RQCP takes TXOK along";
  bench.request(0, 0x300);
  EXPECT_EQ(bench.read(tsr) & 0xFU, 0U) << "cleared by TXRQ";
}

// Section Transmission handling, Abort.
TEST(CanController, AbortWaitingAndUnderWay) {
  Bench bench;
  CanHostNode host{bench.bus, 500'000};
  bench.join();
  bench.request(0, 0x100);
  bench.request(1, 0x200);
  bench.run(20 * bit);
  bench.write(tsr, 0x0000'8080);
  EXPECT_EQ(bench.read(tsr) & 0x0000'FFFFU, 0x0000'0180U) << "mailbox 1 at once, mailbox 0 is on the wire";
  bench.run(200 * bit);
  EXPECT_EQ(bench.read(tsr) & 0x0000'FFFFU, 0x0000'0103U) << "sent after all";

  bench.bus.destroy_frames(1);
  bench.request(0, 0x100);
  bench.run(5 * bit);
  bench.write(tsr, 0x80);
  bench.run(200 * bit);
  EXPECT_EQ(bench.read(tsr) & 0xFFU, 0x09U) << "failed, so aborted: RQCP and TERR";
}

// NART: section Nonautomatic retransmission mode.
TEST(CanController, NoRetransmissionEndsWithTheFirstFailure) {
  Bench bench;
  CanHostNode host{bench.bus, 500'000};
  bench.initialize();
  bench.write(mcr, 0x0001'0010);
  bench.run(12 * bit);
  host.send({.identifier = 0x10}, bench.now);
  host.send({.identifier = 0x10}, bench.now);
  bench.run(bit);
  bench.request(0, 0x20);
  bench.run(300 * bit);
  EXPECT_EQ(bench.read(tsr) & 0xFFU, 0x05U) << "RQCP and ALST";
}

// Section Reception handling, FIFO management, Overrun.
TEST(CanController, FifoOfThreeWithOverrun) {
  Bench bench;
  CanHostNode host{bench.bus, 500'000};
  bench.join();
  bench.write(ier, 0x0E);
  for (std::uint32_t i = 1; i <= 4; ++i) host.send({.identifier = i, .length = 1, .data = {9}}, bench.now);
  EXPECT_THROW(bench.read(ri0r), RefusedAccess) << "empty";
  bench.run(100 * bit);
  EXPECT_EQ(bench.read(rf0r), 1U);
  EXPECT_TRUE(bench.interrupts.level(Interrupt::can1_rx0));
  bench.run(400 * bit);
  EXPECT_EQ(bench.read(rf0r), 0x1BU) << "FOVR, FULL, three pending";
  EXPECT_EQ(bench.read(rdl0r), 0xCCCC'CC09U) << "bytes beyond DLC are not zero";
  EXPECT_EQ(bench.read(rdt0r), 1U);
  for (const std::uint32_t expected : {1U, 2U, 4U}) {
    EXPECT_EQ(bench.read(ri0r), expected << 21);
    bench.write(rf0r, 0x20);
  }
  EXPECT_EQ(bench.read(rf0r), 0x18U);
  EXPECT_TRUE(bench.interrupts.level(Interrupt::can1_rx0)) << "FULL and FOVR are still up";
  bench.write(rf0r, 0x18);
  EXPECT_FALSE(bench.interrupts.level(Interrupt::can1_rx0));
}

// Section Error management; registers ESR and MSR.ERRI.
TEST(CanController, ErrorFlagsRiseWithTheCountersAndInterrupt) {
  Bench bench;
  bench.join();
  bench.write(ier, 0x8700);
  bench.request(0, 1);
  const auto run_until = [&](std::uint32_t flag) {
    for (int i = 0; i < 100'000 && (bench.read(esr) & flag) == 0; ++i) bench.run(bit);
    return bench.read(esr) >> 16 & 0xFFU;
  };
  EXPECT_EQ(run_until(1), 96U) << "EWGF";
  EXPECT_TRUE(bench.interrupts.level(Interrupt::can1_sce));
  EXPECT_EQ(bench.read(esr) >> 4 & 7U, 3U) << "LEC: acknowledgement";
  bench.write(msr, 4);
  EXPECT_FALSE(bench.interrupts.level(Interrupt::can1_sce));
  EXPECT_EQ(run_until(2), 128U) << "EPVF";
  EXPECT_TRUE(bench.interrupts.level(Interrupt::can1_sce));
  bench.write(msr, 4);
  bench.run(10'000 * bit);
  EXPECT_EQ(bench.read(esr) & 4U, 0U) << "not bus-off by missing acknowledgements";
  EXPECT_FALSE(bench.interrupts.level(Interrupt::can1_sce)) << "no flag has risen";
  bench.bus.destroy_frames(100);
  EXPECT_EQ(run_until(4), 255U) << "BOFF";
  EXPECT_TRUE(bench.interrupts.level(Interrupt::can1_sce));
}

// Section Error management, Bus-Off recovery, ABOM = 0.
TEST(CanController, BusOffIsLeftThroughInitializationAnd128TimesElevenBits) {
  Bench bench;
  CanHostNode host{bench.bus, 500'000};
  bench.join();
  bench.bus.destroy_frames(32);
  bench.request(0, 1);
  bench.run(3'000 * bit);
  ASSERT_TRUE(bench.can.bus_off());
  bench.run(10'000 * bit);
  EXPECT_TRUE(bench.can.bus_off()) << "recessive bits alone do not help";
  host.send({.identifier = 5}, bench.now);
  bench.run(2'000 * bit);
  EXPECT_EQ(bench.read(rf0r), 0U) << "hears nothing";
  host.set_connected(false, bench.now);
  bench.run(200 * bit);
  bench.write(mcr, 0x0001'0001);
  bench.run(bit);
  ASSERT_EQ(bench.read(msr) & 1U, 1U);
  bench.run(10'000 * bit);
  EXPECT_TRUE(bench.can.bus_off()) << "it does not count in initialization mode";
  bench.write(mcr, 0x0001'0000);
  bench.run(11 * bit);
  EXPECT_EQ(bench.read(msr) & 1U, 0U);
  bench.run(127 * 11 * bit - 1);
  EXPECT_NE(bench.read(esr) & 4U, 0U);
  bench.run(1);
  EXPECT_EQ(bench.read(esr) & 0xFFFF'0007U, 0U);
  host.set_connected(true, bench.now);
  bench.run(400 * bit);
  EXPECT_EQ(bench.read(tsr) & 0xFFU, 0x0BU) << "the request was still there: RQCP, TXOK, TERR of before";
}

// Section Test mode.
TEST(CanController, SilentModeHearsAndIsNotHeard) {
  Bench bench;
  CanHostNode host{bench.bus, 500'000};
  bench.initialize();
  bench.write(btr, btr_500k | 1U << 31);
  bench.write(mcr, 0x0001'0000);
  bench.run(12 * bit);
  bench.request(0, 1);
  host.send({.identifier = 2}, bench.now);
  bench.run(500 * bit);
  EXPECT_EQ(host.sent(), 0U) << "no acknowledgement";
  CanHostNode other{bench.bus, 500'000};
  bench.run(500 * bit);
  EXPECT_EQ(host.sent(), 1U);
  EXPECT_EQ(bench.read(rf0r) & 3U, 1U);
  EXPECT_EQ(bench.read(tsr) & 0xFFU, 0U) << "cannot start a transmission";
}

TEST(CanController, MasterResetGoesToSleep) {
  Bench bench;
  bench.join();
  bench.write(mcr, 0x8000);
  EXPECT_EQ(bench.read(mcr), 0x0001'0002U);
  EXPECT_EQ(bench.read(msr) & 3U, 2U);
}

// Section Register access protection, and what is not modelled.
TEST(CanController, RefusesWhatHardwareWouldIgnoreOrIsNotModelled) {
  const auto refused = [](auto&& action) {
    Bench bench;
    bench.join();
    EXPECT_THROW(action(bench), RefusedAccess);
  };
  for (const std::uint32_t value : {0x04U, 0x08U, 0x20U, 0x40U, 0x80U, 0x03U, 0x02U, 0x0100U}) {
    refused([value](Bench& bench) { bench.write(mcr, value); });
  }
  refused([](Bench& bench) { bench.write(btr, btr_500k); });
  refused([](Bench& bench) { bench.write(ier, 1U << 16); });
  refused([](Bench& bench) { bench.write(ier, 1U << 7); });
  refused([](Bench& bench) { bench.write(tsr, bench.read(tsr)); });
  refused([](Bench& bench) { bench.write(rf0r, 1); });
  refused([](Bench& bench) { bench.write(tdt0r, 9); });
  refused([](Bench& bench) { bench.write(tdt0r, 0x100); });
  refused([](Bench& bench) {
    bench.write(ti0r, 8);
    bench.write(ti0r, 9);
  });
  refused([](Bench& bench) { bench.write(msr, 8); });
  refused([](Bench& bench) { bench.write(0x20, 0); });
  refused([](Bench& bench) { bench.write(0x1B0, 0); });
  refused([](Bench& bench) { bench.read(mcr, 1); });
  Bench sleeping;
  EXPECT_THROW(sleeping.write(mcr, 0x0001'0003), RefusedAccess) << "INRQ with SLEEP";
  EXPECT_THROW(sleeping.write(mcr, 0x0001'0000), RefusedAccess);
  sleeping.initialize();
  EXPECT_THROW(sleeping.write(btr, btr_500k | 1U << 30), RefusedAccess) << "LBKM alone";
}

TEST(CanFilters, Protection) {
  Bench bench;
  EXPECT_THROW(bench.write(fa1r, 1), RefusedAccess) << "16-bit scale";
  bench.write(fs1r, 3);
  bench.write(fa1r, 1);
  bench.write(bank0, 5);
  bench.write(fmr, 0x2A1C'0E00);
  EXPECT_THROW(bench.write(bank0, 6), RefusedAccess) << "active";
  bench.write(bank0 + 8, 6);
  EXPECT_EQ(bench.read(bank0), 5U);
  EXPECT_EQ(bench.read(bank0 + 8), 6U);
  for (const std::uint32_t offset : {fm1r, fs1r, ffa1r}) EXPECT_THROW(bench.write(offset, 0), RefusedAccess);
  EXPECT_THROW(bench.write(fmr, 0x2A1C'0001), RefusedAccess) << "CAN2SB";
  EXPECT_THROW(bench.write(bank0 + 14 * 8, 0), RefusedAccess) << "bank of CAN2";
  EXPECT_THROW(bench.write(fa1r, 1U << 14), RefusedAccess);
}

}  // namespace kmax::virtual_board::can_controller_test
