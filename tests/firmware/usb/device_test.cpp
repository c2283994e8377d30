#include "firmware/usb/device.hpp"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <string>
#include <vector>

#include "tests/firmware/usb/fake_host.hpp"

namespace kmax::firmware::usb::device_test {
namespace {

enum class State { unaddressed, addressed, configured, halted };

struct Bench : DeviceAtHost<> {
  Bench() : DeviceAtHost<>(fake_link) { host.reset(); }
  void be(State state) {
    host.reset();
    if (state == State::unaddressed) return;
    ASSERT_TRUE(host.write({0x00, 5, 17, 0, 0}));
    if (state == State::addressed) return;
    ASSERT_TRUE(host.write({0x00, 9, 1, 0, 0}));
    if (state == State::halted) {
      ASSERT_TRUE(host.write({0x02, 3, 0, 0x82, 0}));
    }
  }
  FakeLink fake_link;
};

/// One request in one state, and what USB 2.0 says of it.
struct Verdict {
  const char* clause;
  State state;
  SetupPacket setup;
  Reply expected;  ///< nothing: STALL
};

const std::vector<Verdict> chapter_9 = {
    {"9.4.5 device: has a supply of its own, no remote wake-up",
     State::addressed,
     {0x80, 0, 0, 0, 2},
     Bytes{1, 0}},
    {"9.4.5 default state too, for the bus' sake", State::unaddressed, {0x80, 0, 0, 0, 2}, Bytes{1, 0}},
    {"9.4.5 wValue is zero", State::addressed, {0x80, 0, 1, 0, 2}, {}},
    {"9.4.5 interface: nothing", State::configured, {0x81, 0, 0, 2, 2}, Bytes{0, 0}},
    {"9.4.5 interface that is not there", State::configured, {0x81, 0, 0, 3, 2}, {}},
    {"9.4.5 address state: an interface is a request error", State::addressed, {0x81, 0, 0, 0, 2}, {}},
    {"9.4.5 endpoint 0 is there in any state", State::addressed, {0x82, 0, 0, 0, 2}, Bytes{0, 0}},
    {"9.4.5 endpoint 0, IN side", State::addressed, {0x82, 0, 0, 0x80, 2}, Bytes{0, 0}},
    {"9.4.5 address state: another endpoint is a request error", State::addressed, {0x82, 0, 0, 0x81, 2}, {}},
    {"9.4.5 endpoint", State::configured, {0x82, 0, 0, 0x81, 2}, Bytes{0, 0}},
    {"9.4.5 halted endpoint", State::halted, {0x82, 0, 0, 0x82, 2}, Bytes{1, 0}},
    {"9.4.5 its neighbour is not", State::halted, {0x82, 0, 0, 0x03, 2}, Bytes{0, 0}},
    {"9.4.5 endpoint that is not there", State::configured, {0x82, 0, 0, 0x01, 2}, {}},
    {"9.4.5 recipient other", State::configured, {0x83, 0, 0, 0, 2}, {}},
    {"9.4.5 no more than was asked for", State::configured, {0x80, 0, 0, 0, 1}, Bytes{1}},
    {"9.4.1 no remote wake-up to clear", State::configured, {0x00, 1, 1, 0, 0}, {}},
    {"9.4.9 no remote wake-up to set", State::configured, {0x00, 3, 1, 0, 0}, {}},
    {"9.4.9 no test mode at full speed", State::configured, {0x00, 3, 2, 0x0100, 0}, {}},
    {"9.4.9 halt", State::configured, {0x02, 3, 0, 0x81, 0}, Bytes{}},
    {"9.4.1 clear halt", State::halted, {0x02, 1, 0, 0x82, 0}, Bytes{}},
    {"9.4.1 of what is not halted too", State::configured, {0x02, 1, 0, 0x03, 0}, Bytes{}},
    {"9.4.9 halt of endpoint 0 is not recommended", State::configured, {0x02, 3, 0, 0, 0}, {}},
    {"9.4.9 address state: endpoint other than 0", State::addressed, {0x02, 3, 0, 0x81, 0}, {}},
    {"9.4.9 endpoint that is not there", State::configured, {0x02, 3, 0, 0x84, 0}, {}},
    {"9.4.9 a feature that is none", State::configured, {0x02, 3, 9, 0x81, 0}, {}},
    {"9.4.9 interfaces have no features", State::configured, {0x01, 3, 0, 0, 0}, {}},
    {"9.4.6 address", State::unaddressed, {0x00, 5, 127, 0, 0}, Bytes{}},
    {"9.4.6 address state: another one", State::addressed, {0x00, 5, 3, 0, 0}, Bytes{}},
    {"9.4.6 address state: back to default", State::addressed, {0x00, 5, 0, 0, 0}, Bytes{}},
    {"9.4.6 above 127", State::unaddressed, {0x00, 5, 128, 0, 0}, {}},
    {"9.4.6 wIndex is zero", State::unaddressed, {0x00, 5, 3, 1, 0}, {}},
    {"9.4.6 wLength is zero", State::unaddressed, {0x00, 5, 3, 0, 1}, {}},
    {"9.4.6 configured state: not specified, refused", State::configured, {0x00, 5, 3, 0, 0}, {}},
    {"9.4.3 no qualifier at full speed alone", State::configured, {0x80, 6, 0x0600, 0, 10}, {}},
    {"9.4.3 no other speed", State::configured, {0x80, 6, 0x0700, 0, 9}, {}},
    {"9.4.3 no second configuration", State::configured, {0x80, 6, 0x0201, 0, 9}, {}},
    {"9.4.3 an interface's descriptor comes with its configuration",
     State::configured,
     {0x80, 6, 0x0400, 0, 9},
     {}},
    {"9.4.3 recipient is the device", State::configured, {0x81, 6, 0x0100, 0, 18}, {}},
    {"9.6.7 languages", State::addressed, {0x80, 6, 0x0300, 0, 255}, Bytes{4, 3, 0x09, 0x04}},
    {"9.6.7 text",
     State::addressed,
     {0x80, 6, 0x0301, 0x0409, 255},
     Bytes{10, 3, 'K', 0, 'm', 0, 'a', 0, 'x', 0}},
    {"9.6.7 serial number",
     State::addressed,
     {0x80, 6, 0x0303, 0x0409, 255},
     Bytes{18, 3, '1', 0, '2', 0, '3', 0, '4', 0, 'A', 0, 'B', 0, 'C', 0, 'D', 0}},
    {"9.6.7 its first bytes", State::addressed, {0x80, 6, 0x0303, 0x0409, 2}, Bytes{18, 3}},
    {"9.6.7 no such text", State::addressed, {0x80, 6, 0x0306, 0x0409, 255}, {}},
    {"9.6.7 no such language", State::addressed, {0x80, 6, 0x0301, 0x0407, 255}, {}},
    {"9.4.8 descriptors are as they are", State::configured, {0x00, 7, 0x0100, 0, 18}, {}},
    {"9.4.2 address state: 0", State::addressed, {0x80, 8, 0, 0, 1}, Bytes{0}},
    {"9.4.2 configured", State::configured, {0x80, 8, 0, 0, 1}, Bytes{1}},
    {"9.4.7 configuration 1", State::addressed, {0x00, 9, 1, 0, 0}, Bytes{}},
    {"9.4.7 configuration 0", State::configured, {0x00, 9, 0, 0, 0}, Bytes{}},
    {"9.4.7 again", State::configured, {0x00, 9, 1, 0, 0}, Bytes{}},
    {"9.4.7 no such configuration", State::addressed, {0x00, 9, 2, 0, 0}, {}},
    {"9.4.7 default state: not specified, refused", State::unaddressed, {0x00, 9, 1, 0, 0}, {}},
    {"9.4.4 alternate setting", State::configured, {0x81, 10, 0, 1, 1}, Bytes{0}},
    {"9.4.4 address state", State::addressed, {0x81, 10, 0, 1, 1}, {}},
    {"9.4.4 no such interface", State::configured, {0x81, 10, 0, 3, 1}, {}},
    {"9.4.10 the only setting", State::configured, {0x01, 11, 0, 2, 0}, Bytes{}},
    {"9.4.10 no other setting", State::configured, {0x01, 11, 1, 2, 0}, {}},
    {"9.4.10 address state", State::addressed, {0x01, 11, 0, 2, 0}, {}},
    {"9.4.11 no isochronous endpoint", State::configured, {0x82, 12, 0, 0x81, 2}, {}},
    {"9.4 reserved request", State::configured, {0x00, 2, 0, 0, 0}, {}},
    {"9.4 request that is none", State::configured, {0x80, 200, 0, 0, 8}, {}},
    {"9.3.1 reserved kind", State::configured, {0xE0, 0, 0, 0, 2}, {}},
    {"9.3.1 reserved recipient", State::configured, {0x84, 0, 0, 0, 2}, {}},
    {"9.3.5 without a data stage the direction means nothing",
     State::configured,
     {0x80, 6, 0x0100, 0, 0},
     Bytes{}},
    {"PSTN 6.3.11 line coding as it starts",
     State::configured,
     {0xA1, 0x21, 0, 1, 7},
     Bytes{0, 0xC2, 1, 0, 0, 2, 8}},
    {"PSTN 6.3.12 control lines", State::configured, {0x21, 0x22, 3, 1, 0}, Bytes{}},
    {"PSTN 6.3.13 break, ignored", State::configured, {0x21, 0x23, 0xFFFF, 1, 0}, Bytes{}},
    {"PSTN 6.3.10 another length of it", State::configured, {0x21, 0x20, 0, 1, 6}, {}},
    {"PSTN 6.3 of the data interface", State::configured, {0xA1, 0x21, 0, 2, 7}, {}},
    {"PSTN 6.3 address state", State::addressed, {0xA1, 0x21, 0, 1, 7}, {}},
    {"PSTN 6.2.1 no encapsulated commands", State::configured, {0xA1, 0x01, 0, 1, 8}, {}},
    {"gs_usb two channels",
     State::configured,
     {0xC1, 5, 1, 0, 12},
     Bytes{0, 0, 0, 1, 2, 0, 0, 0, 1, 0, 0, 0}},
    {"gs_usb address state", State::addressed, {0xC1, 5, 1, 0, 12}, {}},
    {"gs_usb no time stamps", State::configured, {0xC1, 6, 0, 0, 4}, {}},
    {"gs_usb no identification", State::configured, {0x41, 7, 0, 0, 4}, {}},
    {"gs_usb no third channel", State::configured, {0xC1, 4, 2, 0, 40}, {}},
    {"gs_usb a mode has eight bytes", State::configured, {0x41, 2, 0, 0, 4}, {}},
    {"vendor request that is none", State::configured, {0x40, 1, 0, 0, 0}, {}},
};

TEST(UsbDevice, AnswersEachRequestOfChapter9AsItsClauseSays) {
  for (const Verdict& row : chapter_9) {
    SCOPED_TRACE(row.clause);
    Bench bench;
    bench.be(row.state);
    const Reply reply = row.setup.to_host() && row.setup.length != 0           ? bench.host.read(row.setup)
                        : bench.host.write(row.setup, Bytes(row.setup.length)) ? Reply(Bytes{})
                                                                               : Reply{};
    EXPECT_EQ(reply, row.expected);
    EXPECT_EQ(bench.wire.broken_promises, 0);
    // A refusal ends with the next set-up packet (8.5.3.4).
    EXPECT_TRUE(bench.host.read({0x80, 0, 0, 0, 2}));
  }
}

TEST(UsbDevice, ItsDescriptorSaysWhoItIs) {
  Bench bench;
  const Reply descriptor = bench.host.read({0x80, 6, 0x0100, 0, 64});
  const Bytes expected{18, 1, 0, 2, 0xEF, 2, 1, 64, 0x09, 0x12, 0x23, 0x23, 2, 1, 1, 2, 3, 1};
  EXPECT_EQ(descriptor, expected);
  EXPECT_EQ(bench.host.read({0x80, 6, 0x0100, 0, 8}), Bytes(expected.begin(), expected.begin() + 8));
}

TEST(UsbDevice, ItsConfigurationIsAListOfWholeDescriptorsOfTheEndpointsThatItOpens) {
  Bench bench;
  bench.be(State::configured);
  const Reply read = bench.host.read({0x80, 6, 0x0200, 0, 9});
  ASSERT_TRUE(read);
  const auto total = static_cast<std::uint16_t>((*read)[2] | (*read)[3] << 8);
  const Reply all = bench.host.read({0x80, 6, 0x0200, 0, total});
  ASSERT_TRUE(all);
  ASSERT_EQ(all->size(), total);
  EXPECT_EQ(bench.host.read({0x80, 6, 0x0200, 0, 255}), all) << "with a short packet behind it";
  std::vector<std::uint8_t> addresses, interfaces;
  std::size_t left = 0;
  for (std::size_t at = 0; at < total; at += (*all)[at]) {
    ASSERT_GE((*all)[at], 2);
    ASSERT_LE(at + (*all)[at], total);
    if ((*all)[at + 1] == 4) {
      EXPECT_EQ(left, 0U) << "an interface without all of its endpoints";
      interfaces.push_back((*all)[at + 2]);
      left = (*all)[at + 4];
    }
    if ((*all)[at + 1] == 5) {
      --left;
      addresses.push_back((*all)[at + 2]);
      EXPECT_TRUE(bench.wire.side((*all)[at + 2]).open);
      EXPECT_EQ(bench.wire.side((*all)[at + 2]).size, (*all)[at + 4]);
    }
  }
  EXPECT_EQ(interfaces, (Bytes{0, 1, 2}));
  EXPECT_EQ(addresses, (Bytes{0x81, 0x02, 0x83, 0x82, 0x03}));
}

TEST(UsbDevice, AnAddressThatIsGivenUpBeforeItsStatusStageIsNone) {
  Bench bench;
  ASSERT_TRUE(bench.host.write({0x00, 5, 3, 0, 0}));
  bench.host.set_up({0x00, 5, 17, 0, 0});
  EXPECT_EQ(bench.wire.next_address, 17);
  EXPECT_EQ(bench.device.ISR_address(), 3);
  EXPECT_TRUE(bench.host.read({0x80, 6, 0x0100, 0, 18}));
  EXPECT_EQ(bench.wire.next_address, 3) << "the controller has the old one again";
  EXPECT_EQ(bench.device.ISR_address(), 3);
}

TEST(UsbDevice, CountsResetsSilencesAndWhatItRefuses) {
  Bench bench;
  const auto before = bench.device.counters();
  bench.host.reset();
  bench.device.ISR_suspend();
  bench.device.ISR_resume();
  EXPECT_FALSE(bench.host.write({0x00, 9, 2, 0, 0}));
  EXPECT_FALSE(bench.host.read({0x80, 6, 0x0600, 0, 10}));
  const auto after = bench.device.counters();
  EXPECT_EQ(after.resets, before.resets + 1);
  EXPECT_EQ(after.suspensions, before.suspensions + 1);
  EXPECT_EQ(after.refused_requests, before.refused_requests + 2);
}

TEST(UsbDevice, AReplyThatFillsItsLastPacketEndsWithAnEmptyOneOnlyIfMoreWasAskedFor) {
  Bench bench;
  constexpr std::size_t size = configuration_descriptor.size();
  for (const std::uint16_t asked : {std::uint16_t{64}, std::uint16_t{size}, std::uint16_t{size + 1}}) {
    const Reply reply = bench.host.read({0x80, 6, 0x0200, 0, asked});
    ASSERT_TRUE(reply) << asked;
    EXPECT_EQ(reply->size(), std::min<std::size_t>(asked, size));
  }
}

TEST(UsbDevice, KeepsTheLineCodingThatItIsGiven) {
  Bench bench;
  bench.be(State::configured);
  const Bytes coding{0x80, 0x25, 0, 0, 1, 1, 7};
  EXPECT_TRUE(bench.host.write({0x21, 0x20, 0, 1, 7}, coding));
  EXPECT_EQ(bench.host.read({0xA1, 0x21, 0, 1, 7}), coding);
  EXPECT_FALSE(bench.host.write({0x21, 0x20, 0, 1, 7}, Bytes{1, 2, 3})) << "fewer bytes than announced";
  EXPECT_EQ(bench.host.read({0xA1, 0x21, 0, 1, 7}), coding);
}

TEST(UsbDevice, AClearedHaltAndAChosenSettingBeginWithData0) {
  for (const SetupPacket& request :
       {SetupPacket{0x02, 1, 0, 0x03, 0}, SetupPacket{0x01, 11, 0, 2, 0}, SetupPacket{0x00, 9, 1, 0, 0}}) {
    Bench bench;
    bench.be(State::configured);
    EXPECT_TRUE(bench.host.put(3, Bytes(3)));
    EXPECT_TRUE(bench.wire.side(0x03).second_data);
    EXPECT_TRUE(bench.host.write(request));
    EXPECT_FALSE(bench.wire.side(0x03).second_data);
    EXPECT_TRUE(bench.host.put(3, Bytes(3))) << "it must receive again";
  }
}

TEST(UsbDevice, AHaltedEndpointRefusesUntilTheHaltIsCleared) {
  Bench bench;
  bench.be(State::configured);
  EXPECT_TRUE(bench.host.write({0x02, 3, 0, 0x03, 0}));
  EXPECT_FALSE(bench.host.put(3, Bytes(3)));
  EXPECT_TRUE(bench.host.write({0x02, 1, 0, 0x03, 0}));
  EXPECT_TRUE(bench.host.put(3, Bytes(3)));
}

TEST(UsbDevice, OffersTheBootLoaderOnlyWhileNoAxisMakesForce) {
  Bench bench;
  bench.be(State::addressed);
  const SetupPacket request{0x40, request_boot_loader, boot_loader_value, 0, 0};
  EXPECT_FALSE(bench.host.write(request)) << "nobody has said yet that it may";
  bench.functions.allow_restart(true);
  EXPECT_FALSE(bench.host.write({0x40, request_boot_loader, 0, 0, 0}));
  EXPECT_FALSE(bench.functions.boot_loader_wanted());
  bench.host.set_up(request);
  EXPECT_FALSE(bench.functions.boot_loader_wanted()) << "the host does not know yet that it was heard";
  EXPECT_TRUE(bench.host.write(request));
  EXPECT_TRUE(bench.functions.boot_loader_wanted());
  EXPECT_FALSE(bench.functions.boot_loader_wanted());
  bench.functions.allow_restart(false);
  EXPECT_FALSE(bench.host.write(request));
}

/// After whatever has happened, a reset and an enumeration, the device works as new.
void expect_works(Bench& bench) {
  bench.fake_link.has_room = true;
  bench.host.enumerate();
  EXPECT_EQ(bench.host.read({0x80, 8, 0, 0, 1}), Bytes{1});
  bench.fake_link.packets.clear();
  EXPECT_TRUE(bench.host.put(3, Bytes{1, 2}));
  EXPECT_EQ(bench.fake_link.packets, std::vector<Bytes>{(Bytes{1, 2})});
  static_cast<void>(bench.functions.serial().reply_sent());
  const Bytes reply{5, 6, 7};
  bench.functions.serial().send(reply);
  bench.functions.ISR_serve();
  EXPECT_EQ(bench.host.take(2), reply);
  EXPECT_TRUE(bench.functions.serial().reply_sent());
}

TEST(UsbDevice, AResetInAnyStateBeginsAnew) {
  const std::vector<void (*)(Bench&)> states = {
      [](Bench&) {},
      [](Bench& bench) { bench.be(State::addressed); },
      [](Bench& bench) { bench.be(State::halted); },
      [](Bench& bench) {
        bench.host.set_up({0x80, 6, 0x0200, 0, 255});
      },
      [](Bench& bench) {
        bench.host.set_up({0x00, 5, 9, 0, 0});
      },
      [](Bench& bench) {
        bench.be(State::configured);
        bench.host.set_up({0x21, 0x20, 0, 1, 7});
      },
      [](Bench& bench) {
        bench.be(State::configured);
        bench.fake_link.has_room = false;
        bench.host.put(3, Bytes(64));
      },
      [](Bench& bench) {
        bench.be(State::configured);
        static const Bytes reply(200);
        bench.functions.serial().send(reply);
        bench.functions.ISR_serve();
        bench.host.take(2);
      },
      [](Bench& bench) {
        bench.be(State::configured);
        static const Bytes reply(200);
        bench.functions.serial().send(reply);  // and the interrupt has not looked yet
      },
  };
  for (const auto& get_there : states) {
    Bench bench;
    get_there(bench);
    expect_works(bench);
    EXPECT_EQ(bench.wire.broken_promises, 0);
  }
}

SetupPacket some_setup() {
  const auto word = [] {
    return *rc::gen::oneOf(
        rc::gen::inRange<std::uint16_t>(0, 4),
        rc::gen::element<std::uint16_t>(0x0100, 0x0200, 0x0300, 0x0303, 0x0409, 0x81, 0x82, 0x83, 0x4446),
        rc::gen::arbitrary<std::uint16_t>());
  };
  return {
      *rc::gen::oneOf(rc::gen::element<std::uint8_t>(0, 1, 2, 0x80, 0x81, 0x82, 0x21, 0xA1, 0x41, 0xC1, 0x40),
                      rc::gen::arbitrary<std::uint8_t>()),
      *rc::gen::oneOf(rc::gen::inRange<std::uint8_t>(0, 13), rc::gen::inRange<std::uint8_t>(0x20, 0x24),
                      rc::gen::arbitrary<std::uint8_t>()),
      word(), word(),
      *rc::gen::oneOf(rc::gen::inRange<std::uint16_t>(0, 80), rc::gen::arbitrary<std::uint16_t>())};
}

// 100 runs of 100 set-up packets.
RC_GTEST_PROP(UsbDevice, NoSetUpPacketMakesItBreakAPromiseOrStopAnswering, ()) {
  Bench bench;
  if (*rc::gen::arbitrary<bool>()) bench.host.enumerate();
  for (int i = 0; i < 100; ++i) {
    const SetupPacket setup = some_setup();
    bench.host.set_up(setup);
    if (*rc::gen::arbitrary<bool>()) continue;  // the host gives up
    for (int packet = 0; packet < 6 && !bench.wire.control_stalled; ++packet) {
      auto& to_host = bench.wire.side(direction_in).packet;
      if (to_host) {
        RC_ASSERT(to_host->size() <= full_packet);
        to_host.reset();
        bench.device.ISR_sent(0);
      } else if (bench.wire.side(0).receiving) {
        bench.wire.side(0).receiving = false;
        bench.device.ISR_received(0, Bytes(*rc::gen::inRange<std::size_t>(0, full_packet + 1)));
      }
    }
    RC_ASSERT(bench.wire.broken_promises == 0);
  }
  expect_works(bench);
}

}  // namespace
}  // namespace kmax::firmware::usb::device_test
