// The flashed image at a USB host: found, spoken to over both of its functions, pulled out.
#include <gtest/gtest.h>

#include <algorithm>
#include <random>

#include "firmware/drive/statusword.hpp"
#include "firmware/modbus/crc.hpp"
#include "firmware/object_dictionary/register_windows.hpp"
#include "firmware/object_dictionary/special_objects.hpp"
#include "firmware/usb/descriptors.hpp"
#include "firmware/usb/gs_usb.hpp"
#include "host_tools/virtual_board/run/usb_enumeration.hpp"
#include "tests/image/image_bench.hpp"

namespace kmax::tests::usb_test {
namespace {

namespace usb = firmware::usb;
using virtual_board::UsbHostPort;
using virtual_board::UsbTransfer;
using virtual_board::UsbTransferEnd;
using virtual_board::UsbTransferKind;
using virtual_board::UsbTransferResult;
using Bytes = std::vector<std::uint8_t>;

class UsbBench : public ImageBench {
 public:
  explicit UsbBench(const Parameters& parameters = {}, double push = 0.0,
                    const std::string& scene_name = "motor_axes")
      : ImageBench(parameters, push, scene_name), found_(board->usb()) {}

  UsbHostPort& port() { return board->usb(); }
  virtual_board::UsbEnumeration& found() { return found_; }

  /// Until the host knows the device.
  bool plug_in() {
    found_.plug_in(board->now());
    for (int tries = 0; tries < 100 && !found_.device(); ++tries) board->run_for(0.01);
    return found_.device().has_value();
  }
  UsbTransferResult transfer(UsbTransfer wanted, double most = 0.5) {
    std::optional<UsbTransferResult> result;
    wanted.address = virtual_board::UsbEnumeration::address;
    wanted.on_end = [&](const UsbTransferResult& ended, virtual_board::BoardTime) { result = ended; };
    const std::uint64_t number = port().submit(wanted, board->now());
    for (double waited = 0.0; !result && waited < most; waited += 50e-6) board->run_for(50e-6);
    if (!result) port().cancel(number, board->now());
    return *result;
  }
  UsbTransferResult control(std::array<std::uint8_t, 8> setup, const Bytes& data = {}) {
    UsbTransfer wanted;
    wanted.kind = UsbTransferKind::control;
    wanted.setup = setup;
    wanted.data = data;
    wanted.length = setup[6] | std::size_t{setup[7]} << 8;
    return transfer(wanted);
  }
  bool put(std::uint8_t endpoint, const Bytes& data, bool zero_packet = false) {
    UsbTransfer wanted;
    wanted.endpoint = endpoint;
    wanted.data = data;
    wanted.zero_packet = zero_packet;
    return transfer(wanted).end == UsbTransferEnd::done;
  }
  Bytes take(std::uint8_t endpoint, double most = 0.1) {
    UsbTransfer wanted;
    wanted.endpoint = endpoint;
    wanted.in = true;
    wanted.length = 512;
    return transfer(wanted, most).data;
  }

  /// Configuration 1, and the terminal is ready (CDC PSTN 1.2, 6.3.12).
  void open_serial() {
    ASSERT_EQ(control({0x00, 9, 1, 0, 0, 0, 0, 0}).end, UsbTransferEnd::done);
    ASSERT_EQ(control({0x21, 0x22, 3, 0, 1, 0, 0, 0}).end, UsbTransferEnd::done);
  }
  /// What a Modbus server answers to a PDU, without unit and CRC; nothing: it is silent.
  Bytes request(const Bytes& pdu) {
    Bytes frame{1};
    frame.insert(frame.end(), pdu.begin(), pdu.end());
    const std::uint16_t crc = firmware::modbus::crc_of(frame);
    frame.push_back(static_cast<std::uint8_t>(crc));
    frame.push_back(static_cast<std::uint8_t>(crc >> 8));
    if (!put(serial_out, frame, true)) return {};
    const Bytes reply = take(serial_in);
    if (reply.size() < 4 || firmware::modbus::crc_of(std::span(reply)) != 0) return {};
    return {reply.begin() + 1, reply.end() - 2};
  }
  bool write_over_usb(std::string_view name, std::uint16_t value) {
    const std::uint16_t address = firmware::register_address(firmware::find_entry(name), 0);
    const Bytes pdu{6, static_cast<std::uint8_t>(address >> 8), static_cast<std::uint8_t>(address),
                    static_cast<std::uint8_t>(value >> 8), static_cast<std::uint8_t>(value)};
    return request(pdu) == pdu;
  }
  std::uint16_t read_over_usb(std::string_view name) {
    const std::uint16_t address = firmware::register_address(firmware::find_entry(name), 0);
    const Bytes reply =
        request({4, static_cast<std::uint8_t>(address >> 8), static_cast<std::uint8_t>(address), 0, 1});
    return reply.size() == 4 ? static_cast<std::uint16_t>(reply[2] << 8 | reply[3]) : 0xFFFF;
  }
  bool arm_over_usb() {
    for (const std::uint16_t word : std::to_array<std::uint16_t>({0x06, 0x07, 0x0F})) {
      if (!write_over_usb("drive.controlword", word)) return false;
    }
    board->run_for(0.01);
    return board->bridge_armed(0);
  }

  static constexpr std::uint8_t can_in = 1, can_out = 2, serial_in = 2, serial_out = 3;

 private:
  virtual_board::UsbEnumeration found_;
};

Bytes little_endian(std::initializer_list<std::uint32_t> words) {
  Bytes bytes;
  for (const std::uint32_t word : words)
    for (unsigned shift = 0; shift < 32; shift += 8)
      bytes.push_back(static_cast<std::uint8_t>(word >> shift));
  return bytes;
}

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
  constexpr double time_out = 0.1;
  // Nobody presses the handle into a wall where it could not be armed again.
  UsbBench bench({{"axis0.wall.law", std::string("plain")}, {"link.timeout", time_out}}, 0.0,
                 "dc_coreless_a");
  bench.start();
  std::mt19937 random(7);
  std::uniform_real_distribution<double> moment(0.0, 0.02);
  for (int time = 0; time < 12; ++time) {
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
    EXPECT_FALSE(bench.board->bridge_armed(0)) << time;
    EXPECT_EQ(bench.fault(0), firmware::Fault::link_silent) << time;
  }
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

TEST(ImageUsb, NeitherHangsNorMissesATickInMalformedSetUps) {
  UsbBench bench;
  bench.start();
  ASSERT_TRUE(bench.plug_in()) << bench.found().trouble();
  std::mt19937 random(11);
  std::uniform_int_distribution<int> byte(0, 255);
  for (int i = 0; i < 500; ++i) {
    std::array<std::uint8_t, 8> setup;
    for (std::uint8_t& value : setup) value = static_cast<std::uint8_t>(byte(random));
    // Any request but the two that an address or the loader would follow.
    if (setup[1] == 5 || setup[1] == 0xDF) continue;
    setup[6] &= 0x3F;
    setup[7] = 0;
    Bytes data;
    if ((setup[0] & 0x80) == 0) data.assign(setup[6], 0x5A);
    const UsbTransferEnd end = bench.control(setup, data).end;
    EXPECT_TRUE(end == UsbTransferEnd::done || end == UsbTransferEnd::stalled) << i;
  }
  bench.open_serial();
  EXPECT_NE(bench.read_over_usb("drive.statusword"), 0xFFFF);
  EXPECT_EQ(bench.number("counters.missed_ticks"), 0U);
}

}  // namespace
}  // namespace kmax::tests::usb_test
