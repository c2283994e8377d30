// Endpoint 0 of the image: what chapter 9 of USB 2.0 asks of it in each state, and whatever else a host may
// send there, at any moment.
#include <gtest/gtest.h>

#include <fmt/format.h>

#include <algorithm>
#include <cstdio>
#include <fstream>
#include <iterator>
#include <random>

#include "tests/image/usb_bench.hpp"

namespace kmax::tests::usb_set_ups_test {
namespace {

using virtual_board::UsbHostPort;
using virtual_board::UsbTransfer;
using virtual_board::UsbTransferEnd;
using virtual_board::UsbTransferKind;
using virtual_board::UsbTransferResult;
using SetUp = std::array<std::uint8_t, 8>;

constexpr std::uint8_t set_address = 5, loader_request = 0xDF;

/// A host that gives no address by itself.
class BareUsbBench : public UsbBench {
 public:
  BareUsbBench() { port().on_state({}); }

  bool attach() {
    port().attach(board->now());
    return wait_until_ready();
  }
  /// The default state (9.1.1.3).
  bool reset() {
    port().reset(board->now());
    address = 0;
    return wait_until_ready();
  }
  bool take_address(std::uint8_t wanted) {
    if (control({0, set_address, wanted, 0, 0, 0, 0, 0}).end != UsbTransferEnd::done) return false;
    address = wanted;
    return true;
  }
  UsbTransferEnd ask_for_status() { return control({0x80, 0, 0, 0, 0, 0, 2, 0}).end; }

 private:
  bool wait_until_ready() {
    for (int tries = 0; tries < 300 && !port().ready(); ++tries) board->run_for(1e-3);
    return port().ready();
  }
};

// The list of chapter 9.

enum class State : std::uint8_t { default_state, address, configured };
constexpr std::array states{State::default_state, State::address, State::configured};

/// What chapter 9 asks for in a state.
enum class Asked : std::uint8_t { answered, refused, not_specified };
constexpr Asked yes = Asked::answered, no = Asked::refused, open = Asked::not_specified;

struct Row {
  const char* request;
  SetUp setup;
  const char* section;
  std::array<Asked, states.size()> asked;
};

constexpr std::uint8_t low(unsigned word) {
  return static_cast<std::uint8_t>(word);
}
constexpr SetUp request(std::uint8_t type, std::uint8_t number, unsigned value, unsigned index,
                        unsigned length) {
  return {type,       number,          low(value),  low(value >> 8),
          low(index), low(index >> 8), low(length), low(length >> 8)};
}

const Row rows[] = {
    {"GET_STATUS, device", request(0x80, 0, 0, 0, 2), "9.4.5", {open, yes, yes}},
    {"GET_STATUS, interface 0", request(0x81, 0, 0, 0, 2), "9.4.5", {open, no, yes}},
    {"GET_STATUS, interface 9", request(0x81, 0, 0, 9, 2), "9.4.5", {open, no, no}},
    {"GET_STATUS, endpoint 0", request(0x82, 0, 0, 0, 2), "9.4.5", {open, yes, yes}},
    {"GET_STATUS, endpoint 0x81", request(0x82, 0, 0, 0x81, 2), "9.4.5", {open, no, yes}},
    {"GET_STATUS, endpoint 0x85", request(0x82, 0, 0, 0x85, 2), "9.4.5", {open, no, no}},
    {"SET_FEATURE, halt of 0x81", request(0x02, 3, 0, 0x81, 0), "9.4.9", {open, no, yes}},
    {"SET_FEATURE, halt of 0x85", request(0x02, 3, 0, 0x85, 0), "9.4.9", {open, no, no}},
    {"SET_FEATURE, remote wake-up", request(0x00, 3, 1, 0, 0), "9.4.9", {open, no, no}},
    {"SET_FEATURE, test mode", request(0x00, 3, 2, 0x100, 0), "9.4.9", {open, no, no}},
    {"CLEAR_FEATURE, halt of 0x81", request(0x02, 1, 0, 0x81, 0), "9.4.1", {open, no, yes}},
    {"CLEAR_FEATURE, remote wake-up", request(0x00, 1, 1, 0, 0), "9.4.1", {open, no, no}},
    {"SET_ADDRESS, 17", request(0x00, set_address, 17, 0, 0), "9.4.6", {yes, yes, open}},
    {"SET_ADDRESS, 128", request(0x00, set_address, 128, 0, 0), "9.4.6", {open, open, open}},
    {"GET_DESCRIPTOR, device", request(0x80, 6, 0x100, 0, 18), "9.4.3", {yes, yes, yes}},
    {"GET_DESCRIPTOR, device, first 8 bytes", request(0x80, 6, 0x100, 0, 8), "9.4.3", {yes, yes, yes}},
    {"GET_DESCRIPTOR, configuration", request(0x80, 6, 0x200, 0, 255), "9.4.3", {yes, yes, yes}},
    {"GET_DESCRIPTOR, second configuration", request(0x80, 6, 0x201, 0, 255), "9.4.3", {no, no, no}},
    {"GET_DESCRIPTOR, languages", request(0x80, 6, 0x300, 0, 255), "9.4.3", {yes, yes, yes}},
    {"GET_DESCRIPTOR, serial number, US English",
     request(0x80, 6, 0x303, 0x409, 255),
     "9.4.3",
     {yes, yes, yes}},
    {"GET_DESCRIPTOR, text 99", request(0x80, 6, 0x363, 0x409, 255), "9.4.3", {no, no, no}},
    {"GET_DESCRIPTOR, device qualifier", request(0x80, 6, 0x600, 0, 10), "9.6.2", {no, no, no}},
    {"GET_DESCRIPTOR, interface", request(0x80, 6, 0x400, 0, 9), "9.4.3", {no, no, no}},
    {"SET_DESCRIPTOR, device", request(0x00, 7, 0x100, 0, 18), "9.4.8", {open, no, no}},
    {"GET_CONFIGURATION", request(0x80, 8, 0, 0, 1), "9.4.2", {open, yes, yes}},
    {"SET_CONFIGURATION, 0", request(0x00, 9, 0, 0, 0), "9.4.7", {open, yes, yes}},
    {"SET_CONFIGURATION, 1", request(0x00, 9, 1, 0, 0), "9.4.7", {open, yes, yes}},
    {"SET_CONFIGURATION, 2", request(0x00, 9, 2, 0, 0), "9.4.7", {open, no, no}},
    {"GET_INTERFACE, 0", request(0x81, 10, 0, 0, 1), "9.4.4", {open, no, yes}},
    {"GET_INTERFACE, 9", request(0x81, 10, 0, 9, 1), "9.4.4", {open, no, no}},
    {"SET_INTERFACE, 0, setting 0", request(0x01, 11, 0, 0, 0), "9.4.10", {open, no, yes}},
    {"SET_INTERFACE, 0, setting 1", request(0x01, 11, 1, 0, 0), "9.4.10", {open, no, no}},
    {"SYNCH_FRAME, 0x81", request(0x82, 12, 0, 0x81, 2), "9.4.11", {open, no, no}},
    {"standard request 2, reserved", request(0x00, 2, 0, 0, 0), "9.4", {no, no, no}},
};

bool enter(BareUsbBench& bench, State state) {
  if (!bench.reset()) return false;
  if (state == State::default_state) return true;
  return bench.take_address(9) && (state == State::address || bench.configure());
}

std::string in_words(const UsbTransferResult& result, bool reads) {
  if (result.end == UsbTransferEnd::stalled) return "STALL";
  if (result.end != UsbTransferEnd::done) return "no answer";
  return reads ? fmt::format("{} byte{}", result.data.size(), result.data.size() == 1 ? "" : "s") : "done";
}

std::string made_row(BareUsbBench& bench, const Row& row) {
  std::string cells;
  bool kept = true;
  for (std::size_t i = 0; i < states.size(); ++i) {
    EXPECT_TRUE(enter(bench, states[i]));
    const UsbTransferResult result =
        bench.control(row.setup, (row.setup[0] & 0x80) != 0 ? Bytes{} : Bytes(row.setup[6]));
    const std::string said = in_words(result, (row.setup[0] & 0x80) != 0);
    const bool answered = result.end == UsbTransferEnd::done, refused = result.end == UsbTransferEnd::stalled;
    kept = kept && (row.asked[i] == open ? answered || refused : row.asked[i] == yes ? answered : refused);
    cells += fmt::format(" | {}{}", said, row.asked[i] == open ? " (open)" : "");
    // Whatever it was, the next request is answered, at one of the two addresses.
    if (answered && row.setup[0] == 0 && row.setup[1] == set_address) bench.address = row.setup[2];
    EXPECT_EQ(bench.control({0x80, 6, 0, 1, 0, 0, 18, 0}).data.size(), 18U) << row.request;
  }
  return fmt::format("| {}{} | {} | {} |\n", row.request, cells, row.section, kept ? "kept" : "BROKEN");
}

constexpr const char* page = "../docs/usb.md";

TEST(ImageUsbSetUps, AnswersWhatChapterNineAsksAsThePageSays) {
  BareUsbBench bench;
  ASSERT_TRUE(bench.attach());
  std::string made;
  for (const Row& row : rows) made += made_row(bench, row);
  EXPECT_EQ(made.find("BROKEN"), std::string::npos) << made;
  std::ifstream file(page);
  std::string text{std::istreambuf_iterator<char>(file), {}};
  const std::string begin_mark = "<!-- chapter 9: made by image_link_tests -->\n",
                    end_mark = "<!-- end of chapter 9 -->\n";
  const std::size_t begin = text.find(begin_mark), end = text.find(end_mark);
  ASSERT_NE(begin, std::string::npos);
  ASSERT_NE(end, std::string::npos);
  const std::string head =
      "| request | default | address | configured | USB 2.0 | verdict |\n|---|---|---|---|---|---|\n";
  const std::size_t from = begin + begin_mark.size();
  if (std::getenv("KMAX_WRITE_DOCS") != nullptr) {
    file.close();
    std::ofstream(page) << text.replace(from, end - from, head + made);
    return;
  }
  EXPECT_EQ(text.substr(from, end - from), head + made) << "KMAX_WRITE_DOCS=1 writes it";
}

TEST(ImageUsbSetUps, AnAddressCountsBehindTheStatusStageAndNotBefore) {
  BareUsbBench bench;
  ASSERT_TRUE(bench.attach());
  for (std::uint8_t number = 1; number < 128; number += 21) {
    ASSERT_TRUE(bench.reset());
    ASSERT_TRUE(bench.take_address(number)) << "its status stage comes from address 0";
    // Within 2 ms it answers there (9.2.6.3); here at once.
    EXPECT_EQ(bench.ask_for_status(), UsbTransferEnd::done) << +number;
    bench.address = 0;
    EXPECT_EQ(bench.ask_for_status(), UsbTransferEnd::no_answer) << +number;
    bench.address = number;
    ASSERT_TRUE(bench.take_address(0)) << "back to the default state";
    EXPECT_EQ(bench.ask_for_status(), UsbTransferEnd::done);
  }
}

TEST(ImageUsbSetUps, AnAddressWhoseStatusStageDoesNotComeIsNone) {
  BareUsbBench bench;
  ASSERT_TRUE(bench.attach());
  ASSERT_TRUE(bench.reset());
  ASSERT_TRUE(bench.take_address(5));
  int given_up = 0;
  for (int after_us = 0; after_us < 120; after_us += 4) {
    UsbTransfer wanted;
    wanted.kind = UsbTransferKind::control;
    wanted.address = bench.address;
    wanted.setup = {0, set_address, 77, 0, 0, 0, 0, 0};
    std::optional<UsbTransferEnd> end;
    wanted.on_end = [&end](const UsbTransferResult& result, virtual_board::BoardTime) { end = result.end; };
    const std::uint64_t number = bench.port().submit(wanted, bench.board->now());
    bench.board->run_for(after_us * 1e-6);
    if (!end) bench.port().cancel(number, bench.board->now());
    bench.board->run_for(200e-6);  // what was on the wire passes
    if (*end == UsbTransferEnd::done) {
      bench.address = 77;
      ASSERT_TRUE(bench.take_address(5)) << after_us;
      continue;
    }
    ++given_up;
    // The host goes on at the old address, twice.
    EXPECT_EQ(bench.ask_for_status(), UsbTransferEnd::done) << after_us;
    EXPECT_EQ(bench.ask_for_status(), UsbTransferEnd::done) << after_us;
  }
  EXPECT_GT(given_up, 2);
}

// Whatever else.

/// Set-up packets of any content, half of them near what the device knows.
class SomeSetUps {
 public:
  explicit SomeSetUps(std::uint32_t seed) : random_(seed) {}

  SetUp next() {
    SetUp setup;
    for (std::uint8_t& value : setup) value = byte();
    if (one_in(4)) return setup;
    if (one_in(2)) return nearly_known();
    constexpr std::array<std::uint8_t, 16> types{0x00, 0x01, 0x02, 0x80, 0x81, 0x82, 0x21, 0xA1,
                                                 0x41, 0xC1, 0x40, 0xC0, 0x22, 0xE0, 0x03, 0x9F};
    setup[0] = types[below(types.size())];
    setup[1] = static_cast<std::uint8_t>(below(14));
    if (one_in(3)) setup[1] = static_cast<std::uint8_t>(0x20 + below(4));
    if (one_in(50)) setup = {0x40, loader_request, 0x46, 0x44, 0, 0, 0, 0};
    if (one_in(2)) setup[2] = static_cast<std::uint8_t>(below(4));
    if (one_in(2)) setup[3] = static_cast<std::uint8_t>(below(8));
    if (one_in(2)) setup[4] = static_cast<std::uint8_t>((one_in(2) ? 0x80 : 0) + below(5));
    if (!one_in(4)) setup[5] = 0;
    if (!one_in(4)) setup[7] = 0;
    if (one_in(2)) setup[6] = static_cast<std::uint8_t>(below(80));
    return setup;
  }
  /// As long as it says, or not.
  Bytes data_for(const SetUp& setup) {
    const std::size_t said = setup[6] | std::size_t{setup[7]} << 8;
    Bytes data(one_in(4) ? below(200) : std::min<std::size_t>(said, 300));
    for (std::uint8_t& value : data) value = byte();
    return data;
  }
  std::size_t below(std::size_t count) { return random_() % count; }
  bool one_in(std::size_t count) { return below(count) == 0; }

 private:
  /// A request that is known, whole or with a byte or two of something else.
  SetUp nearly_known() {
    constexpr auto classes = std::to_array<SetUp>({
        request(0x21, 0x20, 0, 1, 7),
        request(0xA1, 0x21, 0, 1, 7),
        request(0x21, 0x22, 3, 1, 0),
        request(0x21, 0x22, 0, 1, 0),
        request(0x21, 0x23, 0, 1, 0),
        request(0x41, 0, 1, 0, 4),
        request(0x41, 1, 0, 0, 20),
        request(0x41, 2, 1, 0, 8),
        request(0xC1, 4, 0, 0, 40),
        request(0xC1, 5, 1, 0, 12),
    });
    SetUp setup = one_in(2) ? classes[below(classes.size())] : rows[below(std::size(rows))].setup;
    for (std::size_t i = one_in(3) ? 0 : below(3); i > 0; --i) setup[below(setup.size())] = byte();
    return setup;
  }
  std::uint8_t byte() { return static_cast<std::uint8_t>(random_()); }
  std::mt19937 random_;
};

/// A host that sends them to an armed board, gives some of them up in the middle, resets and sleeps.
class Storm {
 public:
  Storm(BareUsbBench& bench, std::uint32_t seed) : bench_(bench), some_(seed) {}

  struct Counts {
    int done = 0, refused = 0, given_up = 0, resets = 0, suspensions = 0, addresses = 0;
  };
  const Counts& counts() const { return counts_; }

  /// One of them; false: the device does not answer as it must.
  bool step() {
    if (some_.one_in(200)) return reset();
    if (some_.one_in(200)) return sleep();
    if (some_.one_in(40) && !configured()) return false;
    const SetUp setup = some_.next();
    const bool given_up = some_.one_in(5);
    UsbTransfer wanted;
    wanted.kind = UsbTransferKind::control;
    wanted.address = bench_.address;
    wanted.setup = setup;
    if ((setup[0] & 0x80) == 0) wanted.data = some_.data_for(setup);
    wanted.length = setup[6] | std::size_t{setup[7]} << 8;
    std::optional<UsbTransferEnd> end;
    wanted.on_end = [&end](const UsbTransferResult& result, virtual_board::BoardTime) { end = result.end; };
    const std::uint64_t number = bench_.port().submit(wanted, bench_.board->now());
    const double patience = given_up ? static_cast<double>(some_.below(400)) * 1e-6 : 0.2;
    for (double waited = 0.0; !end && waited < patience; waited += 10e-6) bench_.board->run_for(10e-6);
    if (!end) bench_.port().cancel(number, bench_.board->now());
    if (*end == UsbTransferEnd::cancelled) {
      ++counts_.given_up;
      if (!given_up) return complain(setup, "it does not end");
      bench_.board->run_for(100e-6);  // what was on the wire passes
      return true;
    }
    ++(*end == UsbTransferEnd::done ? counts_.done : counts_.refused);
    if (*end == UsbTransferEnd::done && setup[0] == 0 && setup[1] == set_address) {
      bench_.address = setup[2];
      ++counts_.addresses;
    }
    // What the host cuts short, it calls too much.
    if (*end == UsbTransferEnd::done || *end == UsbTransferEnd::stalled) return true;
    return complain(setup, *end == UsbTransferEnd::no_answer ? "no answer" : "overflow or lost");
  }

  bool reset() {
    ++counts_.resets;
    // In the middle of something, in whatever state.
    UsbTransfer wanted;
    wanted.kind = UsbTransferKind::control;
    wanted.address = bench_.address;
    wanted.setup = {0x80, 6, 0, 2, 0, 0, 255, 0};
    wanted.length = 255;
    bench_.port().submit(wanted, bench_.board->now());
    bench_.board->run_for(static_cast<double>(some_.below(600)) * 1e-6);
    return bench_.reset() && bench_.take_address(static_cast<std::uint8_t>(1 + some_.below(127)));
  }

 private:
  bool configured() { return bench_.address != 0 ? bench_.configure() : bench_.take_address(3); }
  bool sleep() {
    ++counts_.suspensions;
    bench_.port().suspend(bench_.board->now());
    bench_.board->run_for(static_cast<double>(some_.below(10)) * 1e-3);
    bench_.port().resume(bench_.board->now());
    for (int i = 0; i < 100 && !bench_.port().ready(); ++i) bench_.board->run_for(1e-3);
    return bench_.port().ready();
  }
  static bool complain(const SetUp& setup, const char* what) {
    std::string bytes;
    for (const std::uint8_t value : setup) bytes += fmt::format("{:02X} ", value);
    ADD_FAILURE() << bytes << what;
    return false;
  }

  BareUsbBench& bench_;
  SomeSetUps some_;
  Counts counts_;
};

TEST(ImageUsbSetUps, WhateverComesTheBoardNeitherHangsNorMissesATickNorLosesItsForce) {
  BareUsbBench bench;
  bench.start();
  ASSERT_TRUE(bench.attach());
  for (const unsigned word : {0x06U, 0x07U, 0x0FU}) bench.write("drive.controlword", 0, word);
  bench.board->run_for(0.01);
  ASSERT_TRUE(bench.board->bridge_armed(0));
  Storm storm(bench, 11);
  ASSERT_TRUE(storm.reset());
  const int set_ups = times(300, 10'000);
  for (int i = 0; i < set_ups; ++i) {
    ASSERT_TRUE(storm.step()) << i;
    if (i % 20 != 0) continue;
    static_cast<void>(bench.reading(firmware::entry_of<"drive.statusword">(), 0));  // its commander lives
    ASSERT_TRUE(bench.board->bridge_armed(0)) << i << ": " << firmware::text_of(bench.fault(0)).name;
  }
  const auto& counts = storm.counts();
  std::printf(
      "%d set-ups while armed: %d done, %d refused, %d given up in the middle, %d addresses, %d resets, %d "
      "suspensions; missed ticks %u\n",
      set_ups, counts.done, counts.refused, counts.given_up, counts.addresses, counts.resets,
      counts.suspensions, bench.number("counters.missed_ticks"));
  EXPECT_EQ(bench.number("counters.missed_ticks"), 0U);
  EXPECT_EQ(bench.number("info.crash_count"), 0U);
  EXPECT_EQ(bench.board->resets(), 1U);
  EXPECT_GE(bench.number("counters.usb_refused_requests"), static_cast<unsigned>(counts.refused));
  EXPECT_GE(bench.number("counters.usb_resets"), static_cast<unsigned>(counts.resets));
  // And it works as before.
  ASSERT_TRUE(bench.reset());
  ASSERT_TRUE(bench.take_address(1));
  bench.open_serial();
  EXPECT_NE(bench.read_over_usb("drive.statusword"), 0xFFFF);
}

TEST(ImageUsbSetUps, InSuchAStormTheForceOfASilentCommanderIsGoneWhenDue) {
  constexpr double time_out = 0.1;
  for (int round = 0; round < times(2, 20); ++round) {
    BareUsbBench bench;
    bench.start();
    bench.write_real("link.timeout", 0, static_cast<float>(time_out));
    ASSERT_TRUE(bench.attach());
    ASSERT_TRUE(bench.reset() && bench.take_address(1));
    bench.open_serial();
    ASSERT_TRUE(bench.arm_over_usb());
    ASSERT_NE(bench.read_over_usb("drive.statusword"), 0xFFFF);
    Storm storm(bench, static_cast<std::uint32_t>(100 + round));
    const double silent_at = virtual_board::seconds(bench.board->now());
    double gone_at = 0.0;
    while (gone_at == 0.0 && virtual_board::seconds(bench.board->now()) < silent_at + time_out + 0.05) {
      ASSERT_TRUE(storm.step());
      if (!bench.board->bridge_armed(0)) gone_at = virtual_board::seconds(bench.board->now());
    }
    ASSERT_NE(gone_at, 0.0) << round;
    EXPECT_EQ(bench.fault(0), firmware::Fault::link_silent) << round;
    // A step takes up to a reset and its recovery.
    EXPECT_LT(gone_at, silent_at + time_out + 0.035) << round;
    EXPECT_EQ(bench.number("counters.missed_ticks"), 0U);
    EXPECT_EQ(bench.board->resets(), 1U);
  }
}

}  // namespace
}  // namespace kmax::tests::usb_set_ups_test
