#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>

#include "firmware/board_interface/flash_sectors.hpp"
#include "firmware/object_dictionary/dictionary_checksum.hpp"
#include "firmware/parameters/parameter_migration.hpp"
#include "firmware/parameters/parameter_record.hpp"
#include "firmware/parameters/persistent_parameters.hpp"

namespace kmax::firmware {

/// What the flash holds.
struct StoreSurvey {
  struct Place {
    std::size_t sector, word;
  };
  std::optional<Place> newest{};           ///< the newest valid record
  record::Header header{};                 ///< its header, if there is one
  std::uint32_t next_sequence = 1;         ///< later than every whole record, committed or not
  std::uint32_t erases = 0;                ///< the most that any whole record tells
  std::uint16_t damaged = 0;               ///< records cut short or changed
  std::array<std::size_t, 2> free_from{};  ///< first word a new record may begin at, by sector
  std::uint32_t lock_code = 0;             ///< of the write lock, in the newest valid record; 0: none

  /// In that record.
  std::uint32_t parameters() const { return header.count - (lock_code != 0 ? 1U : 0U); }
};

struct LoadReport {
  bool found = false;
  record::Header header{};
  bool other_dictionary = false;  ///< another firmware wrote it
  MigrationReport migration{};
};

enum class SaveProgress : std::uint8_t { busy, done, failed };

/// The persistent parameters, and the write lock's code, in two sectors of flash, such that a loss of power
/// at any moment leaves the set before or the set after, whole.
///
/// A save appends a record with all persistent parameters (parameter_record.hpp), then the code if there is
/// one, as one more pair; the newest valid one counts. Every word is read back when it has been programmed,
/// the whole record once more at the end. A sector is erased only when the other holds the newest valid
/// record, or when there is none; so the last good set is never at stake, whatever fails. The sector is
/// changed only when it is full: with n parameters it takes its words / (7 + 2n, rounded up to 16) saves per
/// erase, and 10,000 erases of each sector (DS8626, flash endurance) last for 20,000 times as many.
///
/// A word that does not read back as it was written makes the save begin again at the next place, in the end
/// in the other sector, and is counted. A save fails when there is no place left.
///
/// begin(), then step() until it is not busy; each step is one word (16 us, at most 100 us), one erase
/// (0.25 s, at most 0.5 s, in which a processor that runs from the same flash stands still), or one reading
/// through. begin() and load() read both sectors through, plus a CRC over the records in them.
/// Main loop only.
template <FlashSectors Flash>
class ParameterStore {
 public:
  explicit ParameterStore(Flash& flash) : flash_(flash) {}

  StoreSurvey survey() const {
    StoreSurvey found;
    bool any = false;
    for (std::size_t sector = 0; sector < Flash::sector_count; ++sector) {
      const std::size_t end = end_of_used(sector);
      found.free_from[sector] = record::aligned_up(end);
      for (std::size_t word = 0; word < end; word += record::alignment) {
        const record::Found here = record::examine(flash_, sector, word);
        if (here.condition == record::Condition::none) continue;
        if (here.condition != record::Condition::valid) ++found.damaged;
        if (here.condition == record::Condition::damaged) continue;
        const record::Header& header = here.header;
        if (!any || record::later(header.sequence + 1, found.next_sequence))
          found.next_sequence = header.sequence + 1;
        found.erases = std::max(found.erases, header.erases);
        any = true;
        if (here.condition == record::Condition::valid &&
            (!found.newest || !record::later(found.header.sequence, header.sequence))) {
          found.newest = StoreSurvey::Place{sector, word};
          found.header = header;
        }
        // The next record may begin in the place of a commit word that was never written.
        const std::size_t unwritten = here.condition == record::Condition::uncommitted ? 1 : 0;
        word += record::aligned_up(record::length_of(header.count) - unwritten) - record::alignment;
      }
    }
    if (found.newest && found.header.count != 0) {
      const std::size_t last = found.newest->word + record::length_of(found.header.count) - 4;
      if (flash_.read(found.newest->sector, last) == lock_code_identity)
        found.lock_code = flash_.read(found.newest->sector, last + 1);
    }
    return found;
  }

  /// Replaces the persistent part of `values` by the newest valid set, if there is one; what that set does
  /// not say stays as it is in `values`, which must keep the rules.
  LoadReport load(ParameterValues& values) const {
    LoadReport report;
    const StoreSurvey found = survey();
    if (!found.newest) return report;
    ParameterMigration migration(values);
    const auto [sector, word] = *found.newest;
    for (std::size_t i = 0; i < found.parameters(); ++i) {
      const std::size_t pair = word + record::header_words + 2 * i;
      migration.take(flash_.read(sector, pair), flash_.read(sector, pair + 1));
    }
    values = migration.finish();
    report.found = true;
    report.header = found.header;
    report.other_dictionary = found.header.schema != dictionary_checksum;
    report.migration = migration.report();
    return report;
  }

  /// Begins to save `values`, of which it takes a copy; the code stays. A save under way is given up.
  void begin(const ParameterValues& values) {
    const StoreSurvey found = survey();
    begin(persistent_part(values), found.lock_code, found);
  }
  /// The same with another code, 0 for none.
  void begin(const PersistentValues& set, std::uint32_t lock_code) { begin(set, lock_code, survey()); }

  SaveProgress step() {
    switch (phase_) {
      case Phase::idle:
        return result_;
      case Phase::erase:
        erase();
        break;
      case Phase::write:
        write();
        break;
      case Phase::verify:
        verify();
        break;
    }
    return phase_ == Phase::idle ? result_ : SaveProgress::busy;
  }

  bool busy() const { return phase_ != Phase::idle; }
  /// The set that begin() was given last.
  const PersistentValues& set() const { return pending_; }

  /// Words that did not read back, and erases that failed, since start.
  std::uint32_t write_errors() const { return write_errors_; }

  /// How many sets of the present size fit before a sector must be erased.
  std::size_t free_saves(const StoreSurvey& found) const {
    const std::size_t from = found.free_from[found.newest ? found.newest->sector : 0];
    const std::size_t left = from < flash_.words_per_sector ? flash_.words_per_sector - from : 0;
    const std::size_t size = length_with(found.lock_code), stride = record::aligned_up(size);
    // The last of them needs no room for rounding up.
    return (left + stride - size) / stride;
  }

  /// Of a record without a code, and of the longest.
  static constexpr std::size_t length = record::length_of(persistent_count);
  static constexpr std::size_t longest = record::length_of(persistent_count + 1);

 private:
  enum class Phase : std::uint8_t { idle, erase, write, verify };

  static constexpr std::size_t length_with(std::uint32_t lock_code) {
    return lock_code != 0 ? longest : length;
  }

  void begin(const PersistentValues& set, std::uint32_t lock_code, const StoreSurvey& found) {
    pending_ = set;
    lock_code_ = lock_code;
    size_ = length_with(lock_code);
    newest_ = found.newest;
    erased_ = {};
    if (found.erases > erases_) erases_ = found.erases;
    const std::size_t count = persistent_count + (lock_code != 0 ? 1 : 0);
    header_ = {found.next_sequence, dictionary_checksum, erases_, static_cast<std::uint32_t>(count)};
    sector_ = newest_ ? newest_->sector : 0;
    write_from(found.free_from[sector_]);
  }

  std::size_t end_of_used(std::size_t sector) const {
    std::size_t end = flash_.words_per_sector;
    while (end != 0 && flash_.read(sector, end - 1) == record::erased) --end;
    return end;
  }

  void finish(SaveProgress result) {
    result_ = result;
    phase_ = Phase::idle;
  }

  /// Begins the record at the first place from `word` on, in this sector or another.
  void write_from(std::size_t word) {
    base_ = record::aligned_up(word);
    next_ = 0;
    crc_ = {};
    if (base_ + size_ <= flash_.words_per_sector) {
      phase_ = Phase::write;
    } else {
      leave_sector();
    }
  }

  void leave_sector() {
    for (const std::size_t candidate : {1 - sector_, sector_}) {
      if (erased_[candidate] || (newest_ && newest_->sector == candidate)) continue;
      sector_ = candidate;
      phase_ = Phase::erase;
      return;
    }
    finish(SaveProgress::failed);
  }

  void erase() {
    erased_[sector_] = true;
    header_.erases = ++erases_;
    if (!flash_.erase(sector_)) {
      ++write_errors_;
      return leave_sector();
    }
    write_from(end_of_used(sector_));  // 0, unless the memory is not as good as it says
  }

  std::uint32_t word_at(std::size_t i) const {
    if (i < record::header_words) return header_.word(i);
    if (i == size_ - 2) return crc_.value();
    if (i == size_ - 1) return record::commit;
    const std::size_t pair = (i - record::header_words) / 2;
    const bool identity = (i - record::header_words) % 2 == 0;
    if (pair == persistent_count) return identity ? lock_code_identity : lock_code_;
    return identity ? persistent_identity(pair) : pending_[pair];
  }

  void write() {
    const std::uint32_t value = word_at(next_);
    const std::size_t word = base_ + next_;
    if (!flash_.program(sector_, word, value) || flash_.read(sector_, word) != value) return spoilt(word + 1);
    if (next_ < size_ - 2) crc_.add(value);
    ++next_;
    if (next_ == size_) phase_ = Phase::verify;
  }

  void verify() {
    for (std::size_t i = 0; i < size_; ++i) {
      if (flash_.read(sector_, base_ + i) != word_at(i)) return spoilt(base_ + size_);
    }
    finish(SaveProgress::done);
  }

  void spoilt(std::size_t from) {
    ++write_errors_;
    write_from(from);
  }

  Flash& flash_;
  PersistentValues pending_{};
  record::Header header_{};
  Crc32 crc_;
  std::optional<StoreSurvey::Place> newest_{};
  std::array<bool, 2> erased_{};
  std::size_t sector_ = 0, base_ = 0, next_ = 0, size_ = length;
  std::uint32_t write_errors_ = 0, erases_ = 0, lock_code_ = 0;
  Phase phase_ = Phase::idle;
  SaveProgress result_ = SaveProgress::done;
};

}  // namespace kmax::firmware
