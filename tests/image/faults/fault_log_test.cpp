// The fault log of the flashed image over every kind of reset: what it says then, that a reset in the middle
// of an entry leaves no wrong one, and that power-on leaves none.
#include <gtest/gtest.h>

#include <algorithm>

#include "host_tools/device/fault_log.hpp"
#include "tests/image/can_bench.hpp"

namespace kmax::tests::fault_log_test {
namespace {

using firmware::LogEntry;
using firmware::ResetCause;
using firmware::TripNumber;

class Bench : public CanBench {
 public:
  Bench() : CanBench({{"link.timeout", 0.0}, {"axis0.wall.law", std::string("none")}}) { start(); }

  std::vector<LogEntry> log() { return device::read_fault_log(*master); }
  std::vector<std::string> names() {
    std::vector<std::string> all;
    for (const LogEntry& entry : log()) all.push_back(device::name_of(entry));
    return all;
  }
  void command(unsigned word) {
    master->write_register(firmware::register_address(firmware::entry_of<"drive.controlword">(), 0),
                           static_cast<std::uint16_t>(word));
  }
  /// Axis 0 by the emergency stop, which is closed again; the fault stays.
  void trip() {
    for (const unsigned word : {0x00, 0x80, 0x00, 0x06, 0x0F}) command(word);
    ASSERT_TRUE(board->bridge_armed(0));
    board->open_emergency_stop(true);
    board->run_for(2e-3);
    board->open_emergency_stop(false);
  }
  /// An instruction of the image that looks like this is next.
  std::uint32_t go_on_with(std::uint16_t instruction, std::uint16_t mask) {
    const auto flash = board->chip().bus().flash();
    for (std::size_t at = 98 * sizeof(std::uint32_t); at + 1 < flash.size(); at += 2) {
      if (((flash[at] | flash[at + 1] << 8) & mask) != instruction) continue;
      const auto address = static_cast<std::uint32_t>(virtual_board::memory_map::flash.base + at);
      board->chip().processor().set_core_register(15, address);
      return address;
    }
    throw std::runtime_error("the image does not have the instruction");
  }
  void wait_for_restart() {
    const auto before = board->resets();
    for (int i = 0; i < 3000 && board->resets() == before; ++i) board->run_for(1e-3);
    ASSERT_EQ(board->resets(), before + 1);
    board->run_for(0.2);
  }
};

TEST(ImageFaultLog, OutlivesEveryResetAndSaysWhatItWas) {
  Bench bench;
  EXPECT_TRUE(bench.log().empty());
  bench.trip();
  bench.board->pull_reset();
  bench.start();
  EXPECT_EQ(bench.names(), (std::vector<std::string>{"reset line pulled", "emergency_stop"}));

  const LogEntry trip = bench.log().back();
  EXPECT_EQ(trip.number, 1U);
  EXPECT_EQ(trip.start, 1U);
  EXPECT_EQ(trip.axis, 0U);
  EXPECT_NEAR(device::number_of(trip, TripNumber::supply), 24.0, 0.2);
  EXPECT_NEAR(device::number_of(trip, TripNumber::temperature), 25.0, 2.0);
  EXPECT_GT(trip.tick, 0U);
  EXPECT_LT(trip.tick, 20'000U);

  bench.nmt(0x81);
  bench.wait_for_restart();
  bench.start();
  EXPECT_EQ(bench.names(),
            (std::vector<std::string>{"restart by software", "reset line pulled", "emergency_stop"}));

  bench.trip();
  bench.go_on_with(0xE7FE, 0xFFFF);  // for ever
  bench.wait_for_restart();
  bench.start();
  EXPECT_EQ(bench.names(),
            (std::vector<std::string>{"reset by the watchdog", "emergency_stop", "restart by software",
                                      "reset line pulled", "emergency_stop"}));
  EXPECT_EQ(bench.ImageBench::number("log.start"), 4U);

  bench.board->cycle_power();
  bench.start();
  EXPECT_TRUE(bench.log().empty());
  EXPECT_EQ(bench.ImageBench::number("log.start"), 1U);
  EXPECT_EQ(bench.ImageBench::number("log.newest"), 0U);
}

// The 3.3 V of the logic sag with the supply. Without the brown-out reset the processor would go on at 168
// MHz.
TEST(ImageFaultLog, ASupplyThatSagsIsABrownOut) {
  for (const unsigned level : {0U, 3U}) {
    virtual_board::VirtualBoardConfig config;
    config.brown_out_level = level;
    ImageBench bench({}, 0.0, "motor_axes", config);
    bench.start();
    EXPECT_EQ(bench.number("info.brown_out_level"), level);
    const auto sag = [&bench](double volts) {
      bench.world.supply().set_source(volts);
      bench.world.supply().set_voltage(volts);
      bench.board->run_for(0.02);
    };
    if (level != 0) {
      EXPECT_THROW(sag(3.5), std::runtime_error);
      continue;
    }
    sag(3.5);
    EXPECT_FALSE(bench.board->gates_active(0));
    EXPECT_FALSE(bench.board->healthy());
    sag(24.0);
    bench.start();
    EXPECT_EQ(bench.number("info.reset_cause"), static_cast<unsigned>(ResetCause::brown_out));
  }
}

TEST(ImageFaultLog, NamesTheCrashOnceAndWhereItWas) {
  virtual_board::VirtualBoardConfig as_on_the_chip;
  as_on_the_chip.processor.faults_to_firmware = true;
  ImageBench bench({}, 0.0, "motor_axes", as_on_the_chip);
  bench.start();
  std::uint32_t at = 0;
  for (unsigned crashes = 1; crashes <= 2; ++crashes) {
    const auto flash = bench.board->chip().bus().flash();
    for (at = 0xC000; (flash[at + 1]) != 0xDE; at += 2) {
    }
    at += static_cast<std::uint32_t>(virtual_board::memory_map::flash.base);
    bench.board->chip().processor().set_core_register(14, at);  // else where the main loop happened to be
    bench.board->chip().processor().set_core_register(15, at);
    bench.board->run_for(0.2);
    bench.start();
    const auto log = device::read_fault_log(*bench.master);
    ASSERT_EQ(log.size(), 1U);
    EXPECT_EQ(device::name_of(log[0]), "crash of the firmware");
    EXPECT_EQ(log[0].count, crashes);
    EXPECT_EQ(log[0].code, static_cast<unsigned>(ResetCause::software));
    EXPECT_EQ(device::crash_before(log[0]).program_counter, at);
    EXPECT_EQ(device::crash_before(log[0]).count, crashes);
  }
  bench.board->pull_reset();
  bench.start();
  const auto log = device::read_fault_log(*bench.master);
  ASSERT_EQ(log.size(), 2U);
  EXPECT_EQ(device::name_of(log[0]), "reset line pulled");
  EXPECT_EQ(device::crash_before(log[0]).count, 0U) << "the crash was before an earlier start";
}

// Reading fails where an entry is not whole.
TEST(ImageFaultLog, AResetInTheMiddleOfAnEntryLeavesItWholeOrOut) {
  Bench bench;
  std::size_t entries = 0, with = 0, without = 0;
  const base::ElfSymbol log_memory =
      tests::image().required_symbol("_ZN4kmax5board12_GLOBAL__N_110log_memoryE");
  const auto memory = bench.board->chip().bus().memory(log_memory.address, log_memory.size);
  // Later each time, from its first store on to behind the ticks of both axes, which may come in between.
  constexpr double step = 0.7e-6;
  for (int i = 0; i < 40; ++i) {
    for (const unsigned word : {0x00, 0x80, 0x00, 0x06, 0x0F}) bench.command(word);
    ASSERT_TRUE(bench.board->bridge_armed(0));
    const std::vector<std::uint8_t> before(memory.begin(), memory.end());
    bench.board->open_emergency_stop(true);
    for (int waited = 0; waited < 4000 && std::ranges::equal(before, memory); ++waited)
      bench.board->run_for(0.5e-6);
    ASSERT_FALSE(std::ranges::equal(before, memory));
    bench.board->run_for(step * i);
    bench.board->pull_reset();
    bench.board->open_emergency_stop(false);
    bench.start();
    const auto log = bench.log();
    ASSERT_FALSE(log.empty());
    EXPECT_EQ(device::name_of(log[0]), "reset line pulled");
    const bool logged = log.size() > 1 && device::name_of(log[1]) == "emergency_stop" && log[0].count == 1;
    (logged ? with : without)++;
    EXPECT_EQ(log.size(),
              std::min<std::size_t>(16, i == 0 || logged ? entries + 1 + (logged ? 1 : 0) : entries))
        << i;
    entries = log.size();
  }
  EXPECT_GT(with, 0U);
  EXPECT_GT(without, 0U);
}

TEST(ImageFaultLog, IsTheSameOverBothLinks) {
  Bench bench;
  bench.trip();
  bench.board->pull_reset();
  bench.start();
  for (std::size_t place = 0; place < firmware::fault_log_entries; ++place) {
    const auto bytes = bench.sdo.upload({0x5828, static_cast<std::uint8_t>(place + 1)});
    const auto words = bench.master->read_log_entry(place);
    ASSERT_EQ(bytes.size(), 4 * words.size());
    for (std::size_t i = 0; i < bytes.size(); ++i)
      ASSERT_EQ(bytes[i], static_cast<std::uint8_t>(words[i / 4] >> 8 * (i % 4))) << place << ", " << i;
  }
}

}  // namespace
}  // namespace kmax::tests::fault_log_test
