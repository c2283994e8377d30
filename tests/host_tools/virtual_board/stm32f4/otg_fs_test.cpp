// RM0090, chapter USB on-the-go full-speed (OTG_FS), as a program and a host see it.
#include "host_tools/virtual_board/stm32f4/otg_fs.hpp"

#include <gtest/gtest.h>

#include <numeric>

#include <rapidcheck/gtest.h>

#include "tests/host_tools/virtual_board/stm32f4/usb_bench.hpp"

namespace kmax::virtual_board::otg_fs_test {

using drivers::stm32f4::Interrupt;
using testing::UsbBench;
using namespace testing::usb_registers;

constexpr BoardTime ms = usb_time::frame;

std::vector<std::uint8_t> numbers(std::size_t count) {
  std::vector<std::uint8_t> bytes(count);
  std::iota(bytes.begin(), bytes.end(), std::uint8_t{1});
  return bytes;
}

TEST(OtgFs, ResetValues) {
  UsbBench bench;
  EXPECT_EQ(bench.read(gusbcfg), 0x0000'0A00U);
  EXPECT_EQ(bench.read(grstctl), 0x8000'0000U);
  EXPECT_EQ(bench.read(gintsts), 0x0400'0020U);
  EXPECT_EQ(bench.read(grxfsiz), 0x0000'0200U);
  EXPECT_EQ(bench.read(dcfg), 0x0220'0000U);
  EXPECT_EQ(bench.read(diepctl(0)), active);
  EXPECT_EQ(bench.read(doepctl(0)), active);
  EXPECT_EQ(bench.read(diepint(0)), 0x80U);
}

TEST(OtgFs, NothingHappensWithoutACable) {
  UsbBench bench;
  EXPECT_EQ(bench.core.next_event(), never);
  bench.run(1000 * ms);
  EXPECT_EQ(bench.events, 0U);
}

TEST(OtgFs, CoreResetEndsOnlyWithTheClock) {
  UsbBench bench;
  bench.write(gintmsk, 0x10);
  bench.write(grstctl, 1);
  EXPECT_EQ(bench.read(grstctl), 1U) << "AHBIDL is 0 and CSRST 1";
  EXPECT_THROW(bench.read(gintmsk), RefusedAccess);
  bench.run(OtgFsModel::core_reset_time);
  EXPECT_EQ(bench.read(grstctl), 0x8000'0000U);
  EXPECT_THROW(bench.read(gintmsk), RefusedAccess) << "three clocks of the PHY";
  bench.run(3 * OtgFsModel::phy_clock);
  EXPECT_EQ(bench.read(gintmsk), 0U);
  bench.clocked = false;
  bench.write(grstctl, 1);
  bench.run(1000 * ms);
  EXPECT_EQ(bench.read(grstctl), 1U);
}

TEST(OtgFs, AHostSeesTheDeviceOnlyWhenAllIsThere) {
  const auto seen = [](auto spoil) {
    UsbBench bench;
    bench.start();
    spoil(bench);
    bench.port.attach(bench.now);
    bench.serve_for(400 * ms);
    return bench.port.ready();
  };
  EXPECT_TRUE(seen([](UsbBench&) {}));
  EXPECT_FALSE(seen([](UsbBench& bench) { bench.clocked = false; })) << "48 MHz";
  EXPECT_FALSE(seen([](UsbBench& bench) { bench.pins = false; })) << "AF10";
  EXPECT_FALSE(seen([](UsbBench& bench) { bench.write(gccfg, 1U << 16); })) << "NOVBUSSENS";
  EXPECT_FALSE(seen([](UsbBench& bench) { bench.write(gccfg, 1U << 16 | 1U << 19); })) << "VBUSBSEN";
  EXPECT_FALSE(seen([](UsbBench& bench) { bench.write(gccfg, 1U << 21); })) << "PWRDWN";
  EXPECT_FALSE(seen([](UsbBench& bench) { bench.write(dctl, 2); })) << "SDIS";
  EXPECT_FALSE(seen([](UsbBench& bench) { bench.write(gusbcfg, 6U << 10); })) << "FDMOD";
}

TEST(OtgFs, IsEnumeratedAndConfigured) {
  UsbBench bench;
  bench.configure();
  EXPECT_EQ(bench.resets, 1U);
  EXPECT_EQ(bench.enumerations, 1U);
  const UsbTransferResult result = bench.control({0x80, 6, 0, 1, 0, 0, 64, 0}, 64);
  EXPECT_EQ(result.end, UsbTransferEnd::done);
  EXPECT_EQ(result.data, std::vector<std::uint8_t>(UsbBench::descriptor.begin(), UsbBench::descriptor.end()));
  EXPECT_EQ(bench.read(dsts) & 6U, 6U) << "full speed";
}

TEST(OtgFs, AnotherAddressIsNotMeant) {
  UsbBench bench;
  bench.configure();
  bench.used_address = UsbBench::address + 1;
  EXPECT_EQ(bench.control({0x80, 6, 0, 1, 0, 0, 18, 0}, 18).end, UsbTransferEnd::no_answer);
}

TEST(OtgFs, StallsOfEndpoint0EndWithTheNextSetup) {
  UsbBench bench;
  bench.configure();
  EXPECT_EQ(bench.control({0x80, 0, 0, 0, 0, 0, 2, 0}, 2).end, UsbTransferEnd::stalled);
  EXPECT_NE(bench.read(diepctl(0)) & stall, 0U);
  EXPECT_EQ(bench.control({0x80, 6, 0, 1, 0, 0, 18, 0}, 18).end, UsbTransferEnd::done);
  EXPECT_EQ(bench.read(diepctl(0)) & stall, 0U);
}

TEST(OtgFs, StallsOfBulkEndpointsAreTheProgramsToClear) {
  UsbBench bench;
  bench.configure();
  bench.write(diepctl(1), bench.read(diepctl(1)) | stall);
  EXPECT_EQ(bench.receive(64).end, UsbTransferEnd::stalled);
  EXPECT_EQ(bench.control({0x80, 6, 0, 1, 0, 0, 18, 0}, 18).end, UsbTransferEnd::done);
  EXPECT_EQ(bench.receive(64).end, UsbTransferEnd::stalled);
  bench.write(diepctl(1), bench.read(diepctl(1)) & ~stall);
  EXPECT_EQ(bench.send({1, 2, 3}).end, UsbTransferEnd::done);
  EXPECT_EQ(bench.receive(64).data, (std::vector<std::uint8_t>{1, 2, 3}));
}

TEST(OtgFs, SetupsBackToBackAreAllTaken) {
  UsbBench bench;
  bench.configure();
  // A host that sends nothing but SETUP, and a program that does not look.
  for (int i = 0; i < 5; ++i) {
    const std::uint64_t number = bench.port.submit({.kind = UsbTransferKind::control,
                                                    .address = UsbBench::address,
                                                    .setup = {0x80, 6, 0, 1, 0, 0, 18, 0},
                                                    .length = 18},
                                                   bench.now);
    bench.run(units_per_microsecond);
    EXPECT_TRUE(bench.port.cancel(number, bench.now)) << "when SETUP is on the wire";
    bench.run(100 * units_per_microsecond);
  }
  EXPECT_NE(bench.read(doepint(0)) & 1U << 6, 0U) << "B2BSTUP";
  EXPECT_EQ(bench.read(doepint(0)) & 8U, 0U) << "no token has ended the setup stage";
  EXPECT_EQ(bench.read(doeptsiz(0)) >> 29, 0U) << "STUPCNT";
  EXPECT_EQ(bench.control({0x80, 6, 0, 1, 0, 0, 18, 0}, 18).data.size(), 18U) << "and it goes on";
}

TEST(OtgFs, EchoesPacketsOfEverySize) {
  UsbBench bench;
  bench.configure();
  for (std::size_t size = 0; size <= 64; ++size) {
    const auto bytes = numbers(size);
    ASSERT_EQ(bench.send(bytes).end, UsbTransferEnd::done) << size;
    ASSERT_EQ(bench.receive(64).data, bytes) << size;
  }
}

TEST(OtgFs, NineteenFullPacketsFitIntoAFrame) {
  UsbBench bench;
  bench.configure();
  bench.port.submit({.address = UsbBench::address, .endpoint = 1, .in = true, .length = 1U << 20}, bench.now);
  constexpr std::uint32_t packets = 200;
  bench.write(dieptsiz(1), packets << 19 | packets * 64);
  bench.write(diepctl(1), bench.read(diepctl(1)) | enable | clear_nak);
  std::uint32_t words = packets * 16;
  const std::uint64_t before = bench.port.transactions();
  const unsigned first = bench.port.frame();
  while (bench.port.frame() < first + 10) {
    for (; words > 0 && bench.read(dtxfsts(1)) > 0; --words) bench.write(fifo(1), words);
    bench.run(20 * units_per_microsecond);
  }
  EXPECT_GE(bench.port.transactions() - before, 9U * 19U);
  EXPECT_LE(bench.port.transactions() - before, 10U * 19U);
}

TEST(OtgFs, SuspendsAfterThreeQuietMillisecondsAndWakes) {
  UsbBench bench;
  bench.configure();
  EXPECT_EQ(bench.suspends, 1U) << "before it was reset nothing was on the bus";
  bench.port.suspend(bench.now);
  bench.serve_for(2 * ms);
  EXPECT_EQ(bench.suspends, 1U);
  bench.serve_for(2 * ms);
  EXPECT_EQ(bench.suspends, 2U);
  EXPECT_EQ(bench.read(dsts) & 1U, 1U);
  bench.serve_for(100 * ms);
  EXPECT_EQ(bench.suspends, 2U) << "once";
  const unsigned wake_ups = bench.wake_ups;
  bench.port.resume(bench.now);
  bench.serve_for(25 * ms);
  EXPECT_EQ(bench.wake_ups, wake_ups + 1);
  EXPECT_EQ(bench.read(dsts) & 1U, 0U);
  EXPECT_EQ(bench.send({9}).end, UsbTransferEnd::done);
  EXPECT_EQ(bench.receive(8).data, std::vector<std::uint8_t>{9});
}

TEST(OtgFs, FramesAreCountedAndCanInterrupt) {
  UsbBench bench;
  bench.configure();
  bench.write(gintmsk, 8);
  const unsigned before = bench.port.frame();
  const unsigned rises = bench.interrupts.rises(Interrupt::otg_fs);
  for (int i = 0; i < 50; ++i) {
    bench.write(gintsts, 8);
    bench.run(ms);
  }
  EXPECT_EQ(bench.read(dsts) >> 8 & 0x7FFU, bench.port.frame());
  EXPECT_EQ(bench.port.frame() - before, 50U);
  EXPECT_EQ(bench.interrupts.rises(Interrupt::otg_fs) - rises, 50U);
}

TEST(OtgFs, SoftDisconnectEndsTransfersAndIsWaitedFor) {
  UsbBench bench;
  bench.configure();
  UsbTransferEnd end = UsbTransferEnd::done;
  bench.port.submit({.address = UsbBench::address,
                     .endpoint = 1,
                     .in = true,
                     .length = 64,
                     .on_end = [&](const UsbTransferResult& result, BoardTime) { end = result.end; }},
                    bench.now);
  bench.write(dctl, 2);
  bench.run(2 * ms);
  EXPECT_NE(end, UsbTransferEnd::done);
  EXPECT_FALSE(bench.port.ready());
  bench.write(dctl, 0);
  bench.run_until_ready();
  EXPECT_EQ(bench.control({0x80, 6, 0, 1, 0, 0, 18, 0}, 18).data.size(), 18U) << "at address 0 again";
}

TEST(OtgFs, AbandonedTransfersAreDisabledInTheManualsOrder) {
  UsbBench bench;
  bench.configure();
  bench.queue_in(1, numbers(100));
  EXPECT_THROW(bench.write(diepctl(1), bench.read(diepctl(1)) | disable), RefusedAccess) << "no NAK yet";
  EXPECT_THROW(bench.write(grstctl, 1U << 5 | 1U << 6), RefusedAccess) << "may be on the wire";
  bench.write(diepctl(1), (bench.read(diepctl(1)) & ~enable) | set_nak);
  EXPECT_EQ(bench.read(diepint(1)) & 0x40U, 0U) << "takes its time";
  bench.run(OtgFsModel::effect_time);
  EXPECT_NE(bench.read(diepint(1)) & 0x40U, 0U);
  bench.write(diepctl(1), (bench.read(diepctl(1)) & ~enable) | disable);
  bench.run(OtgFsModel::effect_time);
  EXPECT_NE(bench.read(diepint(1)) & 2U, 0U) << "EPDISD";
  EXPECT_EQ(bench.read(diepctl(1)) & enable, 0U);
  bench.write(dieptsiz(1), 1U << 19 | 4);
  EXPECT_THROW(bench.write(diepctl(1), bench.read(diepctl(1)) | enable), RefusedAccess) << "old words";
  bench.write(grstctl, 1U << 5 | 1U << 6);
  EXPECT_NE(bench.read(grstctl) & 1U << 5, 0U);
  bench.run(OtgFsModel::effect_time);
  EXPECT_EQ(bench.read(grstctl) & 1U << 5, 0U);
  EXPECT_EQ(bench.read(dtxfsts(1)), 64U);
  bench.queue_in(1, numbers(4));
  EXPECT_EQ(bench.receive(64).data, numbers(4));
}

TEST(OtgFs, OutEndpointsAreDisabledBehindTheGlobalNak) {
  UsbBench bench;
  bench.configure();
  const std::uint32_t control = bench.read(doepctl(1)) & ~enable;
  EXPECT_THROW(bench.write(doepctl(1), control | disable), RefusedAccess);
  EXPECT_THROW(bench.write(doepctl(0), disable), RefusedAccess) << "never endpoint 0";
  bench.write(dctl, 1U << 9);
  bench.run(OtgFsModel::effect_time);
  EXPECT_EQ(bench.read(gintsts) & 0x80U, 0U) << "not before it is taken from the FIFO";
  EXPECT_EQ(bench.read(grxstsp) >> 17 & 15U, 1U);
  EXPECT_NE(bench.read(gintsts) & 0x80U, 0U);
  bench.write(doepctl(1), control | disable | set_nak);
  bench.run(OtgFsModel::effect_time);
  EXPECT_NE(bench.read(doepint(1)) & 2U, 0U);
  EXPECT_EQ(bench.read(doepctl(1)) & enable, 0U);
  bench.write(dctl, 1U << 10);
  EXPECT_EQ(bench.read(gintsts) & 0x80U, 0U);
}

TEST(OtgFs, BusResetInAnyStateLeadsBackToAWorkingDevice) {
  for (BoardTime delay = 0; delay < 400; delay += 13) {
    UsbBench bench;
    bench.configure();
    bench.port.submit({.address = UsbBench::address, .endpoint = 1, .data = numbers(60)}, bench.now);
    bench.port.submit({.kind = UsbTransferKind::control,
                       .address = UsbBench::address,
                       .setup = {0x80, 6, 0, 1, 0, 0, 18, 0},
                       .length = 18},
                      bench.now);
    bench.serve_for(delay * units_per_microsecond);
    // The program's own part of a reset: what is enabled is disabled.
    if ((bench.read(diepctl(0)) & enable) != 0) continue;
    bench.port.reset(bench.now);
    bench.serve_for(40 * ms);
    ASSERT_TRUE(bench.port.ready());
    ASSERT_EQ(bench.read(doepctl(1)) & active, 0U) << "a bus reset clears USBAEP";
    ASSERT_EQ(bench.control({0x80, 6, 0, 1, 0, 0, 18, 0}, 18).data.size(), 18U) << delay;
  }
}

TEST(OtgFs, PullingTheCableEndsTransfers) {
  UsbBench bench;
  bench.configure();
  UsbTransferEnd end = UsbTransferEnd::done;
  bench.port.submit({.address = UsbBench::address,
                     .endpoint = 1,
                     .in = true,
                     .length = 64,
                     .on_end = [&](const UsbTransferResult& result, BoardTime) { end = result.end; }},
                    bench.now);
  bench.serve_for(ms);
  bench.port.detach(bench.now);
  EXPECT_EQ(end, UsbTransferEnd::unplugged);
  EXPECT_EQ(bench.port.outstanding(), 0U);
  bench.serve_for(10 * ms);
  const unsigned suspends = bench.suspends;
  bench.serve_for(100 * ms);
  EXPECT_EQ(bench.suspends, suspends) << "idle, and said once";
  bench.port.attach(bench.now);
  bench.run_until_ready();
}

TEST(OtgFs, WrongSequencesAreRefused) {
  UsbBench bench;
  bench.start();
  EXPECT_THROW(bench.write(pcgcctl, 1), RefusedAccess);
  EXPECT_THROW(bench.write(gusbcfg, 1U << 29), RefusedAccess) << "host mode";
  EXPECT_THROW(bench.write(gusbcfg, 1U << 30 | 5U << 10), RefusedAccess) << "TRDT";
  EXPECT_THROW(bench.write(dcfg, 0), RefusedAccess) << "not full speed";
  EXPECT_THROW(bench.write(dctl, 1), RefusedAccess) << "remote wake-up";
  EXPECT_THROW(bench.write(grxfsiz, 15), RefusedAccess);
  EXPECT_THROW(bench.write(grxfsiz, 257), RefusedAccess);
  EXPECT_THROW(bench.write(dieptxf1, 64U << 16 | 257), RefusedAccess) << "beyond the 320 words";
  EXPECT_THROW(bench.read(grxstsp), RefusedAccess);
  EXPECT_THROW(bench.read(grxstsr), RefusedAccess);
  EXPECT_THROW(bench.read(fifo(0)), RefusedAccess);
  EXPECT_THROW(bench.write(fifo(0), 0), RefusedAccess) << "not enabled";
  EXPECT_THROW(bench.write(diepctl(0), enable), RefusedAccess) << "PKTCNT is 0";
  EXPECT_THROW(bench.write(diepctl(0), set_nak | clear_nak), RefusedAccess);
  EXPECT_THROW(bench.write(diepctl(0), data0), RefusedAccess);
  EXPECT_THROW(bench.write(diepctl(1), enable | bulk | 64U), RefusedAccess) << "no USBAEP";
  EXPECT_THROW(bench.write(diepctl(1), active | 1U << 18 | 1U << 22 | 64U), RefusedAccess) << "isochronous";
  EXPECT_THROW(bench.write(diepctl(1), active | bulk | 2U << 22 | 64U), RefusedAccess) << "TXFNUM";
  EXPECT_THROW(bench.write(dieptsiz(0), 128), RefusedAccess);
  EXPECT_THROW(bench.write(doeptsiz(1), 3U << 29), RefusedAccess) << "STUPCNT";
  EXPECT_THROW(bench.write(doepctl(0), enable), RefusedAccess) << "no packets";
  bench.write(dieptsiz(0), 1U << 19 | 8);
  bench.write(diepctl(0), enable | clear_nak);
  EXPECT_THROW(bench.write(dieptsiz(0), 0), RefusedAccess) << "enabled";
  bench.write(fifo(0), 1);
  bench.write(fifo(0), 2);
  EXPECT_THROW(bench.write(fifo(0), 3), RefusedAccess) << "beyond XFRSIZ";
  EXPECT_THROW(bench.write(dieptxf0, 16U << 16 | 96), RefusedAccess) << "while enabled";
  EXPECT_THROW(bench.read(gccfg + 4 * 100), RefusedAccess) << "nothing there";
  EXPECT_THROW(bench.read(gintsts, 2), RefusedAccess);
}

TEST(OtgFs, OverlappingFifosAreRefusedAtTheFirstUse) {
  UsbBench bench;
  bench.start();
  bench.write(dieptxf0, 16U << 16 | 95);
  bench.write(dieptsiz(0), 1U << 19);
  EXPECT_THROW(bench.write(diepctl(0), enable), RefusedAccess) << "inside the receive FIFO";
  bench.write(dieptxf0, 17U << 16 | 96);
  bench.write(diepctl(0), enable);
  bench.write(diepctl(1), active | bulk | 1U << 22 | 64U);
  bench.write(dieptsiz(1), 1U << 19);
  EXPECT_THROW(bench.write(diepctl(1), bench.read(diepctl(1)) | enable), RefusedAccess) << "0 and 1 overlap";
}

TEST(OtgFs, ACoreResetLeavesOnlyTheSpeed) {
  UsbBench bench;
  bench.configure();
  bench.write(grstctl, 1);
  bench.run(2 * OtgFsModel::core_reset_time);
  EXPECT_EQ(bench.read(dcfg), 0x0220'0003U);
  EXPECT_EQ(bench.read(gccfg), 0U);
  EXPECT_EQ(bench.read(gusbcfg), 0x0000'0A00U);
  bench.serve_for(2 * ms);
  EXPECT_FALSE(bench.port.ready());
  bench.core.reset(bench.now);
  EXPECT_EQ(bench.read(dcfg), 0x0220'0000U);
}

// Whatever the host asks and whenever it changes its mind: what was acknowledged comes back, in order, once.
RC_GTEST_PROP(OtgFsModel, ManyTransfersLoseAndRepeatNothing, (std::uint64_t seed)) {
  UsbBench bench;
  bench.configure();
  RC_ASSERT(bench.port.ready());
  std::uint64_t state = seed | 1;
  const auto random = [&](std::uint64_t below) {
    state = state * 6364136223846793005U + 1442695040888963407U;
    return (state >> 33) % below;
  };
  for (int i = 0; i < 30; ++i) {
    switch (random(5)) {
      case 0:
        RC_ASSERT(
            bench.control({0x80, 6, 0, 1, 0, 0, static_cast<std::uint8_t>(1 + random(64)), 0}, 64).end ==
            UsbTransferEnd::done);
        break;
      case 1:
        RC_ASSERT(bench.control({0x81, 77, 0, 0, 0, 0, 4, 0}, 4).end == UsbTransferEnd::stalled);
        break;
      case 2: {
        // Nothing to be had: asked for, and given up.
        const std::uint64_t number = bench.port.submit(
            {.address = UsbBench::address, .endpoint = 1, .in = true, .length = 64}, bench.now);
        bench.serve_for(random(1500) * units_per_microsecond);
        RC_ASSERT(bench.port.cancel(number, bench.now));
        break;
      }
      default: {
        std::vector<std::uint8_t> bytes(random(64));
        for (auto& byte : bytes) byte = static_cast<std::uint8_t>(random(256));
        RC_ASSERT(bench.send(bytes).end == UsbTransferEnd::done);
        bench.serve_for(random(300) * units_per_microsecond);
        RC_ASSERT(bench.receive(64).data == bytes);
      }
    }
  }
}

}  // namespace kmax::virtual_board::otg_fs_test
