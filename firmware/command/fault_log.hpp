#pragma once

#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>

#include "firmware/board_interface/crash_record.hpp"
#include "firmware/object_dictionary/register_windows.hpp"
#include "firmware/parameters/crc32.hpp"

namespace kmax::firmware {

/// What an entry of the fault log is about. The numbers are part of the protocol.
enum class LogEvent : std::uint8_t {
  none = 0,    ///< no entry
  trip = 1,    ///< an axis has lost its force by a fault
  start = 2,   ///< a start of the processor that is no power-on
  erased = 3,  ///< never shown: all that is older has been erased
};

/// One entry of the fault log, as hosts read it: so many 32-bit words, the smaller members in the low bits of
/// theirs first. Behind it is the CRC that it is kept with, by which a reader knows that it has it whole.
struct LogEntry {
  std::uint32_t number = 0;              ///< one more than that of the entry before; wraps
  std::uint16_t start = 0, count = 1;    ///< of which start since power-on; how many in a row were the same
  std::uint32_t uptime_s = 0, tick = 0;  ///< since that start
  LogEvent event = LogEvent::none;
  std::uint8_t axis = 0;   ///< of a trip
  std::uint16_t code = 0;  ///< of a trip its error code, of a start the ResetCause
  /// Of a trip float32, by TripNumber; of a start what crashed before it, by CrashNumber, zeros if nothing
  /// did.
  std::array<std::uint32_t, 10> numbers{};

  friend constexpr bool operator==(const LogEntry&, const LogEntry&) = default;
};

/// Places in LogEntry::numbers.
enum class TripNumber : std::uint8_t {
  value,
  bound,
  position,
  velocity,
  force,
  current,
  current_reference,
  supply,
  temperature,
  winding_temperature,
};
enum class CrashNumber : std::uint8_t {
  count,
  cause_and_exception,
  program_counter,
  link_register,
  status,
  hard_fault_status,
  address,
};

using LogWords = std::array<std::uint32_t, fault_log_words - 1>;  ///< without the CRC
static_assert(sizeof(LogEntry) == sizeof(LogWords));

constexpr std::uint32_t log_crc(const LogWords& words) {
  Crc32 crc;
  crc.add(0x4B4C'0001);  // of this layout: what another release has left is not read by it
  for (const std::uint32_t word : words) crc.add(word);
  return crc.value();
}

/// The last 16 faults and unasked starts, in a memory that outlives a reset: what it was that let the handle
/// go is still there when somebody looks, after a restart, a watchdog or a crash.
///
/// An entry is whole or not there, at whatever store a reset comes: each is checked by its own CRC, a new one
/// is written where there is none, and only then the oldest goes. So garbage, as after power-on, is no entry
/// either. A start like the one before it (a program that crashes in a circle) only counts that one up, lest
/// it drive out what came before.
///
/// It does not outlive a loss of power. It could in flash: but to program an entry there stops the ticks for
/// five of them, and to erase a sector for half a second, when the device is to be armed again; whoever wants
/// to keep a log reads it.
///
/// Main loop only; what it costs, about 2000 instructions, falls due in the poll that finds a trip. `Word` is
/// what the memory is made of, in the order of its stores.
template <typename Word>
class FaultLogIn {
 public:
  static constexpr std::size_t slots = fault_log_entries + 1;
  static constexpr std::size_t memory_words = slots * fault_log_words;

  /// Takes up what is in `memory`, which outlives it, and adds the start if it is one to be told. A memory of
  /// fewer than memory_words: nothing is kept.
  [[gnu::cold]] FaultLogIn(std::span<Word> memory, ResetCause cause, const CrashRecord& crash)
      : memory_(memory.size() < memory_words ? std::span<Word>{} : memory.first(memory_words)) {
    const bool anew = cause == ResetCause::power_on || cause == ResetCause::native;
    slot_of_.fill(none);
    if (memory_.empty()) return;
    for (std::size_t slot = 0; slot < slots; ++slot) {
      const bool kept = !anew && load(slot);
      if (kept) valid_ |= 1U << slot;
      if (!kept) forget(slot);
    }
    if (valid_ != 0) newest_ = number_of_newest();
    settle();
    if (anew) return;
    const auto last = valid_ != 0 ? load(slot_of_[newest_ % fault_log_entries]) : std::nullopt;
    start_ = last ? static_cast<std::uint16_t>(last->start + 1U) : std::uint16_t{2};
    add_start(cause, crash, last);
  }

  /// Several times a second, for the time since the start.
  void count_time(std::uint32_t now_us) {
    if (!started_) second_us_ = now_us;
    started_ = true;
    while (now_us - second_us_ >= 1'000'000) {
      second_us_ += 1'000'000;
      ++uptime_s_;
    }
  }
  std::uint32_t uptime_s() const { return uptime_s_; }

  [[gnu::cold]] void add_trip(std::size_t axis, std::uint16_t error_code, std::uint32_t tick,
                              const std::array<float, 10>& numbers) {
    LogEntry trip{
        .tick = tick, .event = LogEvent::trip, .axis = static_cast<std::uint8_t>(axis), .code = error_code};
    for (std::size_t i = 0; i < numbers.size(); ++i)
      trip.numbers[i] = std::bit_cast<std::uint32_t>(numbers[i]);
    append(trip);
  }
  /// Numbers go on from where they are.
  [[gnu::cold]] void erase() { append({.event = LogEvent::erased}); }

  /// Of the newest entry, shown or erased; 0: there has been none since power-on.
  std::uint32_t newest() const { return newest_; }
  /// How many starts there have been since power-on, with this one.
  std::uint16_t start() const { return start_; }
  /// Word of the entry at `place`, which is its number modulo 16; zeros: none is there.
  std::uint32_t word(std::size_t place, std::size_t of_entry) const {
    const std::size_t slot = slot_of_[place];
    return slot == none || event_in(slot) == LogEvent::erased ? 0
                                                              : memory_[slot * fault_log_words + of_entry];
  }

 private:
  static constexpr std::size_t event_word = 4;
  static constexpr std::uint8_t none = 0xFF;

  bool is_valid(std::size_t slot) const { return (valid_ >> slot & 1U) != 0; }
  std::uint32_t number_in(std::size_t slot) const { return memory_[slot * fault_log_words]; }
  LogEvent event_in(std::size_t slot) const {
    return static_cast<LogEvent>(memory_[slot * fault_log_words + event_word] & 0xFFU);
  }
  /// Nothing: the slot has no entry.
  std::optional<LogEntry> load(std::size_t slot) const {
    LogWords words{};
    for (std::size_t i = 0; i < words.size(); ++i) words[i] = memory_[slot * fault_log_words + i];
    const std::uint32_t crc = memory_[slot * fault_log_words + words.size()];
    const auto entry = std::bit_cast<LogEntry>(words);
    if (crc != log_crc(words) || entry.event == LogEvent::none || entry.event > LogEvent::erased)
      return std::nullopt;
    return entry;
  }
  /// One store.
  void forget(std::size_t slot) {
    memory_[slot * fault_log_words + event_word] = 0;
    valid_ &= ~(1U << slot);
  }
  void store(const LogEntry& entry) {
    std::size_t slot = 0;  // there is always one without an entry: settle()
    while (is_valid(slot)) ++slot;
    const auto words = std::bit_cast<LogWords>(entry);
    for (std::size_t i = 0; i < words.size(); ++i) memory_[slot * fault_log_words + i] = words[i];
    memory_[slot * fault_log_words + words.size()] = log_crc(words);
    valid_ |= 1U << slot;
    newest_ = entry.number;
    settle();
  }
  void append(LogEntry entry) {
    if (memory_.empty()) return;
    entry.number = newest_ + 1;
    entry.start = start_;
    entry.uptime_s = uptime_s_;
    store(entry);
  }
  void add_start(ResetCause cause, const CrashRecord& crash, const std::optional<LogEntry>& last) {
    LogEntry start{.event = LogEvent::start, .code = static_cast<std::uint16_t>(cause)};
    if (crash.is_new) {
      start.numbers = {crash.count,
                       static_cast<std::uint32_t>(crash.cause) | std::uint32_t{crash.exception_number} << 16,
                       crash.program_counter,
                       crash.link_register,
                       crash.status,
                       crash.hard_fault_status,
                       crash.address};
    }
    if (!last || last->event != LogEvent::start || last->count == 0xFFFF) return append(start);
    start.number = last->number;
    start.start = start_;
    start.count = static_cast<std::uint16_t>(last->count + 1U);
    LogEntry same = *last;
    same.start = start.start;
    same.count = start.count;
    same.numbers[0] = start.numbers[0];
    if (same == start) return store(start);
    start.count = 1;
    append(start);
  }

  std::uint32_t number_of_newest() const {
    std::optional<std::uint32_t> newest;
    for (std::size_t slot = 0; slot < slots; ++slot) {
      if (is_valid(slot) && (!newest || number_in(slot) - *newest < 0x8000'0000U)) newest = number_in(slot);
    }
    return *newest;
  }
  /// Leaves the newest 16, of two with one number that with the higher count, and after an erasure only what
  /// is newer.
  void settle() {
    const auto count_in = [this](std::size_t slot) {
      return std::uint32_t{memory_[slot * fault_log_words + 1]} >> 16;
    };
    std::uint32_t shown = fault_log_entries;
    for (std::size_t slot = 0; slot < slots; ++slot) {
      const std::uint32_t age = newest_ - number_in(slot);
      if (is_valid(slot) && event_in(slot) == LogEvent::erased && age < shown) shown = age + 1;
    }
    slot_of_.fill(none);
    for (std::size_t slot = 0; slot < slots; ++slot) {
      if (!is_valid(slot)) continue;
      std::uint8_t& kept = slot_of_[number_in(slot) % fault_log_entries];
      const bool stays =
          newest_ - number_in(slot) < shown && (kept == none || count_in(slot) > count_in(kept));
      if (stays && kept != none) forget(kept);
      if (stays) kept = static_cast<std::uint8_t>(slot);
      if (!stays) forget(slot);
    }
  }

  std::span<Word> memory_;
  std::uint32_t valid_ = 0;                                ///< bit n: slot n has an entry
  std::array<std::uint8_t, fault_log_entries> slot_of_{};  ///< by place; none
  std::uint32_t newest_ = 0;
  std::uint32_t second_us_ = 0, uptime_s_ = 0;
  std::uint16_t start_ = 1;
  bool started_ = false;
};

/// Its stores are made, and in this order, whatever the compiler knows of the memory.
using FaultLog = FaultLogIn<volatile std::uint32_t>;
using FaultLogMemory = std::array<std::uint32_t, FaultLog::memory_words>;

}  // namespace kmax::firmware
