#include "drivers/stm32f4/can.hpp"

#include <gtest/gtest.h>

#include "tests/drivers/fake_register.hpp"

namespace kmax::drivers::stm32f4::can_test {

constexpr CanConfig at_500k{.timing = can_bit_timing<42'000'000, 500'000>()};

struct FakeTransmitMailbox {
  FakeRegister tir, tdtr, tdlr, tdhr;
};
struct FakeReceiveMailbox {
  FakeRegister rir, rdtr, rdlr, rdhr;
};
struct FakeBank {
  FakeRegister fr1, fr2;
};
struct FakeCan {
  FakeRegister mcr, msr, tsr, rfr[2], ier, esr, btr;
  FakeTransmitMailbox mailbox[3];
  FakeReceiveMailbox fifo[2];
  FakeRegister fmr, fm1r, fs1r, ffa1r, fa1r;
  FakeBank bank[28];
};

struct Pend {
  unsigned* count;
  void operator()() const { ++*count; }
};

struct Bench {
  Bench() {
    can.mcr.value = 0x0001'0002;
    can.msr.value = 0xC02;
    can.fmr.value = 0x2A1C'0E01;
    can.tsr.value = empty;
    can.mcr.on_write = [this](std::uint32_t word) {
      can.msr.value = acknowledges ? (word & 1U) | 0xC00 : 0U;
    };
    // The status register as the hardware keeps it, for the mailboxes at least.
    can.tsr.on_write = [this](std::uint32_t word) {
      status &= ~(word & 0x000F'0F0F);
      for (unsigned i = 0; i < 3; ++i) {
        if ((word >> (8 * i) & 1U) != 0) status &= ~(0xFU << (8 * i));
      }
      aborts |= word & 0x0080'8080;
    };
    can.tsr.on_read = [this](std::uint32_t) { return status; };
    for (unsigned i = 0; i < 3; ++i) {
      can.mailbox[i].tir.on_write = [this, i](std::uint32_t word) {
        if ((word & 1U) == 0) return;
        EXPECT_NE(status >> (26 + i) & 1U, 0U) << "mailbox " << i << " is not empty";
        status &= ~(1U << (26 + i));
      };
    }
    for (FakeRegister& each : can.rfr) each.on_write = [](std::uint32_t) {};
  }
  /// The hardware is done with a mailbox.
  void complete(unsigned i, bool sent, std::uint32_t more = 0) {
    status |= (sent ? 3U : 1U) << (8 * i) | more << (8 * i) | 1U << (26 + i);
    aborts &= ~(0x80U << (8 * i));
    driver.ISR_serve_transmit();
  }
  std::uint32_t identifier_in(unsigned mailbox) const { return can.mailbox[mailbox].tir.value >> 21; }
  bool taken(unsigned mailbox) const { return (status >> (26 + mailbox) & 1U) == 0; }
  void send(std::uint32_t identifier, std::uint8_t byte = 0) {
    ASSERT_EQ(driver.send({.identifier = identifier, .length = 1, .data = {byte}}), CanSendResult::queued);
    driver.ISR_serve_transmit();
  }

  static constexpr std::uint32_t empty = 0x1C00'0000;
  bool acknowledges = true;
  std::uint32_t status = empty, aborts = 0;
  unsigned pended = 0;
  FakeCan can;
  Can<Pend, 8, FakeCan> driver{can, Pend{&pended}};
};

struct OnTheBus : Bench {
  OnTheBus() {
    EXPECT_EQ(driver.configure(at_500k, std::array{CanFilter{}}), CanConfigureResult::ok);
    EXPECT_EQ(driver.poll(0), CanBusState::on_bus);
    aborts = 0;
  }
};

TEST(Can, ConfigureInOrder) {
  Bench bench;
  std::vector<CanFilter> filters{CanFilter{}, can_filter_standard_list(0, 0x80, 1)};
  bench.can.bank[0].fr1.value = bench.can.bank[0].fr2.value = 0x1234'5678;  // left by an earlier life
  ASSERT_EQ(bench.driver.configure({.timing = can_bit_timing<42'000'000, 1'000'000>()}, filters),
            CanConfigureResult::ok);
  EXPECT_EQ(bench.can.mcr.writes, (std::vector<std::uint32_t>{0x0001'0001, 0x0001'0000}))
      << "SLEEP falls with INRQ";
  EXPECT_EQ(bench.can.btr.value, 0x011A'0002U);
  EXPECT_EQ(bench.can.fa1r.writes, (std::vector<std::uint32_t>{0, 3}));
  EXPECT_EQ(bench.can.fm1r.value, 2U);
  EXPECT_EQ(bench.can.fs1r.value, 3U);
  EXPECT_EQ(bench.can.ffa1r.value, 2U);
  EXPECT_EQ(bench.can.fmr.value, 0x2A1C'0E00U);
  EXPECT_EQ(bench.can.ier.writes, (std::vector<std::uint32_t>{0, 0x0000'865B}));
  EXPECT_EQ(bench.can.bank[0].fr1.value | bench.can.bank[0].fr2.value, 0U);
  EXPECT_EQ(bench.can.bank[1].fr1.value, 0U);
  EXPECT_EQ(bench.can.bank[1].fr2.value, 0x80U << 21);
  // What an earlier life has left: three frames in each FIFO, the mailboxes, the error interrupt.
  for (const FakeRegister& each : bench.can.rfr)
    EXPECT_EQ(each.writes, (std::vector<std::uint32_t>{0x38, 0x38, 0x38})) << "RFOM, FOVR, FULL";
  EXPECT_EQ(bench.can.tsr.writes, (std::vector<std::uint32_t>{0x0080'8080, 0x0001'0101}));
  EXPECT_EQ(bench.can.msr.writes, (std::vector<std::uint32_t>{1U << 2})) << "ERRI";
}

TEST(Can, SilentHardwareIsNamed) {
  Bench bench;
  bench.acknowledges = false;
  EXPECT_EQ(bench.driver.configure(at_500k, {}), CanConfigureResult::no_initialization_mode);
  EXPECT_EQ(bench.driver.send({}), CanSendResult::not_on_the_bus);
  EXPECT_EQ(bench.driver.poll(0), CanBusState::off);
}

TEST(Can, RefusesBadSettings) {
  Bench bench;
  EXPECT_EQ(bench.driver.configure({}, {}), CanConfigureResult::bad_timing);
  EXPECT_EQ(bench.driver.configure(at_500k, std::vector<CanFilter>(15)),
            CanConfigureResult::too_many_filters);
  EXPECT_TRUE(bench.can.mcr.writes.empty());
  OnTheBus joined;
  EXPECT_EQ(joined.driver.send({.identifier = 0x800}), CanSendResult::bad_frame);
  EXPECT_EQ(joined.driver.send({.length = 9}), CanSendResult::bad_frame);
}

TEST(Can, FrameIntoTheMailbox) {
  OnTheBus bench;
  ASSERT_EQ(bench.driver.send(
                {.identifier = 0x1ABCDEF0, .extended = true, .length = 8, .data = {1, 2, 3, 4, 5, 6, 7, 8}}),
            CanSendResult::queued);
  EXPECT_EQ(bench.pended, 1U);
  EXPECT_TRUE(bench.can.mailbox[0].tir.writes.empty()) << "mailboxes belong to the interrupt";
  bench.driver.ISR_serve_transmit();
  EXPECT_EQ(bench.can.mailbox[0].tir.value, 0x1ABCDEF0U << 3 | 5U);
  EXPECT_EQ(bench.can.mailbox[0].tdtr.value, 8U);
  EXPECT_EQ(bench.can.mailbox[0].tdlr.value, 0x0403'0201U);
  EXPECT_EQ(bench.can.mailbox[0].tdhr.value, 0x0807'0605U);
}

TEST(Can, HasRoomOnTheBusForAsManyAsItHasSlots) {
  Bench off;
  EXPECT_FALSE(off.driver.has_room()) << "not on the bus";
  OnTheBus bench;
  EXPECT_EQ(bench.driver.state(), CanBusState::on_bus);
  for (std::uint32_t i = 0; i < 8; ++i) {
    EXPECT_TRUE(bench.driver.has_room()) << i;
    EXPECT_EQ(bench.driver.send({.identifier = i}), CanSendResult::queued);
  }
  EXPECT_FALSE(bench.driver.has_room());
  EXPECT_EQ(bench.driver.send({.identifier = 9}), CanSendResult::queue_full);
  bench.driver.ISR_serve_transmit();
  bench.complete(0, true);
  EXPECT_TRUE(bench.driver.has_room());
  EXPECT_EQ(bench.driver.bus_off_counters().bus_offs, 0U);
}

TEST(Can, OneIdentifierIsNeverInTwoMailboxes) {
  OnTheBus bench;
  for (std::uint8_t i = 0; i < 4; ++i) bench.send(0x200, i);
  ASSERT_EQ(bench.driver.send({.identifier = 0x200, .remote = true}), CanSendResult::queued);
  bench.driver.ISR_serve_transmit();
  EXPECT_FALSE(bench.taken(1) || bench.taken(2));
  for (std::uint8_t i = 0; i < 4; ++i) {
    EXPECT_EQ(bench.can.mailbox[0].tdlr.value, i);
    EXPECT_FALSE(bench.taken(1) || bench.taken(2));
    bench.complete(0, true);
  }
  EXPECT_NE(bench.can.mailbox[0].tir.value & 2U, 0U) << "the remote frame is the youngest";
  EXPECT_EQ(bench.driver.transmit_counters().sent, 4U);
}

TEST(Can, MostUrgentFirstAndTheLeastUrgentMakesRoom) {
  OnTheBus bench;
  for (const std::uint32_t identifier : {0x500U, 0x700U, 0x600U}) bench.send(identifier);
  EXPECT_EQ(bench.aborts, 0U);
  bench.send(0x650);
  EXPECT_EQ(bench.aborts, 0x0000'8000U) << "0x700 in mailbox 1";
  bench.send(0x080);
  EXPECT_EQ(bench.aborts, 0x0000'8000U) << "one at a time";
  bench.complete(1, false);
  EXPECT_EQ(bench.identifier_in(1), 0x080U) << "the alarm, not the one that was first to ask";
  EXPECT_EQ(bench.aborts, 0U) << "0x650 is less urgent than all three mailboxes";
  EXPECT_EQ(bench.driver.transmit_counters().aborted, 1U);
  bench.complete(1, true);
  EXPECT_EQ(bench.identifier_in(1), 0x650U);
  bench.complete(0, true);
  EXPECT_EQ(bench.identifier_in(0), 0x700U) << "taken back, not lost";
}

TEST(Can, AbortedFrameKeepsItsPlaceAmongItsOwn) {
  OnTheBus bench;
  for (const std::uint32_t identifier : {0x500U, 0x600U}) bench.send(identifier);
  bench.send(0x700, 1);
  bench.send(0x700, 2);
  bench.send(0x100);
  ASSERT_EQ(bench.aborts, 0x0080'0000U);
  bench.complete(2, false);
  EXPECT_EQ(bench.identifier_in(2), 0x100U);
  bench.complete(2, true);
  EXPECT_EQ(bench.can.mailbox[2].tdlr.value, 1U) << "the older one again";
  bench.complete(2, true);
  EXPECT_EQ(bench.can.mailbox[2].tdlr.value, 2U);
}

TEST(Can, AbortThatCameTooLateCountsAsSent) {
  OnTheBus bench;
  for (const std::uint32_t identifier : {0x500U, 0x600U, 0x700U, 0x100U}) bench.send(identifier);
  ASSERT_NE(bench.aborts, 0U);
  bench.complete(2, true, 4);
  EXPECT_EQ(bench.driver.transmit_counters().sent, 1U);
  EXPECT_EQ(bench.driver.transmit_counters().aborted, 0U);
  EXPECT_EQ(bench.driver.transmit_counters().arbitration_lost, 1U);
}

TEST(Can, AFullQueueRefusesAndNothingIsOverwritten) {
  OnTheBus bench;
  for (std::uint8_t i = 0; i < 8; ++i) bench.send(0x300, i);
  EXPECT_EQ(bench.driver.send({.identifier = 0x300}), CanSendResult::queue_full);
  for (std::uint8_t i = 0; i < 8; ++i) {
    EXPECT_EQ(bench.can.mailbox[0].tdlr.value, i);
    bench.complete(0, true);
  }
}

// Off the bus: what waits goes at once, what is in a mailbox when the hardware gives it back, each one once.
TEST(Can, BusOffDiscardsEveryFrameOnce) {
  OnTheBus bench;
  for (const std::uint32_t identifier : {0x500U, 0x600U, 0x700U, 0x750U, 0x760U}) bench.send(identifier);
  bench.can.esr.value = 1U << 2;
  EXPECT_EQ(bench.driver.poll(1), CanBusState::waiting);
  EXPECT_EQ(bench.aborts, 0x0080'8080U);
  bench.driver.ISR_serve_transmit();
  EXPECT_EQ(bench.driver.transmit_counters().discarded, 2U);
  for (unsigned mailbox = 0; mailbox < 2; ++mailbox) bench.complete(mailbox, false);
  bench.complete(2, true);
  EXPECT_EQ(bench.driver.transmit_counters().discarded, 4U);
  EXPECT_EQ(bench.driver.transmit_counters().sent, 1U);
  EXPECT_EQ(bench.driver.transmit_counters().aborted, 0U);
  EXPECT_EQ(bench.status, Bench::empty) << "nothing went into a mailbox meanwhile";
}

TEST(Can, ComesBackFromBusOffAndSendsAgain) {
  OnTheBus bench;
  bench.can.mcr.writes.clear();
  bench.can.esr.value = 1U << 2;
  EXPECT_EQ(bench.driver.poll(1), CanBusState::waiting);
  EXPECT_EQ(bench.pended, 1U);
  EXPECT_FALSE(bench.driver.has_room());
  EXPECT_EQ(bench.driver.send({}), CanSendResult::not_on_the_bus);
  EXPECT_TRUE(bench.can.mcr.writes.empty());
  EXPECT_EQ(bench.driver.poll(100'001), CanBusState::entering);
  EXPECT_EQ(bench.can.mcr.writes, (std::vector<std::uint32_t>{0x0001'0001})) << "INRQ";
  EXPECT_EQ(bench.driver.poll(100'002), CanBusState::recovering);
  EXPECT_EQ(bench.can.mcr.writes, (std::vector<std::uint32_t>{0x0001'0001, 0x0001'0000}));
  EXPECT_EQ(bench.driver.poll(100'003), CanBusState::recovering) << "still off";
  bench.can.esr.value = 0;
  EXPECT_EQ(bench.driver.poll(100'004), CanBusState::on_bus);
  EXPECT_TRUE(bench.driver.has_room());
  bench.send(0x123);
  EXPECT_EQ(bench.identifier_in(0), 0x123U);
  EXPECT_EQ(bench.driver.bus_off_counters().bus_offs, 1U);
}

TEST(Can, ReceiveIsBoundedWhenTheFifoNeverEmpties) {
  Bench bench;
  bench.can.rfr[0].on_read = [](std::uint32_t) { return 3U; };
  bench.can.fifo[0].rdtr.value = 0x0000'050F;
  unsigned frames = 0;
  bench.driver.ISR_receive(0, [&](const CanFrame& frame, std::uint8_t) {
    EXPECT_EQ(frame.length, 8) << "DLC 15 means 8";
    ++frames;
  });
  EXPECT_EQ(frames, 3U);
}

// RM0090: identifier 31:21 or 31:3, IDE 2, RTR 1; filter index 15:8, length 3:0; FMP 1:0, FULL 3, FOVR 4,
// RFOM 5.
TEST(Can, EachFifoHandsItsFramesOut) {
  const std::array<std::uint8_t, 8> bytes{0x81, 0x42, 0x23, 0x14, 0xF5, 0xE6, 0xD7, 0xC8};
  for (const unsigned fifo : {0U, 1U}) {
    for (const bool extended : {false, true}) {
      for (const bool remote : {false, true}) {
        Bench bench;
        std::uint32_t pending = 2 | 1U << 4;  // and one was lost
        bench.can.rfr[fifo].on_read = [&](std::uint32_t) { return pending; };
        bench.can.rfr[fifo].on_write = [&](std::uint32_t word) {
          pending &= ~(word & 0x18);
          if ((word & 0x20) != 0) --pending;
        };
        FakeReceiveMailbox& front = bench.can.fifo[fifo];
        front.rir.value = (extended ? 0x12345678U << 3 | 4U : 0x5A5U << 21) | (remote ? 2U : 0U);
        front.rdtr.value = 0xABCD'0907;
        front.rdlr.value = 0x1423'4281;
        front.rdhr.value = 0xC8D7'E6F5;
        unsigned frames = 0;
        bench.driver.ISR_receive(fifo, [&](const CanFrame& frame, std::uint8_t filter) {
          EXPECT_EQ(frame.identifier, extended ? 0x12345678U : 0x5A5U);
          EXPECT_EQ(frame.extended, extended);
          EXPECT_EQ(frame.remote, remote);
          EXPECT_EQ(frame.length, 7);
          EXPECT_EQ(frame.data, bytes);
          EXPECT_EQ(filter, 9);
          ++frames;
        });
        EXPECT_EQ(frames, 2U);
        EXPECT_EQ(pending, 0U);
        EXPECT_EQ(bench.driver.receive_counters().received, 2U);
        EXPECT_EQ(bench.driver.receive_counters().overruns, 1U);
        EXPECT_EQ(bench.can.rfr[1 - fifo].reads, 0U);
      }
    }
  }
}

TEST(Can, ErrorsByName) {
  Bench bench;
  bench.can.esr.value = 0x2A90'0033;
  const CanErrors errors = bench.driver.errors();
  EXPECT_EQ(errors.transmit, 0x90);
  EXPECT_EQ(errors.receive, 0x2A);
  EXPECT_EQ(errors.last, CanLastError::acknowledgement);
  EXPECT_TRUE(errors.warning && errors.passive);
  EXPECT_FALSE(errors.bus_off);
  EXPECT_EQ(bench.can.esr.value, 0x70U);
  bench.can.esr.value = 4;
  EXPECT_TRUE(bench.driver.ISR_serve_status());
  EXPECT_EQ(bench.can.msr.value, 4U) << "ERRI is written 1";
}

TEST(CanReceiveCounters, NothingHasBeenReceivedAtFirst) {
  const CanReceiveCounters defaults{};
  EXPECT_EQ(defaults.received, 0u);
  EXPECT_EQ(defaults.overruns, 0u);
}

TEST(CanTransmitCounters, NothingHasBeenSentAtFirst) {
  const CanTransmitCounters defaults{};
  EXPECT_EQ(defaults.sent, 0u);
  EXPECT_EQ(defaults.aborted, 0u);
  EXPECT_EQ(defaults.discarded, 0u);
  EXPECT_EQ(defaults.arbitration_lost, 0u);
}

}  // namespace kmax::drivers::stm32f4::can_test
