// Two flash sectors that lose power where a test says, with words half programmed and sectors half erased.
#pragma once

#include <array>
#include <bitset>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <initializer_list>
#include <random>

#include "firmware/parameters/parameter_store.hpp"

namespace kmax::firmware {

/// Thrown in the middle of a program or an erase: the processor is gone.
struct PowerCut {};

/// A set of words of two sectors, a bit each, since every read looks one up.
class FlashWords {
 public:
  static constexpr std::size_t sector_count = 2;
  static constexpr std::size_t words_per_sector = 4096;
  struct Place {
    std::size_t sector, word;
  };

  FlashWords() = default;
  FlashWords(std::initializer_list<Place> all) {
    for (const Place& place : all) insert(place);
  }
  void insert(Place place) { sectors_.at(place.sector).set(place.word); }
  void clear() { *this = {}; }
  bool contains(Place place) const { return sectors_.at(place.sector).test(place.word); }

 private:
  std::array<std::bitset<words_per_sector>, sector_count> sectors_;
};

class FakeFlash {
 public:
  static constexpr std::size_t sector_count = FlashWords::sector_count;
  static constexpr std::size_t words_per_sector = FlashWords::words_per_sector;

  FakeFlash() {
    for (auto& sector : words) sector.fill(0xFFFF'FFFFU);
  }

  std::uint32_t read(std::size_t sector, std::size_t word) const {
    const std::uint32_t stored = words.at(sector).at(word);
    return broken.contains({sector, word}) ? stored | broken_bits : stored;
  }

  bool program(std::size_t sector, std::size_t word, std::uint32_t value) {
    std::uint32_t& stored = words.at(sector).at(word);
    if (stored != 0xFFFF'FFFFU) ++programmed_twice;
    if (operations_until_cut == 0) {
      stored &= value | noise();  // any of the bits that were to be cleared
      throw PowerCut{};
    }
    count_down();
    ++programs;
    stored &= value;
    if (after_program) after_program(sector, word);
    return !refused.contains({sector, word});
  }

  bool erase(std::size_t sector) {
    if (before_erase) before_erase(sector);
    if (operations_until_cut == 0) {
      for (std::uint32_t& word : words.at(sector)) word = half_erased(word);
      throw PowerCut{};
    }
    count_down();
    ++erases;
    if (!erase_works) return false;
    words.at(sector).fill(0xFFFF'FFFFU);
    return true;
  }

  /// How a cut leaves words: 0 nothing happened, 1 it was complete, others: bits at random, by seed.
  void cut_after(int operations, std::uint32_t pattern_seed) {
    operations_until_cut = operations;
    pattern = pattern_seed;
    random.seed(pattern_seed);
  }
  void restore_power() { operations_until_cut = -1; }

  std::array<std::array<std::uint32_t, words_per_sector>, sector_count> words;
  FlashWords broken;  ///< words of which `broken_bits` stay set
  std::uint32_t broken_bits = 0xFFFF'FFFFU;
  FlashWords refused;  ///< words whose programming is said to have failed
  bool erase_works = true;
  std::function<void(std::size_t)> before_erase;
  std::function<void(std::size_t, std::size_t)> after_program;
  int programs = 0, erases = 0, programmed_twice = 0;
  int operations_until_cut = -1;  ///< never
  std::uint32_t pattern = 0;
  std::mt19937 random;

 private:
  void count_down() {
    if (operations_until_cut > 0) --operations_until_cut;
  }
  std::uint32_t noise() {
    if (pattern == 0) return 0xFFFF'FFFFU;
    if (pattern == 1) return 0;
    return static_cast<std::uint32_t>(random());
  }
  // Some controllers clear a sector before they set it, so a half erased word may be anything.
  std::uint32_t half_erased(std::uint32_t word) {
    if (pattern == 0) return word;
    if (pattern == 1) return 0xFFFF'FFFFU;
    switch (random() % 5) {
      case 0:
        return word;
      case 1:
        return 0xFFFF'FFFFU;
      case 2:
        return word | static_cast<std::uint32_t>(random());
      case 3:
        return word & static_cast<std::uint32_t>(random());
      default:
        return static_cast<std::uint32_t>(random());
    }
  }
};
static_assert(FlashSectors<FakeFlash>);

/// A set of allowed values that keeps the rules, different for each seed.
inline ParameterValues some_values(std::uint32_t seed) {
  std::mt19937 random(seed);
  ParameterValues values;
  for (const std::size_t slot : persistent_slots) {
    const Entry& entry = entry_at(owner_of(slot).entry);
    const double share = static_cast<double>(random()) / 4294967295.0;
    std::uint32_t raw = 0;
    if (!entry.values.empty()) {
      raw = static_cast<std::uint32_t>(entry.values[random() % entry.values.size()].value);
    } else {
      raw = raw_from_number(entry.type, entry.minimum + share * (entry.maximum - entry.minimum));
    }
    const std::uint32_t before = values.raw(slot);
    if (check_value(descriptors[owner_of(slot).entry], raw) != Refusal::none) continue;
    values.set_raw(slot, raw);
    if (check_rules(values).refusal != Refusal::none) values.set_raw(slot, before);
  }
  return values;
}

using Store = ParameterStore<FakeFlash>;

inline SaveProgress save(Store& store, const ParameterValues& values) {
  store.begin(values);
  for (int steps = 0; steps < 1'000'000; ++steps) {
    const SaveProgress progress = store.step();
    if (progress != SaveProgress::busy) return progress;
  }
  return SaveProgress::busy;
}

/// What a firmware that starts now would find; the defaults if there is nothing.
inline PersistentValues loaded(FakeFlash& flash, LoadReport* report = nullptr) {
  ParameterValues values;
  const LoadReport found = Store(flash).load(values);
  if (report != nullptr) *report = found;
  return persistent_part(values);
}

}  // namespace kmax::firmware
