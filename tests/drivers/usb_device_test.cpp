#include "drivers/stm32f4/usb_device.hpp"

#include <gtest/gtest.h>

#include <cstdint>
#include <deque>
#include <string>
#include <vector>

#include "tests/drivers/fake_register.hpp"

namespace kmax::drivers::stm32f4::usb_device_test {
namespace {

using Bytes = std::vector<std::uint8_t>;

struct FakeGlobal {
  FakeRegister gahbcfg, gusbcfg, grstctl, gintsts, gintmsk, grxstsp, grxfsiz, dieptxf0, gccfg;
  FakeRegister dieptxf[3];
};
struct FakeDevice {
  struct In {
    FakeRegister diepctl, diepint, dieptsiz;
  };
  struct Out {
    FakeRegister doepctl, doepint, doeptsiz;
  };
  FakeRegister dcfg, dctl, dsts, diepmsk, doepmsk, daint, daintmsk;
  In in[4];
  Out out[4];
};
struct FakeFifos {
  FakeRegister* of;
  FakeRegister& operator[](unsigned number) const { return of[number]; }
};

struct Endpoint {
  std::uint8_t address, type;
  std::uint16_t packet_bytes;
};

/// What a core does by itself: its hand-shakes, the receive FIFO, what comes of taking from it.
struct Core {
  Core() {
    global.grstctl.on_read = [this](std::uint32_t) { return answers ? otg_fs_grstctl::AhbIdle::mask : 0U; };
    global.gintsts.on_read = [this](std::uint32_t) {
      return flags | otg_fs_gint::ReceiveNotEmpty::bits(statuses.empty() ? 0 : 1) |
             otg_fs_gint::HostMode::bits(host_mode ? 1 : 0) |
             otg_fs_gint::InEndpoint::bits(otg_fs_daint::In::of(asking) != 0 ? 1 : 0) |
             otg_fs_gint::OutEndpoint::bits(otg_fs_daint::Out::of(asking) != 0 ? 1 : 0);
    };
    global.grxstsp.on_read = [this](std::uint32_t) {
      const std::uint32_t status = statuses.front();
      statuses.pop_front();
      return status;
    };
    fifos[0].on_read = [this](std::uint32_t) {
      const std::uint32_t word = words.front();
      words.pop_front();
      return word;
    };
    device.daint.on_read = [this](std::uint32_t) { return asking; };
    for (auto& in : device.in) {
      in.diepctl.on_write = [&in](std::uint32_t word) {
        if (otg_fs_diepctl::SetNak::of(word) != 0) in.diepint.value |= otg_fs_diepint::NakEffective::mask;
        if (otg_fs_diepctl::Disable::of(word) == 0) return;
        in.diepint.value |= otg_fs_diepint::Disabled::mask;
        in.diepctl.value &= ~(otg_fs_diepctl::Enable::mask | otg_fs_diepctl::Disable::mask);
      };
    }
  }

  FakeGlobal global;
  FakeDevice device;
  FakeRegister fifos[4];
  bool answers = true, host_mode = false;
  std::uint32_t flags = 0, asking = 0;
  std::deque<std::uint32_t> statuses, words;
  UsbDevice<FakeGlobal, FakeDevice, FakeFifos> usb{global, device, {fifos}};
};

/// The calls that a device gets.
struct Handler {
  void ISR_reset() { calls.emplace_back("reset"); }
  void ISR_suspend() { calls.emplace_back("suspend"); }
  void ISR_resume() { calls.emplace_back("resume"); }
  void ISR_set_up(std::span<const std::uint8_t, 8> bytes) {
    calls.emplace_back("set-up");
    data.assign(bytes.begin(), bytes.end());
  }
  void ISR_received(std::uint8_t number, std::span<const std::uint8_t> bytes) {
    calls.push_back("received " + std::to_string(number));
    data.assign(bytes.begin(), bytes.end());
  }
  void ISR_sent(std::uint8_t number) { calls.push_back("sent " + std::to_string(number)); }
  std::vector<std::string> calls;
  Bytes data;
};
using Calls = std::vector<std::string>;

std::uint32_t status(std::uint32_t kind, std::uint32_t number, std::uint32_t bytes) {
  return otg_fs_grxsts::PacketStatus::bits(kind) | otg_fs_grxsts::Endpoint::bits(number) |
         otg_fs_grxsts::ByteCount::bits(bytes);
}

TEST(UsbDeviceController, ConnectsWhenAllElseIsSetUp) {
  Core core;
  ASSERT_TRUE(core.usb.start(10));
  ASSERT_EQ(core.device.dctl.writes.size(), 2U);
  EXPECT_EQ(core.device.dctl.writes[0], otg_fs_dctl::SoftDisconnect::mask);
  EXPECT_EQ(core.device.dctl.writes[1], 0U);
  EXPECT_EQ(otg_fs_gusbcfg::ForceDevice::read(core.global.gusbcfg), 1U);
  EXPECT_EQ(core.global.gccfg.value, otg_fs_gccfg::PowerUp::mask | otg_fs_gccfg::NoVbusSensing::mask);
  EXPECT_EQ(otg_fs_dcfg::Speed::read(core.device.dcfg), otg_fs_dcfg::full_speed);
}

TEST(UsbDeviceController, DividesTheMemoryWithoutAnOverlap) {
  Core core;
  ASSERT_TRUE(core.usb.start(10));
  std::uint32_t end = core.global.grxfsiz.value;
  EXPECT_GE(end, 10U + 2 * 18U);
  for (const FakeRegister* fifo :
       {&core.global.dieptxf0, &core.global.dieptxf[0], &core.global.dieptxf[1], &core.global.dieptxf[2]}) {
    EXPECT_EQ(otg_fs_dieptxf::Start::read(*fifo), end);
    EXPECT_GE(otg_fs_dieptxf::Depth::read(*fifo), 16U);
    end += otg_fs_dieptxf::Depth::read(*fifo);
  }
  EXPECT_LE(end, otg_fs_fifo_words);
}

TEST(UsbDeviceController, ACoreThatDoesNotAnswerOrStaysAHostIsNoDevice) {
  Core silent;
  silent.answers = false;
  EXPECT_FALSE(silent.usb.start(10));
  EXPECT_TRUE(silent.device.dctl.writes.empty());
  Core host;
  host.host_mode = true;
  EXPECT_FALSE(host.usb.start(10));
  EXPECT_EQ(otg_fs_dctl::SoftDisconnect::read(host.device.dctl), 1U);
}

TEST(UsbDeviceController, SendsAPacketInWordsLowByteFirst) {
  Core core;
  core.usb.ISR_send(1, Bytes{1, 2, 3, 4, 5});
  EXPECT_EQ(core.device.in[1].dieptsiz.value,
            otg_fs_eptsiz::PacketCount::bits(1) | otg_fs_eptsiz::TransferSize::bits(5));
  EXPECT_EQ(core.device.in[1].diepctl.value, otg_fs_diepctl::Enable::mask | otg_fs_diepctl::ClearNak::mask);
  EXPECT_EQ(core.fifos[1].writes, (std::vector<std::uint32_t>{0x0403'0201, 0x05}));
  core.usb.ISR_send(0, {});
  EXPECT_TRUE(core.fifos[0].writes.empty());
}

TEST(UsbDeviceController, HandsOutASetUpPacketAndAnOutPacketInTheirOrder) {
  Core core;
  ASSERT_TRUE(core.usb.start(10));
  Handler handler;
  core.statuses = {status(otg_fs_grxsts::setup_data, 0, 8), status(otg_fs_grxsts::setup_done, 0, 0)};
  core.words = {0x0403'0201, 0x0807'0605};
  core.asking = otg_fs_daint::Out::bits(1);
  core.device.out[0].doepint.value = otg_fs_doepint::SetupDone::mask | otg_fs_doepint::TransferComplete::mask;
  EXPECT_TRUE(core.usb.ISR_serve(handler));
  EXPECT_EQ(handler.calls, (Calls{"received 0", "set-up"})) << "the status stage before the next set-up";
  EXPECT_EQ(handler.data, (Bytes{1, 2, 3, 4, 5, 6, 7, 8}));

  core.usb.ISR_open(Endpoint{0x03, 2, 64});
  handler.calls.clear();
  core.statuses = {status(otg_fs_grxsts::out_data, 3, 5), status(otg_fs_grxsts::out_done, 3, 0)};
  core.words = {0x0403'0201, 0xFFFF'FF05};
  core.asking = otg_fs_daint::Out::bits(1U << 3);
  core.device.out[3].doepint.value = otg_fs_doepint::TransferComplete::mask;
  EXPECT_TRUE(core.usb.ISR_serve(handler));
  EXPECT_EQ(handler.calls, Calls{"received 3"});
  EXPECT_EQ(handler.data, (Bytes{1, 2, 3, 4, 5}));
  EXPECT_TRUE(core.words.empty());
}

TEST(UsbDeviceController, WithoutACauseItSaysSo) {
  Core core;
  ASSERT_TRUE(core.usb.start(10));
  Handler handler;
  EXPECT_FALSE(core.usb.ISR_serve(handler));
  EXPECT_TRUE(handler.calls.empty());
}

TEST(UsbDeviceController, ABusResetStopsWhatIsUnderWayAndForgetsTheAddress) {
  Core core;
  ASSERT_TRUE(core.usb.start(10));
  core.usb.ISR_take_address(17);
  EXPECT_EQ(otg_fs_dcfg::Address::read(core.device.dcfg), 17U);
  core.usb.ISR_open(Endpoint{0x81, 2, 64});
  core.usb.ISR_send(1, Bytes(64));
  Handler handler;
  core.flags = otg_fs_gint::Reset::mask;
  EXPECT_TRUE(core.usb.ISR_serve(handler));
  EXPECT_EQ(handler.calls, Calls{"reset"});
  EXPECT_EQ(otg_fs_dcfg::Address::read(core.device.dcfg), 0U);
  EXPECT_EQ(otg_fs_diepctl::Enable::read(core.device.in[1].diepctl), 0U);
  EXPECT_EQ(core.device.daintmsk.value, otg_fs_daint::In::bits(1) | otg_fs_daint::Out::bits(1));
}

// While the core stood still, to erase flash for one, the host may have slept and come back, or the other way
// round.
TEST(UsbDeviceController, SuspensionIsWhatTheCoreIsInAtTheEnd) {
  Core core;
  ASSERT_TRUE(core.usb.start(10));
  Handler handler;
  core.flags = otg_fs_gint::Suspend::mask | otg_fs_gint::WakeUp::mask;
  EXPECT_TRUE(core.usb.ISR_serve(handler));
  core.device.dsts.value = otg_fs_dsts::Suspended::mask;
  EXPECT_TRUE(core.usb.ISR_serve(handler));
  EXPECT_EQ(handler.calls, (Calls{"resume", "suspend"}));
}

TEST(UsbDeviceController, WhatCameOnOtherEndpointsCameBeforeARequestThatEndsIt) {
  Core core;
  ASSERT_TRUE(core.usb.start(10));
  core.device.daintmsk.value = 0xFFFF'FFFF;
  core.asking = otg_fs_daint::Out::bits(1U | 1U << 3);
  core.device.out[0].doepint.value = otg_fs_doepint::SetupDone::mask;
  core.device.out[3].doepint.value = otg_fs_doepint::TransferComplete::mask;
  Handler handler;
  EXPECT_TRUE(core.usb.ISR_serve(handler));
  EXPECT_EQ(handler.calls, (Calls{"received 3", "set-up"}));
}

TEST(UsbDeviceController, APacketThatIsTakenBackIsThrownAwayAndNotReportedAsSent) {
  Core core;
  core.usb.ISR_open(Endpoint{0x81, 2, 64});
  core.usb.ISR_send(1, Bytes(20));
  core.usb.ISR_take_back(1);
  EXPECT_EQ(otg_fs_diepctl::Enable::read(core.device.in[1].diepctl), 0U);
  EXPECT_EQ(core.global.grstctl.writes.back(),
            otg_fs_grstctl::TransmitFlush::mask | otg_fs_grstctl::TransmitFifoNumber::bits(1));
  // One that has left meanwhile, too.
  core.device.in[1].diepint.writes.clear();
  core.usb.ISR_take_back(1);
  EXPECT_EQ(core.device.in[1].diepint.writes,
            std::vector<std::uint32_t>{otg_fs_diepint::TransferComplete::mask});
}

TEST(UsbDeviceController, AnEndpointThatIsArmedAlreadyIsOnlyLetReceive) {
  Core core;
  core.usb.ISR_receive(2);
  EXPECT_EQ(core.device.out[2].doeptsiz.writes.size(), 1U);
  core.usb.ISR_stall(0x02);
  EXPECT_EQ(otg_fs_doepctl::Stall::read(core.device.out[2].doepctl), 1U);
  core.device.out[2].doepctl.value |= otg_fs_doepctl::Enable::mask;  // as the core keeps it
  core.usb.ISR_clear_stall(0x02);
  EXPECT_EQ(otg_fs_doepctl::Stall::read(core.device.out[2].doepctl), 0U);
  EXPECT_EQ(otg_fs_doepctl::SetData0::read(core.device.out[2].doepctl), 1U);
  core.device.out[2].doepctl.value |= otg_fs_doepctl::Enable::mask;
  core.usb.ISR_receive(2);
  EXPECT_EQ(core.device.out[2].doeptsiz.writes.size(), 1U) << "its size is not written while it is enabled";
}

}  // namespace
}  // namespace kmax::drivers::stm32f4::usb_device_test
