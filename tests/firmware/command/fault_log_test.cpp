#include "firmware/command/fault_log.hpp"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <algorithm>
#include <cstring>
#include <vector>

namespace kmax::firmware::fault_log_test {
namespace {

/// The processor is gone, in the middle of a store.
struct Reset {};

/// Memory whose stores end where a test says, the last of them after some of its bytes.
struct Word {
  static inline std::size_t bytes_until_reset = SIZE_MAX;

  std::uint32_t value = 0;
  operator std::uint32_t() const { return value; }  // NOLINT(google-explicit-constructor)
  Word& operator=(std::uint32_t wanted) {
    const std::size_t bytes = std::min<std::size_t>(4, bytes_until_reset);
    std::memcpy(&value, &wanted, bytes);
    bytes_until_reset -= bytes;
    if (bytes < 4) throw Reset{};
    return *this;
  }
};
using Log = FaultLogIn<Word>;
using Memory = std::array<Word, Log::memory_words>;
using Entries = std::vector<LogEntry>;

/// As a host sees it, the oldest first; each whole.
Entries shown(const Log& log) {
  Entries entries;
  for (std::size_t place = 0; place < fault_log_entries; ++place) {
    LogWords words{};
    for (std::size_t i = 0; i < words.size(); ++i) words[i] = log.word(place, i);
    const auto entry = std::bit_cast<LogEntry>(words);
    if (entry.event == LogEvent::none) continue;
    EXPECT_EQ(log.word(place, words.size()), log_crc(words));
    EXPECT_EQ(entry.number % fault_log_entries, place);
    entries.push_back(entry);
  }
  std::ranges::sort(entries, [&log](const LogEntry& a, const LogEntry& b) {
    return log.newest() - a.number > log.newest() - b.number;
  });
  return entries;
}

/// What the log ought to be, written another way: all entries since power-on, erasures among them.
struct Model {
  Entries all;
  std::uint16_t start = 1;

  Model with(LogEntry entry) const {
    Model next = *this;
    entry.number = all.empty() ? 1 : all.back().number + 1;
    entry.start = start;
    next.all.push_back(entry);
    return next;
  }
  Model restarted(ResetCause cause, const CrashRecord& crash) const {
    if (cause == ResetCause::power_on) return {};
    Model next = *this;
    next.start = all.empty() ? std::uint16_t{2} : static_cast<std::uint16_t>(all.back().start + 1);
    LogEntry entry{.event = LogEvent::start, .code = static_cast<std::uint16_t>(cause)};
    if (crash.is_new)
      entry.numbers = {crash.count, 1U | 3U << 16, crash.program_counter, 5, 6, 7, crash.address};
    if (!all.empty() && all.back().event == LogEvent::start && all.back().count < 0xFFFF &&
        all.back().code == entry.code &&
        std::equal(entry.numbers.begin() + 1, entry.numbers.end(), all.back().numbers.begin() + 1)) {
      next.all.back().start = next.start;
      next.all.back().count++;
      next.all.back().numbers[0] = entry.numbers[0];
      return next;
    }
    return next.with(entry);
  }
  Entries shown() const {
    Entries newest(all.size() > 16 ? all.end() - 16 : all.begin(), all.end());
    const auto erased = std::find_if(newest.rbegin(), newest.rend(),
                                     [](const LogEntry& entry) { return entry.event == LogEvent::erased; });
    newest.erase(newest.begin(), erased.base());
    return newest;
  }
};

CrashRecord drawn_crash() {
  CrashRecord crash;
  crash.is_new = *rc::gen::weightedElement<bool>({{1, true}, {1, false}});
  crash.count = *rc::gen::inRange(1U, 4U);
  crash.cause = CrashCause::fault;
  crash.exception_number = 3;
  crash.program_counter = *rc::gen::element(0x0800'C000U, 0x0801'0000U);
  crash.link_register = 5, crash.status = 6, crash.hard_fault_status = 7;
  crash.address = 0x2000'0000;
  return crash;
}

std::array<float, 10> drawn_numbers() {
  std::array<float, 10> numbers{};
  for (float& number : numbers) number = static_cast<float>(*rc::gen::inRange(-1000, 1000)) * 0.125f;
  return numbers;
}

/// An entry as an earlier run has left it.
void plant(Memory& memory, std::size_t slot, const LogEntry& entry) {
  const auto words = std::bit_cast<LogWords>(entry);
  for (std::size_t i = 0; i < words.size(); ++i) memory[slot * fault_log_words + i].value = words[i];
  memory[slot * fault_log_words + words.size()].value = log_crc(words);
}

// A reset at any byte of any store, of a trip, an erasure, or the start after the reset before: an entry is
// there whole or not at all, nothing else is lost or changed, and what comes after it is as if nothing had
// happened.
RC_GTEST_PROP(FaultLog, KeepsTheNewestSixteenWholeOverResetsAtAnyByte, ()) {
  Memory memory{};
  Model model;
  Word::bytes_until_reset = SIZE_MAX;
  std::optional<Log> log(std::in_place, memory, ResetCause::power_on, CrashRecord{});
  if (*rc::gen::arbitrary<bool>()) {
    // Shortly before its counters wrap.
    LogEntry before{.number = *rc::gen::inRange(0xFFFF'FFE0U, 0xFFFF'FFFFU),
                    .start = static_cast<std::uint16_t>(*rc::gen::inRange(0xFFF8U, 0xFFFFU)),
                    .count = static_cast<std::uint16_t>(*rc::gen::inRange(0xFFF8U, 0xFFFFU)),
                    .event = LogEvent::start,
                    .code = static_cast<std::uint16_t>(ResetCause::pin)};
    plant(memory, *rc::gen::inRange<std::size_t>(0, Log::slots), before);
    model.all = {before};
    model = model.restarted(ResetCause::pin, {});
    log.emplace(memory, ResetCause::pin, CrashRecord{});
  }
  const int steps = *rc::gen::inRange(1, 60);
  for (int step = 0; step < steps; ++step) {
    // One entry takes 64 bytes, and what it replaces 4.
    Word::bytes_until_reset = *rc::gen::weightedOneOf<std::size_t>(
        {{3, rc::gen::just<std::size_t>(SIZE_MAX)}, {2, rc::gen::inRange<std::size_t>(0, 70)}});
    const int kind = *rc::gen::weightedElement<int>({{8, 0}, {1, 1}, {4, 2}});
    const auto axis = *rc::gen::inRange<std::size_t>(0, 2);
    const auto numbers = drawn_numbers();
    const auto cause = *rc::gen::weightedElement<ResetCause>({{8, ResetCause::pin},
                                                              {8, ResetCause::software},
                                                              {8, ResetCause::independent_watchdog},
                                                              {4, ResetCause::brown_out},
                                                              {1, ResetCause::power_on}});
    const CrashRecord crash = cause == ResetCause::software ? drawn_crash() : CrashRecord{};
    LogEntry wanted{.event = LogEvent::erased};
    if (kind == 0)
      wanted = {.tick = 7U * static_cast<unsigned>(step),
                .event = LogEvent::trip,
                .axis = static_cast<std::uint8_t>(axis),
                .code = 0x8130};
    for (std::size_t i = 0; kind == 0 && i < numbers.size(); ++i)
      wanted.numbers[i] = std::bit_cast<std::uint32_t>(numbers[i]);
    const Model after = kind == 2 ? model.restarted(cause, crash) : model.with(wanted);
    bool whole = true;
    try {
      if (kind == 0) log->add_trip(axis, wanted.code, wanted.tick, numbers);
      if (kind == 1) log->erase();
      if (kind == 2) log.emplace(memory, cause, crash);
    } catch (const Reset&) {
      whole = false;
    }
    Word::bytes_until_reset = SIZE_MAX;
    if (!whole) {
      // The next start tells which of the two it was; after a power-on that was cut comes another.
      const auto next = kind == 2 && cause == ResetCause::power_on ? cause : ResetCause::low_power;
      log.emplace(memory, next, CrashRecord{});
      const Model without = model.restarted(next, {}), with = after.restarted(next, {});
      model = shown(*log) == without.shown() ? without : with;
    } else {
      model = after;
    }
    RC_ASSERT(shown(*log) == model.shown());
    RC_ASSERT(log->start() == model.start);
  }
}

RC_GTEST_PROP(FaultLog, GarbageIsNoEntry, ()) {
  Memory memory{};
  const auto seed = *rc::gen::arbitrary<std::uint32_t>();
  std::uint32_t random = seed | 1U;
  for (Word& word : memory) word.value = random = random * 1664525U + 1013904223U;
  if (seed % 4 == 0) memory.fill({0xFFFF'FFFF});
  if (seed % 4 == 1) memory.fill({0});
  const Log log(memory, ResetCause::brown_out, {});
  RC_ASSERT(shown(log).size() == 1U);
  RC_ASSERT(shown(log)[0].event == LogEvent::start);
  RC_ASSERT(shown(log)[0].code == static_cast<unsigned>(ResetCause::brown_out));
  RC_ASSERT(log.start() == 2U);
}

// Bits that have turned over in the dark, as after a short loss of power.
RC_GTEST_PROP(FaultLog, AnEntryWithAnyBitsChangedIsGoneAndTheOthersStay, ()) {
  Memory memory{};
  {
    Log log(memory, ResetCause::power_on, {});
    for (int i = 0; i < 5; ++i) log.add_trip(0, 0x8130, 0, {static_cast<float>(i)});
  }
  const auto slot = *rc::gen::inRange<std::size_t>(0, 5);
  const int flips = *rc::gen::inRange(1, 4);
  std::uint32_t changed = 0;
  for (int i = 0; i < flips; ++i) {
    const auto word = *rc::gen::inRange<std::size_t>(0, fault_log_words);
    const std::uint32_t bit = 1U << *rc::gen::inRange(0, 32);
    memory[slot * fault_log_words + word].value ^= bit;
    changed ^= bit + static_cast<std::uint32_t>(word);
  }
  RC_PRE(changed != 0U);
  const Log log(memory, ResetCause::pin, {});
  const Entries left = shown(log);
  RC_ASSERT(left.size() == 5U);
  for (const LogEntry& entry : left) RC_ASSERT(entry.event == LogEvent::start || entry.number != slot + 1);
}

TEST(FaultLog, PowerOnEmptiesItAndAnyOtherStartDoesNot) {
  Memory memory{};
  Log(memory, ResetCause::power_on, {}).add_trip(1, 0x8480, 123, {5.5f, 5.0f});
  const Log kept(memory, ResetCause::independent_watchdog, {});
  const Entries entries = shown(kept);
  ASSERT_EQ(entries.size(), 2U);
  EXPECT_EQ(entries[0].number, 1U);
  EXPECT_EQ(entries[0].start, 1U);
  EXPECT_EQ(entries[0].axis, 1U);
  EXPECT_EQ(entries[0].code, 0x8480);
  EXPECT_EQ(entries[0].tick, 123U);
  EXPECT_EQ(std::bit_cast<float>(entries[0].numbers[1]), 5.0f);
  EXPECT_EQ(entries[1].event, LogEvent::start);
  EXPECT_EQ(entries[1].start, 2U);
  EXPECT_EQ(entries[1].code, static_cast<unsigned>(ResetCause::independent_watchdog));
  const Log empty(memory, ResetCause::power_on, {});
  EXPECT_TRUE(shown(empty).empty());
  EXPECT_EQ(empty.newest(), 0U);
  EXPECT_EQ(empty.start(), 1U);
}

TEST(FaultLog, StartsInACircleDriveNothingOut) {
  Memory memory{};
  Log(memory, ResetCause::power_on, {}).add_trip(0, 0x7305, 0, {});
  CrashRecord crash;
  crash.cause = CrashCause::fault;
  crash.program_counter = 0x0800'C123;
  crash.is_new = true;
  for (crash.count = 1; crash.count <= 1000; ++crash.count) Log(memory, ResetCause::software, crash);
  const Log log(memory, ResetCause::pin, {});
  const Entries entries = shown(log);
  ASSERT_EQ(entries.size(), 3U);
  EXPECT_EQ(entries[0].code, 0x7305);
  EXPECT_EQ(entries[1].count, 1000U);
  EXPECT_EQ(entries[1].numbers[static_cast<std::size_t>(CrashNumber::count)], 1000U);
  EXPECT_EQ(entries[1].numbers[static_cast<std::size_t>(CrashNumber::program_counter)], 0x0800'C123U);
  EXPECT_EQ(entries[2].count, 1U);
  EXPECT_EQ(entries[2].numbers, LogEntry{}.numbers) << "the crash was not before this start";
  EXPECT_EQ(log.start(), 1002U);
}

TEST(FaultLog, ErasedItGoesOnCounting) {
  Memory memory{};
  Log log(memory, ResetCause::power_on, {});
  for (int i = 0; i < 20; ++i) log.add_trip(0, 0x7305, 0, {});
  log.erase();
  EXPECT_TRUE(shown(log).empty());
  EXPECT_EQ(log.newest(), 21U);
  log.add_trip(0, 0x7305, 0, {});
  const Log later(memory, ResetCause::pin, {});
  ASSERT_EQ(shown(later).size(), 2U);
  EXPECT_EQ(shown(later)[0].number, 22U);
  EXPECT_EQ(later.start(), 2U);
}

// From the first poll on, over the wrap of its clock and however late the next poll is.
TEST(FaultLog, CountsWholeSecondsAndEntriesHaveThem) {
  Memory memory{};
  Log log(memory, ResetCause::native, {});
  constexpr std::uint32_t begin = 0xFFFF'FF00;
  log.count_time(begin);
  EXPECT_EQ(log.uptime_s(), 0U);
  log.count_time(begin + 999'999);
  EXPECT_EQ(log.uptime_s(), 0U);
  log.count_time(begin + 1'000'000);
  EXPECT_EQ(log.uptime_s(), 1U);
  log.count_time(begin + 3'999'999);
  EXPECT_EQ(log.uptime_s(), 3U);
  log.count_time(begin + 4'000'000);
  log.add_trip(0, 0x7305, 0, {});
  EXPECT_EQ(shown(log).back().uptime_s, 4U);
}

TEST(FaultLog, AStartOfTheNativeBoardIsAPowerOn) {
  Memory memory{};
  Log(memory, ResetCause::power_on, {}).add_trip(0, 0x7305, 0, {});
  const Log log(memory, ResetCause::native, {});
  EXPECT_TRUE(shown(log).empty());
  EXPECT_EQ(log.start(), 1U);
}

// Hosts read the words, and the next release what this one has left.
TEST(FaultLog, ItsLayoutIsTheProtocols) {
  EXPECT_EQ(fault_log_entries, 16U);
  EXPECT_EQ(fault_log_words, 16U);
  EXPECT_EQ(Log::memory_words, 17U * 16U);
  const LogEntry entry{.number = 0x0102'0304,
                       .start = 0x0506,
                       .count = 0x0708,
                       .uptime_s = 9,
                       .tick = 10,
                       .event = LogEvent::start,
                       .axis = 1,
                       .code = 0x8130};
  const auto words = std::bit_cast<LogWords>(entry);
  EXPECT_EQ(words[0], 0x0102'0304U);
  EXPECT_EQ(words[1], 0x0708'0506U);
  EXPECT_EQ(words[2], 9U);
  EXPECT_EQ(words[3], 10U);
  EXPECT_EQ(words[4], 0x8130'0100U | static_cast<unsigned>(LogEvent::start));
  Crc32 crc;
  for (const std::uint32_t word : {0x4B4C'0001U, 0U, 0U, 0U, 0U, 0U, 0U, 0U, 0U, 0U, 0U, 0U, 0U, 0U, 0U, 0U})
    crc.add(word);
  EXPECT_EQ(log_crc({}), crc.value());
}

TEST(FaultLog, WithTooLittleMemoryKeepsNothing) {
  std::array<Word, Log::memory_words - 1> memory{};
  Log log(memory, ResetCause::pin, {});
  log.add_trip(0, 0x7305, 0, {});
  log.erase();
  EXPECT_TRUE(shown(log).empty());
  EXPECT_TRUE(std::ranges::all_of(memory, [](const Word& word) { return word.value == 0; }));
}

}  // namespace
}  // namespace kmax::firmware::fault_log_test
