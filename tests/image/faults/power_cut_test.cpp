// The power goes away while a save erases and writes, with the word torn that is being written: what the
// image finds at its next start is the old set or the new one, whole.
#include <gtest/gtest.h>

#include <bit>

#include "tests/image/image_bench.hpp"
#include "tests/in_a_soak.hpp"

namespace kmax::tests::power_cut_test {

using firmware::entry_of;
using firmware::register_address;

/// Four parameters that the two sets differ in, at both ends of the record and on both axes.
struct Set {
  float stiffness, stiffness1;
  std::uint16_t law;
  float timeout;
  friend bool operator==(const Set&, const Set&) = default;
};
constexpr Set old_set{1234.5f, 2345.5f, 1, 0.75f};
constexpr Set new_set{4321.5f, 5432.5f, 2, 0.25f};

class PowerCutBench {
 public:
  /// A board whose flash holds `before` (or is erased) and whose parameters are to become `old_set`.
  explicit PowerCutBench(const std::vector<std::uint8_t>& parameter_sectors) {
    board_ = board_for_24_v(nullptr);
    std::copy(parameter_sectors.begin(), parameter_sectors.end(), sectors().begin());
    board_->run_for(0.03);
  }

  std::span<std::uint8_t> sectors() {
    return board_->chip().bus().memory(virtual_board::memory_map::parameters.base,
                                       virtual_board::memory_map::parameters.size);
  }
  std::vector<std::uint8_t> contents() { return {sectors().begin(), sectors().end()}; }

  void set(const Set& set) {
    write_real(entry_of<"wall.stiffness">(), 0, set.stiffness);
    write_real(entry_of<"wall.stiffness">(), 1, set.stiffness1);
    master().write_register(register_address(entry_of<"wall.law">(), 0), set.law);
    write_real(entry_of<"link.timeout">(), 0, set.timeout);
  }

  Set get() {
    return {read_real(entry_of<"wall.stiffness">(), 0), read_real(entry_of<"wall.stiffness">(), 1),
            master().read_holding(register_address(entry_of<"wall.law">(), 0), 1)[0],
            read_real(entry_of<"link.timeout">(), 0)};
  }

  /// False: the power was cut on the way.
  bool save() {
    try {
      master().write_register(register_address(entry_of<"store.command">(), 0), 1);
      for (int ms = 0; ms < 2000 && state() == 1; ++ms) board_->run_for(0.005);
    } catch (const std::runtime_error&) {
      if (!board_->chip().peripherals().flash.power_is_cut()) throw;
    }
    return !board_->chip().peripherals().flash.power_is_cut();
  }

  std::uint16_t state() { return master().read_input(register_address(entry_of<"store.state">(), 0), 1)[0]; }

  virtual_board::VirtualBoard& board() { return *board_; }
  virtual_board::BoardLink master() { return virtual_board::BoardLink(*board_); }

 private:
  void write_real(std::size_t entry, std::size_t axis, float value) {
    const auto raw = std::bit_cast<std::uint32_t>(value);
    master().write_holding(register_address(entry, axis), std::array{static_cast<std::uint16_t>(raw >> 16),
                                                                     static_cast<std::uint16_t>(raw)});
  }
  float read_real(std::size_t entry, std::size_t axis) {
    const auto words = master().read_holding(register_address(entry, axis), 2);
    return std::bit_cast<float>(static_cast<std::uint32_t>(words[0]) << 16 | words[1]);
  }

  std::unique_ptr<virtual_board::VirtualBoard> board_;
};

/// Flash that holds old_set, with or without room for another record in the same sector.
std::vector<std::uint8_t> prepared(bool sector_full) {
  PowerCutBench bench(std::vector<std::uint8_t>(virtual_board::memory_map::parameters.size, 0xFF));
  bench.set(old_set);
  EXPECT_TRUE(bench.save());
  if (!sector_full) return bench.contents();
  // Old and new in turn, until saving the new one erases.
  int erases_of_the_old = 0;
  for (int saves = 0; saves < 200; ++saves) {
    const bool to_new = saves % 2 == 0;
    const auto before = bench.contents();
    bench.set(to_new ? new_set : old_set);
    EXPECT_TRUE(bench.save());
    const auto after = bench.contents();
    bool erased = false;
    for (std::size_t i = 0; i < after.size(); ++i) erased = erased || (after[i] & ~before[i]) != 0;
    if (erased && to_new) return before;
    if (!erased) continue;
    // Whatever number of records a sector takes: the two kinds change places at every other erase.
    if (++erases_of_the_old % 2 != 0) continue;
    bench.set({3333.5f, 1111.5f, 1, 0.5f});
    EXPECT_TRUE(bench.save());
  }
  ADD_FAILURE() << "no save ever erased";
  return {};
}

// Each cut boots a board twice, so not every word: the first and the last ones, where a record and its sector
// begin and end, and some between, an odd number apart so that both words of a value are met. The store
// itself is cut at every word in tests/firmware/parameters/parameter_store_power_cut_test.cpp; this shows
// that the image erases, writes and starts as it does there. A soak tries five times as many.
bool is_tried(std::uint64_t cut, std::uint64_t operations) {
  static const bool soak = in_a_soak();
  const std::uint64_t at_the_ends = soak ? 24 : 4, between = soak ? 7 : 47;
  return cut <= at_the_ends || cut + at_the_ends > operations || cut % between == 0;
}

void cut_all_along(const std::vector<std::uint8_t>& before) {
  std::uint64_t operations = 0;
  {
    PowerCutBench bench(before);
    ASSERT_EQ(bench.get(), old_set);
    bench.set(new_set);
    const auto start = bench.board().chip().peripherals().flash.operations();
    ASSERT_TRUE(bench.save());
    operations = bench.board().chip().peripherals().flash.operations() - start;
  }
  ASSERT_GT(operations, 100u);
  std::uint64_t old_sets = 0, new_sets = 0;
  for (std::uint64_t cut = 1; cut <= operations; ++cut) {
    if (!is_tried(cut, operations)) continue;
    PowerCutBench bench(before);
    bench.set(new_set);
    bench.board().chip().peripherals().flash.cut_power_after(cut, cut * 7919);
    ASSERT_FALSE(bench.save()) << "cut " << cut;
    const auto cut_at = bench.board().now();
    bench.board().cycle_power();
    bench.board().run_for(0.03);
    ASSERT_GE(virtual_board::seconds(bench.board().now() - cut_at), 0.03) << "cut " << cut;
    const Set found = bench.get();
    if (found == new_set) {
      ++new_sets;
    } else {
      ASSERT_EQ(found, old_set) << "after cut " << cut << " of " << operations;
      ++old_sets;
    }
    // And it is no dead end.
    if (cut % 2 == 0) {
      bench.set(new_set);
      ASSERT_TRUE(bench.save());
      ASSERT_EQ(bench.state(), 2) << "saved";
    }
  }
  EXPECT_GT(old_sets, 0u);
  std::printf("cuts along %llu words: %llu times the old set, %llu times the new one\n",
              static_cast<unsigned long long>(operations), static_cast<unsigned long long>(old_sets),
              static_cast<unsigned long long>(new_sets));
}

TEST(PowerCut, AlongASaveLeavesTheOldSetOrTheNew) {
  cut_all_along(prepared(false));
}

TEST(PowerCut, AlongASaveThatChangesTheSectorToo) {
  cut_all_along(prepared(true));
}

}  // namespace kmax::tests::power_cut_test
