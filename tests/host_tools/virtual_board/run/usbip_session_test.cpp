// The protocol of USB/IP, spoken to the scripted device of usb_bench.hpp.
#include "host_tools/virtual_board/run/usbip_session.hpp"

#include <gtest/gtest.h>

#include <rapidcheck/gtest.h>

#include "tests/host_tools/virtual_board/stm32f4/usb_bench.hpp"

namespace kmax::virtual_board::usbip_session_test {

using Bytes = std::vector<std::uint8_t>;

void append(Bytes& bytes, std::uint64_t value, unsigned size) {
  for (unsigned i = size; i-- > 0;) bytes.push_back(static_cast<std::uint8_t>(value >> (8 * i)));
}

std::uint32_t word(const Bytes& bytes, std::size_t at) {
  std::uint32_t value = 0;
  for (std::size_t i = at; i < at + 4; ++i) value = value << 8 | bytes.at(i);
  return value;
}

Bytes list_request() {
  return {0x01, 0x11, 0x80, 0x05, 0, 0, 0, 0};
}

Bytes import_request(std::string_view bus_id = "1-1") {
  Bytes bytes{0x01, 0x11, 0x80, 0x03, 0, 0, 0, 0};
  bytes.insert(bytes.end(), bus_id.begin(), bus_id.end());
  bytes.resize(8 + 32);
  return bytes;
}

struct Submit {
  std::uint32_t sequence = 1, endpoint = 0, length = 0;
  bool in = false;
  Bytes data{};
  std::array<std::uint8_t, 8> setup{};
  std::uint32_t packets = 0xFFFF'FFFF, flags = 0;
};

Bytes submit(const Submit& what) {
  Bytes bytes;
  append(bytes, 1, 4), append(bytes, what.sequence, 4), append(bytes, UsbipSession::device_id, 4);
  append(bytes, what.in ? 1 : 0, 4), append(bytes, what.endpoint, 4), append(bytes, what.flags, 4);
  append(bytes, what.in ? what.length : what.data.size(), 4), append(bytes, 0, 4),
      append(bytes, what.packets, 4);
  append(bytes, 0, 4);
  bytes.insert(bytes.end(), what.setup.begin(), what.setup.end());
  bytes.insert(bytes.end(), what.data.begin(), what.data.end());
  return bytes;
}

Bytes unlink(std::uint32_t sequence, std::uint32_t which) {
  Bytes bytes;
  append(bytes, 2, 4), append(bytes, sequence, 4), append(bytes, UsbipSession::device_id, 4);
  append(bytes, 0, 8), append(bytes, which, 4);
  bytes.resize(48);
  return bytes;
}

struct Bench : testing::UsbBench {
  Bench() { start(); }
  /// All that has been said until `size` bytes are there, or a long time has passed.
  Bytes wait_for(std::size_t size, UsbipSession& from) {
    Bytes bytes;
    for (int i = 0; i < 1000 && bytes.size() < size && !from.ended(); ++i) {
      serve_for(usb_time::frame);
      from.look(false, now);
      const Bytes more = from.take_output();
      bytes.insert(bytes.end(), more.begin(), more.end());
    }
    const Bytes more = from.take_output();
    bytes.insert(bytes.end(), more.begin(), more.end());
    return bytes;
  }
  Bytes ask(const Bytes& bytes, std::size_t size) {
    session->receive(bytes, false, now);
    return wait_for(size, *session);
  }
  void import_it() {
    const Bytes answer = ask(import_request(), 320);
    ASSERT_EQ(answer.size(), 320U) << enumeration.trouble() << session->trouble();
    ASSERT_EQ(word(answer, 4), 0U);
    const Bytes done = ask(submit({.setup = {0, 9, 1, 0, 0, 0, 0, 0}}), 48);
    ASSERT_EQ(word(done, 20), 0U);
  }
  UsbEnumeration enumeration{port};
  std::unique_ptr<UsbipSession> session = std::make_unique<UsbipSession>(enumeration, port);
};

TEST(UsbipSession, ListsTheDeviceAndEnds) {
  Bench bench;
  const Bytes answer = bench.ask(list_request(), 324 + 4);
  ASSERT_EQ(answer.size(), 12U + 312U + 4U) << bench.enumeration.trouble();
  EXPECT_EQ(word(answer, 0), 0x0111'0005U);
  EXPECT_EQ(word(answer, 8), 1U);
  EXPECT_EQ(std::string(answer.begin() + 12 + 256, answer.begin() + 12 + 259), "1-1");
  EXPECT_EQ(word(answer, 12 + 288), 1U);
  EXPECT_EQ(word(answer, 12 + 296), 2U) << "full speed";
  EXPECT_EQ(word(answer, 12 + 300), 0x1209'1234U);
  EXPECT_TRUE(bench.session->ended());
  EXPECT_EQ(bench.session->trouble(), "");
}

TEST(UsbipSession, WithoutADeviceTheListIsEmptyAndAnImportRefused) {
  Bench bench;
  bench.pins = false;
  UsbipSession importer(bench.enumeration, bench.port);
  importer.receive(import_request(), false, bench.now);
  bench.session->receive(list_request(), false, bench.now);
  bench.serve_for(UsbipSession::patience + usb_time::frame);
  EXPECT_EQ(word(bench.wait_for(12, *bench.session), 8), 0U);
  const Bytes refusal = bench.wait_for(8, importer);
  ASSERT_EQ(refusal.size(), 8U);
  EXPECT_EQ(word(refusal, 4), 1U);
  EXPECT_TRUE(importer.ended());
  EXPECT_NE(importer.trouble().find("D+"), std::string::npos);
}

TEST(UsbipSession, OneClientHasTheDevice) {
  Bench bench;
  bench.import_it();
  EXPECT_TRUE(bench.session->imports());
  UsbipSession second(bench.enumeration, bench.port);
  second.receive(import_request(), true, bench.now);
  EXPECT_EQ(word(second.take_output(), 4), 1U);
  EXPECT_TRUE(second.ended());
}

TEST(UsbipSession, CarriesControlAndBulkTransfers) {
  Bench bench;
  bench.import_it();
  const Bytes control = bench.ask(
      submit({.sequence = 5, .length = 18, .in = true, .setup = {0x80, 6, 0, 1, 0, 0, 18, 0}}), 48 + 18);
  ASSERT_EQ(control.size(), 48U + 18U);
  EXPECT_EQ(word(control, 0), 3U);
  EXPECT_EQ(word(control, 4), 5U);
  EXPECT_EQ(word(control, 24), 18U);
  EXPECT_TRUE(std::equal(control.begin() + 48, control.end(), bench.descriptor.begin()));
  const Bytes out = bench.ask(submit({.sequence = 6, .endpoint = 1, .data = {1, 2, 3}}), 48);
  EXPECT_EQ(word(out, 20), 0U);
  EXPECT_EQ(word(out, 24), 3U);
  const Bytes in = bench.ask(submit({.sequence = 7, .endpoint = 1, .length = 64, .in = true}), 48 + 3);
  EXPECT_EQ(Bytes(in.begin() + 48, in.end()), (Bytes{1, 2, 3}));
  const Bytes stalled =
      bench.ask(submit({.sequence = 8, .length = 2, .in = true, .setup = {0x80, 0, 0, 0, 0, 0, 2, 0}}), 48);
  EXPECT_EQ(static_cast<std::int32_t>(word(stalled, 20)), -32);
  const Bytes nowhere = bench.ask(submit({.sequence = 9, .endpoint = 3, .length = 2, .in = true}), 48);
  EXPECT_EQ(static_cast<std::int32_t>(word(nowhere, 20)), -32);
  const Bytes address = bench.ask(submit({.sequence = 10, .setup = {0, 5, 9, 0, 0, 0, 0, 0}}), 48);
  EXPECT_EQ(word(address, 20), 0U) << "the device keeps the address that it has";
  EXPECT_EQ(word(bench.ask(submit({.sequence = 11, .endpoint = 1, .data = {4}}), 48), 20), 0U);
}

TEST(UsbipSession, ManyTransfersWaitAndEachCanBeUnlinked) {
  Bench bench;
  bench.import_it();
  Bytes many;
  for (std::uint32_t i = 0; i < 100; ++i) {
    const Bytes one = submit({.sequence = 100 + i, .endpoint = 1, .length = 64, .in = true});
    many.insert(many.end(), one.begin(), one.end());
  }
  EXPECT_EQ(bench.ask(many, 1).size(), 0U) << "there is nothing to be had";
  EXPECT_EQ(bench.port.outstanding(), 100U);
  const Bytes unlinked = bench.ask(unlink(300, 150), 48);
  ASSERT_EQ(unlinked.size(), 48U);
  EXPECT_EQ(word(unlinked, 0), 4U);
  EXPECT_EQ(word(unlinked, 4), 300U);
  EXPECT_EQ(static_cast<std::int32_t>(word(unlinked, 20)), -104);
  EXPECT_EQ(bench.port.outstanding(), 99U);
  EXPECT_EQ(word(bench.ask(unlink(301, 150), 48), 20), 0U) << "there is none any more";
  const Bytes both = bench.ask(submit({.sequence = 400, .endpoint = 1, .data = {7}}), 48 + 48 + 1);
  ASSERT_EQ(both.size(), 97U);
  EXPECT_EQ(word(both, 4), 400U);
  EXPECT_EQ(word(both, 48 + 4), 100U) << "the oldest";
}

TEST(UsbipSession, AClientThatGoesLeavesNothingBehind) {
  Bench bench;
  bench.import_it();
  bench.session->receive(submit({.sequence = 2, .endpoint = 1, .length = 64, .in = true}), false, bench.now);
  EXPECT_EQ(bench.port.outstanding(), 1U);
  bench.session.reset();
  EXPECT_EQ(bench.port.outstanding(), 0U);
  bench.enumeration.pull_out(bench.now);
  bench.serve_for(10 * usb_time::frame);
  bench.session = std::make_unique<UsbipSession>(bench.enumeration, bench.port);
  bench.import_it();
}

TEST(UsbipSession, ADeviceThatGoesEndsTransfers) {
  Bench bench;
  bench.import_it();
  bench.session->receive(submit({.sequence = 2, .endpoint = 1, .length = 64, .in = true}), false, bench.now);
  bench.serve_for(usb_time::frame);
  bench.write(testing::usb_registers::dctl, 2);
  const Bytes answer = bench.wait_for(48, *bench.session);
  ASSERT_EQ(answer.size(), 48U);
  const auto status = static_cast<std::int32_t>(word(answer, 20));
  EXPECT_TRUE(status == -108 || status == -71) << status;
}

TEST(UsbipSession, PiecesOfAMessageAreWaitedFor) {
  Bench bench;
  for (const std::uint8_t byte : import_request()) {
    EXPECT_EQ(bench.session->take_output().size(), 0U);
    bench.session->receive({&byte, 1}, false, bench.now);
  }
  ASSERT_EQ(bench.wait_for(320, *bench.session).size(), 320U);
  for (const std::uint8_t byte : submit({.setup = {0, 9, 1, 0, 0, 0, 0, 0}}))
    bench.session->receive({&byte, 1}, false, bench.now);
  EXPECT_EQ(bench.wait_for(48, *bench.session).size(), 48U);
}

TEST(UsbipSession, WhatBreaksTheProtocolEndsTheConnection) {
  const auto trouble = [](const Bytes& bytes, bool imported) {
    Bench bench;
    if (imported) bench.import_it();
    bench.session->receive(bytes, false, bench.now);
    EXPECT_TRUE(bench.session->ended());
    return bench.session->trouble();
  };
  EXPECT_NE(trouble({0x01, 0x00, 0x80, 0x05, 0, 0, 0, 0}, false).find("version 0x0100"), std::string::npos);
  EXPECT_NE(trouble({0x01, 0x11, 0x12, 0x34, 0, 0, 0, 0}, false).find("0x1234"), std::string::npos);
  EXPECT_NE(trouble(import_request("2-1"), false).find("'2-1'"), std::string::npos);
  EXPECT_NE(trouble(submit({.endpoint = 16, .in = true}), true).find("endpoint 16"), std::string::npos);
  EXPECT_NE(trouble(submit({.length = 1U << 30, .in = true}), true).find("1073741824"), std::string::npos);
  EXPECT_NE(trouble(submit({.in = true, .packets = 3}), true).find("isochronous"), std::string::npos);
  EXPECT_NE(trouble(submit({.data = {1, 2}, .setup = {0x21, 1, 0, 0, 0, 0, 7, 0}}), true).find("says 7"),
            std::string::npos);
  Bytes unknown = submit({});
  unknown[3] = 9;
  EXPECT_NE(trouble(unknown, true).find("command 9"), std::string::npos);
  Bytes other_device = submit({});
  other_device[11] = 77;
  EXPECT_NE(trouble(other_device, true).find("0x0001004D"), std::string::npos);
}

// Whatever comes, it neither crashes nor keeps a transfer that nobody waits for.
RC_GTEST_PROP(UsbipSessionProperty, AnyBytesAreSurvived, (const Bytes& noise)) {
  Bench bench;
  bench.session->receive(noise, false, bench.now);
  bench.serve_for(usb_time::frame);
  bench.session.reset();
  RC_ASSERT(bench.port.outstanding() == 0U);
}

}  // namespace kmax::virtual_board::usbip_session_test
