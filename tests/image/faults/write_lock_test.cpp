// The write lock of the flashed image over both links, each kind of start, and what a factory reset leaves.
// What each object does while it is locked is tried in tests/board/write_lock_test.cpp.
#include <gtest/gtest.h>

#include <algorithm>
#include <bit>

#include "host_tools/flash/chip_memory.hpp"
#include "tests/image/can_bench.hpp"

namespace kmax::tests::write_lock_test {
namespace {

using firmware::canopen::Abort;

constexpr std::uint32_t code = 4711, another = 815;
constexpr unsigned no_code = 0, open = 1, locked = 2;

class Bench : public CanBench {
 public:
  Bench() : CanBench({{"wall.law", std::string("none")}, {"link.timeout", 0.0}}) { start(); }

  /// 0: taken; else the exception.
  int write_register(std::string_view name, std::uint32_t raw) {
    const std::size_t entry = firmware::find_entry(name);
    std::array words{static_cast<std::uint16_t>(raw >> 16), static_cast<std::uint16_t>(raw)};
    const std::size_t count = firmware::register_count(firmware::entry_at(entry).type);
    try {
      master->write_holding(firmware::register_address(entry, 0), std::span(words).last(count));
    } catch (const device::RegisterRefused& refused) {
      return refused.exception();
    }
    return 0;
  }
  /// Abort::none: taken.
  Abort write_object(std::uint16_t index, std::uint8_t subindex, std::uint32_t value, std::size_t size) {
    try {
      write(index, subindex, value, size);
    } catch (const device::SdoAborted& aborted) {
      return aborted.code();
    }
    return Abort::none;
  }
  Abort turn_key(std::uint32_t key) { return write_object(0x5809, 1, key, 4); }
  float stiffness() {
    const auto words =
        master->read_holding(firmware::register_address(firmware::find_entry("wall.stiffness"), 0), 2);
    return std::bit_cast<float>(std::uint32_t{words[0]} << 16 | words[1]);
  }
  void wait_for_store() {
    while (number("store.state") == 1) board->run_for(5e-3);
  }
  std::span<std::uint8_t> stored() {
    return board->chip().bus().memory(flash::stm32f405_memory.parameters_begin(),
                                      flash::stm32f405_memory.parameters_size());
  }
};

/// All that would change the device, and stay.
void expect_locked(Bench& bench, const char* when) {
  EXPECT_EQ(bench.number("lock.state"), locked) << when;
  EXPECT_EQ(bench.write_register("wall.stiffness", std::bit_cast<std::uint32_t>(777.0f)), 7) << when;
  EXPECT_EQ(bench.write_object(0x2000, 4, std::bit_cast<std::uint32_t>(777.0f), 4), Abort::unsupported_access)
      << when;
  EXPECT_EQ(bench.write_object(0x1017, 0, 1234, 2), Abort::unsupported_access) << when;
  EXPECT_EQ(bench.write_object(0x1010, 1, firmware::signature_save, 4), Abort::unsupported_access) << when;
  EXPECT_EQ(bench.write_register("store.command", 2), 7) << when;
  EXPECT_EQ(bench.write_register("log.command", 1), 7) << when;
  EXPECT_EQ(bench.write_register("lock.code", another), 7) << when;
  EXPECT_EQ(bench.stiffness(), 512.0f) << when;
}

TEST(ImageWriteLock, HoldsOverEveryStartUntilItsCodeOrAFactoryResetOpensIt) {
  Bench bench;
  ASSERT_EQ(bench.number("lock.state"), no_code);
  ASSERT_EQ(bench.write_register("wall.stiffness", std::bit_cast<std::uint32_t>(512.0f)), 0);
  ASSERT_EQ(bench.write_register("store.command", 1), 0);
  bench.wait_for_store();
  ASSERT_EQ(bench.write_object(0x5808, 1, code, 4), Abort::none);
  bench.wait_for_store();
  expect_locked(bench, "set");
  EXPECT_EQ(bench.arm() & 0x6FU, 0x27U) << "it can be used";
  EXPECT_EQ(bench.turn_key(code), Abort::device_state) << "not while armed";
  bench.write(0x6040, 0, 0, 2);
  bench.board->run_for(5e-3);

  // A wrong code makes both links wait, and a reset starts the wait again.
  EXPECT_EQ(bench.turn_key(another), Abort::value_range);
  EXPECT_EQ(bench.write_register("lock.key", code), 6);
  bench.board->run_for(0.8);
  bench.board->pull_reset();
  bench.start();
  bench.board->run_for(0.5);
  EXPECT_EQ(bench.number("lock.attempts"), 1U);
  EXPECT_EQ(bench.number("lock.wait"), 1U);
  EXPECT_EQ(bench.turn_key(code), Abort::device_state) << "1.3 s after the wrong one";
  expect_locked(bench, "reset");
  bench.board->run_for(0.6);
  EXPECT_EQ(bench.write_register("lock.key", code), 0);
  EXPECT_EQ(bench.number("lock.state"), open);
  EXPECT_EQ(bench.write_object(0x2000, 4, std::bit_cast<std::uint32_t>(600.0f), 4), Abort::none);
  EXPECT_EQ(bench.stiffness(), 600.0f);

  // The supply forgets the count, not the code, nor what was kept with it.
  EXPECT_EQ(bench.turn_key(0), Abort::none);
  EXPECT_EQ(bench.turn_key(another), Abort::value_range);
  bench.board->cycle_power();
  bench.start();
  EXPECT_EQ(bench.number("lock.attempts"), 0U);
  expect_locked(bench, "power-on");

  // What 'kmax flash --factory-reset' has the board's bootloader or debugger erase.
  std::ranges::fill(bench.stored(), std::uint8_t{0xFF});
  bench.board->cycle_power();
  bench.start();
  EXPECT_EQ(bench.number("lock.state"), no_code);
  EXPECT_NE(bench.stiffness(), 512.0f);
  EXPECT_EQ(bench.write_register("wall.stiffness", std::bit_cast<std::uint32_t>(777.0f)), 0);
  EXPECT_EQ(bench.turn_key(code), Abort::device_state) << "there is no code";
}

}  // namespace
}  // namespace kmax::tests::write_lock_test
