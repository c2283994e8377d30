// The flashed image at a USB host: found, spoken to over both of its functions, pulled out.
#include <gtest/gtest.h>

#include <cstdio>
#include <random>

#include "tests/image/usb_bench.hpp"

namespace kmax::tests::usb_test {
namespace {

namespace usb = firmware::usb;
using virtual_board::UsbTransfer;
using virtual_board::UsbTransferEnd;

TEST(ImageUsb, IsFoundByAHostAsWhatItSaysItIs) {
  UsbBench bench;
  bench.start();
  ASSERT_TRUE(bench.plug_in()) << bench.found().trouble();
  const virtual_board::UsbDescription& device = *bench.found().device();
  EXPECT_EQ(device.vendor, 0x1209);
  EXPECT_EQ(device.product, 0x2323);
  ASSERT_EQ(device.interfaces.size(), 3U);
  EXPECT_EQ(device.interfaces[0].device_class, 0xFF) << "gs_usb is interface 0";
  EXPECT_EQ(device.interfaces[1].device_class, 2);
  EXPECT_EQ(device.interfaces[2].device_class, 10);
  EXPECT_EQ(device.endpoints.size(), 5U);
}

TEST(ImageUsb, NeedsNoPowerStage) {
  UsbBench bench;  // not started: the gate drivers are not ready yet
  EXPECT_TRUE(bench.plug_in()) << bench.found().trouble();
}

TEST(ImageUsb, CarriesModbusAndCommandsTheAxisThatItArms) {
  UsbBench bench({{"axis0.wall.law", std::string("plain")}, {"axis0.wall.stiffness", 1000.0}}, 1.0);
  bench.start();
  ASSERT_TRUE(bench.plug_in()) << bench.found().trouble();
  bench.open_serial();
  EXPECT_EQ(bench.read_over_usb("drive.statusword"),
            bench.reading(firmware::entry_of<"drive.statusword">(), 0));
  // Replies of one packet and of several, the last of them full or not: 59 words fill two packets.
  for (const std::uint8_t words : std::to_array<std::uint8_t>({1, 27, 28, 59, 60, 125}))
    EXPECT_EQ(bench.request({4, firmware::trace_window >> 8, 0, 0, words}).size(), 2U + 2U * words) << +words;
  ASSERT_TRUE(bench.arm_over_usb());
  for (int i = 0; i < 10; ++i) {
    EXPECT_NE(bench.read_over_usb("drive.statusword"), 0xFFFF);
    bench.board->run_for(0.05);
  }
  EXPECT_TRUE(bench.board->bridge_armed(0)) << "its commander lives";
}

TEST(ImageUsb, PulledOutAtAnyMomentWhileArmedTheForceIsGoneInTimeAndItComesBack) {
  constexpr double time_out = 0.05;
  // Nobody presses the handle into a wall where it could not be armed again.
  UsbBench bench({{"axis0.wall.law", std::string("plain")}, {"link.timeout", time_out}}, 0.0,
                 "dc_coreless_a");
  bench.start();
  std::mt19937 random(7);
  std::uniform_real_distribution<double> moment(0.0, 0.02);
  const int pulls = times(24, 1'000);
  for (int time = 0; time < pulls; ++time) {
    ASSERT_TRUE(bench.plug_in()) << time << ": " << bench.found().trouble();
    bench.open_serial();
    if (time > 0) {
      ASSERT_TRUE(bench.write_over_usb("drive.controlword", 0x80));
    }
    ASSERT_TRUE(bench.arm_over_usb()) << time;
    // In the middle of a request, of its reply, or between.
    UsbTransfer asked;
    asked.address = virtual_board::UsbEnumeration::address;
    asked.endpoint = UsbBench::serial_out;
    asked.data = Bytes(200, 0x55);
    bench.port().submit(asked, bench.board->now());
    bench.board->run_for(moment(random));
    bench.found().pull_out(bench.board->now());
    bench.board->run_for(time_out + 0.01);
    ASSERT_FALSE(bench.board->bridge_armed(0)) << time;
    EXPECT_EQ(bench.fault(0), firmware::Fault::link_silent) << time;
    EXPECT_EQ(bench.board->resets(), 1U) << time;
  }
  std::printf("pulled out %d times while armed: no force %.0f ms after each, missed ticks %u\n", pulls,
              (time_out + 0.01) * 1e3, bench.number("counters.missed_ticks"));
  EXPECT_EQ(bench.number("info.crash_count"), 0U);
  EXPECT_EQ(bench.number("counters.missed_ticks"), 0U);
}

TEST(ImageUsb, ReachesTheNodeThroughTheCanFunction) {
  UsbBench bench;
  bench.start();
  ASSERT_TRUE(bench.plug_in()) << bench.found().trouble();
  ASSERT_EQ(bench.control({0x00, 9, 1, 0, 0, 0, 0, 0}).end, UsbTransferEnd::done);
  ASSERT_EQ(bench.control({0x41, 0, 1, 0, 0, 0, 4, 0}, little_endian({0xBEEF})).end, UsbTransferEnd::done);
  EXPECT_EQ(bench.control({0xC1, 4, 0, 0, 0, 0, 40, 0}).data.size(), 40U);
  ASSERT_EQ(bench.control({0x41, 1, 0, 0, 0, 0, 20, 0}, little_endian({5, 6, 2, 1, 3})).end,
            UsbTransferEnd::done);
  ASSERT_EQ(bench.control({0x41, 2, 0, 0, 0, 0, 8, 0}, little_endian({1, 0})).end, UsbTransferEnd::done);
  // SDO upload of 1000h from node 1.
  const usb::gs::HostFrame asked{
      .echo = 3, .frame = {.identifier = 0x601, .length = 8, .data = {0x40, 0x00, 0x10, 0, 0, 0, 0, 0}}};
  const auto bytes = usb::gs::encoded(asked);
  ASSERT_TRUE(bench.put(UsbBench::can_out, Bytes(bytes.begin(), bytes.end())));
  bool echoed = false, answered = false;
  for (int i = 0; i < 40 && !(echoed && answered); ++i) {
    const Bytes come = bench.take(UsbBench::can_in);
    if (come.size() < usb::gs::frame_bytes) continue;
    const usb::gs::HostFrame frame = usb::gs::decoded(come);
    if (frame.echo == 3) echoed = true;
    if (frame.echo != usb::gs::no_echo || frame.frame.identifier != 0x581) continue;
    answered = true;
    EXPECT_EQ(frame.frame.data[4] | frame.frame.data[5] << 8,
              static_cast<int>(firmware::device_type_of_several_axes & 0xFFFF));
  }
  EXPECT_TRUE(echoed);
  EXPECT_TRUE(answered);
}

/// What a boot loader in ROM does when it leaves DFU: it jumps. In which state is in no document; these are
/// the bad ones.
class BoardBehindAJump {
 public:
  using Nvic = drivers::cortex_m::NvicRegisters;

  void store(std::uint32_t address, std::uint32_t value) {
    bench.board->chip().bus().write(address, 4, value, bench.board->now());
  }
  void leave_clocks_on() {
    using namespace drivers::stm32f4;
    constexpr std::uint32_t control = rcc_base + offsetof(RccRegisters, cr);
    store(control, bench.board->chip().bus().read(control, 4, bench.board->now()) | rcc_cr::CrystalOn::mask);
    store(rcc_base + offsetof(RccRegisters, ahb2enr), rcc_ahb2enr::OtgFs::mask);
  }
  /// Of the USB interrupt.
  void set(std::uint32_t registers) {
    store(drivers::cortex_m::nvic_base + registers + interrupt / 32 * 4, 1U << interrupt % 32);
  }
  /// The program from which the jump comes, with its own table, jumps out of its USB interrupt.
  void jump_out_of_a_handler() {
    constexpr std::uint32_t table = 0x2001'8000, handler = 0x2001'8400, loop = 0x2001'8500;
    const std::uint32_t firmware = bench.board->chip().processor().program_counter() | 1U;
    bench.board->chip().bus().store(table + (16 + interrupt) * 4, handler | 1U);
    bench.board->chip().bus().store(handler, 0xF000'F8DF);  // ldr pc, the word behind it
    bench.board->chip().bus().store(handler + 4, firmware);
    bench.board->chip().bus().store(loop, 0xE7FE'E7FE);  // b to itself
    store(drivers::cortex_m::scb_base + offsetof(drivers::cortex_m::ScbRegisters, vtor), table);
    set(offsetof(Nvic, iser));
    set(offsetof(Nvic, ispr));
    bench.board->chip().processor().set_core_register(15, loop);
  }
  void expect_one_reset_and_the_firmware() {
    bench.start();
    EXPECT_EQ(bench.board->resets(), 2U);
    EXPECT_EQ(bench.number("info.crash_count"), 0U);
    EXPECT_EQ(bench.number("info.reset_cause"), static_cast<unsigned>(firmware::ResetCause::software));
  }

  ImageBench bench;

 private:
  static constexpr auto interrupt = static_cast<std::uint32_t>(drivers::stm32f4::Interrupt::otg_fs);
};

TEST(ImageUsb, BehindAJumpThatLeavesUsbRunningItBeginsWithAReset) {
  BoardBehindAJump board;
  board.leave_clocks_on();
  board.set(offsetof(BoardBehindAJump::Nvic, iser));
  // The host goes on with its frames.
  const std::uint32_t program = image().required_symbol("main").address & ~1U;
  board.bench.board->chip().processor().on_block([&](std::uint32_t address, std::uint32_t) {
    if (address == program) board.set(offsetof(BoardBehindAJump::Nvic, ispr));
  });
  board.expect_one_reset_and_the_firmware();
}

TEST(ImageUsb, BehindAJumpOutOfAnInterruptItBeginsWithAReset) {
  BoardBehindAJump board;
  board.jump_out_of_a_handler();
  board.expect_one_reset_and_the_firmware();
}

TEST(ImageUsb, ALockedDeviceStaysInItsFirmware) {
  constexpr std::uint32_t code = 4711;
  UsbBench bench;
  bench.start();
  ASSERT_TRUE(bench.plug_in()) << bench.found().trouble();
  bench.open_serial();
  ASSERT_TRUE(bench.write_long_over_usb("lock.code", code));
  while (bench.read_over_usb("store.state") == 1) bench.board->run_for(5e-3);
  ASSERT_TRUE(bench.write_long_over_usb("lock.key", 0));
  EXPECT_EQ(bench.control({0x40, 0xDF, 0x46, 0x44, 0, 0, 0, 0}).end, UsbTransferEnd::stalled);
  bench.board->run_for(0.05);
  EXPECT_EQ(bench.board->resets(), 1U);
  ASSERT_TRUE(bench.write_long_over_usb("lock.key", code));
  EXPECT_EQ(bench.control({0x40, 0xDF, 0x46, 0x44, 0, 0, 0, 0}).end, UsbTransferEnd::done) << "open";
}

TEST(ImageUsb, SurvivesResetsSuspensionAndTheLoaderRequestWhileArmed) {
  UsbBench bench({{"link.timeout", 1.0}}, 1.0);
  bench.start();
  ASSERT_TRUE(bench.plug_in()) << bench.found().trouble();
  bench.open_serial();
  ASSERT_TRUE(bench.arm_over_usb());
  EXPECT_EQ(bench.control({0x40, 0xDF, 0x46, 0x44, 0, 0, 0, 0}).end, UsbTransferEnd::stalled)
      << "not while armed";
  bench.port().suspend(bench.board->now());
  bench.board->run_for(0.05);
  bench.port().resume(bench.board->now());
  bench.board->run_for(0.05);
  EXPECT_NE(bench.read_over_usb("drive.statusword"), 0xFFFF);
  EXPECT_TRUE(bench.board->bridge_armed(0));
  bench.port().suspend(bench.board->now());
  bench.board->run_for(1.1);
  EXPECT_FALSE(bench.board->bridge_armed(0)) << "a host that sleeps is silent";
}

}  // namespace
}  // namespace kmax::tests::usb_test
