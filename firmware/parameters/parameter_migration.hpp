#pragma once

#include <array>
#include <cstdint>

#include "firmware/parameters/parameter_rules.hpp"
#include "firmware/parameters/persistent_parameters.hpp"

namespace kmax::firmware {

/// How a stored set became this firmware's.
struct MigrationReport {
  static constexpr std::size_t named = 3;

  std::uint16_t dropped = 0;    ///< stored values of parameters that this firmware does not have
  std::uint16_t defaulted = 0;  ///< parameters that were not stored, or whose stored value is not allowed
  std::array<std::uint32_t, named> first_dropped{}, first_defaulted{};  ///< ParameterIdentity::word(), or 0
};

/// Takes a stored set over, parameter by parameter: whatever firmware wrote it, the result is a set that a
/// host could have written to this one.
///
/// Unknown parameters are dropped. Missing ones, and ones whose value check_value() refuses, get the value
/// they had before. If the set breaks a rule between parameters, the parameter that the rule names goes back;
/// if that is not enough, its whole group on its axis; if even that is not, everything. Main loop, at start;
/// no loop is longer than stored x present parameters.
class ParameterMigration {
 public:
  /// `before`: what missing parameters keep, usually the defaults. It must keep the rules.
  explicit ParameterMigration(const ParameterValues& before) : before_(before), result_(before) {}

  void take(std::uint32_t identity, std::uint32_t raw) {
    // A set is stored in the order of the dictionary: the next one is nearly always the one wanted.
    std::size_t known = find(identity, next_);
    if (known == persistent_count) known = find(identity, 0);
    if (known == persistent_count) {
      note(identity, report_.dropped, report_.first_dropped);
      return;
    }
    next_ = known + 1;
    const std::size_t slot = persistent_slots[known];
    if (check_value(descriptors[owner_of(slot).entry], raw) != Refusal::none) return;
    result_.set_raw(slot, raw);
    taken_[known] = true;
  }

  /// After the last take().
  const ParameterValues& finish() {
    keep_rules();
    for (std::size_t i = 0; i < persistent_count; ++i) {
      if (!taken_[i]) note(persistent_identity(i), report_.defaulted, report_.first_defaulted);
    }
    return result_;
  }

  const MigrationReport& report() const { return report_; }

 private:
  template <typename Matches>
  bool put_back(Matches matches) {
    bool changed = false;
    for (std::size_t i = 0; i < persistent_count; ++i) {
      const std::size_t slot = persistent_slots[i];
      if (result_.raw(slot) == before_.raw(slot) || !matches(slot)) continue;
      taken_[i] = false;
      changed = true;
      result_.set_raw(slot, before_.raw(slot));
    }
    return changed;
  }

  void keep_rules() {
    // Each round puts at least one parameter back, or is the last.
    for (std::size_t round = 0; round <= persistent_count; ++round) {
      const BrokenRule broken = check_rules(result_);
      if (broken.refusal == Refusal::none) return;
      if (put_back([&](std::size_t slot) { return slot == broken.slot; })) continue;
      const auto owner = owner_of(broken.slot);
      const std::uint8_t group = descriptors[owner.entry].group;
      if (put_back([&](std::size_t slot) {
            return owner_of(slot).axis == owner.axis && descriptors[owner_of(slot).entry].group == group;
          }))
        continue;
      put_back([](std::size_t) { return true; });
      return;
    }
  }

  /// Of the persistent parameters from `from` on; persistent_count if it is none of them.
  static std::size_t find(std::uint32_t identity, std::size_t from) {
    while (from < persistent_count && persistent_identity(from) != identity) ++from;
    return from;
  }

  static void note(std::uint32_t identity, std::uint16_t& count,
                   std::array<std::uint32_t, MigrationReport::named>& first) {
    if (count < first.size()) first[count] = identity;
    ++count;
  }

  const ParameterValues& before_;
  ParameterValues result_;
  std::array<bool, persistent_count> taken_{};
  MigrationReport report_;
  std::size_t next_ = 0;  ///< behind the parameter that was taken last
};

}  // namespace kmax::firmware
