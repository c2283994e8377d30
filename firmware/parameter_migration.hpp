#pragma once

#include <algorithm>
#include <array>
#include <cstdint>

#include "firmware/parameter_rules.hpp"
#include "firmware/persistent_parameters.hpp"

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
    const auto is_wanted = [identity](const auto& p) { return p.identity == identity; };
    // A set is stored in the order of the dictionary: the next one is nearly always the one wanted.
    auto known = std::find_if(persistent_parameters.begin() + next_, persistent_parameters.end(), is_wanted);
    if (known == persistent_parameters.end())
      known = std::find_if(persistent_parameters.begin(), persistent_parameters.end(), is_wanted);
    if (known == persistent_parameters.end()) {
      note(identity, report_.dropped, report_.first_dropped);
      return;
    }
    next_ = known - persistent_parameters.begin() + 1;
    if (check_value(descriptors[owner_of(known->slot).entry], raw) != Refusal::none) return;
    result_.set_raw(known->slot, raw);
    taken_[static_cast<std::size_t>(known - persistent_parameters.begin())] = true;
  }

  /// After the last take().
  const ParameterValues& finish() {
    keep_rules();
    for (std::size_t i = 0; i < persistent_count; ++i) {
      if (!taken_[i]) note(persistent_parameters[i].identity, report_.defaulted, report_.first_defaulted);
    }
    return result_;
  }

  const MigrationReport& report() const { return report_; }

 private:
  template <typename Matches>
  bool put_back(Matches matches) {
    bool changed = false;
    for (std::size_t i = 0; i < persistent_count; ++i) {
      const std::size_t slot = persistent_parameters[i].slot;
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
      const auto [entry, axis] = owner_of(broken.slot);
      const std::uint16_t group = register_group(entry);
      if (put_back([&](std::size_t slot) {
            return owner_of(slot).axis == axis && register_group(owner_of(slot).entry) == group;
          }))
        continue;
      put_back([](std::size_t) { return true; });
      return;
    }
  }

  static std::uint16_t register_group(std::size_t entry) { return groups[entry]; }

  // The dictionary itself, with its texts, stays out of the image.
  static constexpr auto groups = [] {
    std::array<std::uint16_t, entry_count> all{};
    for (std::size_t i = 0; i < entry_count; ++i) all[i] = entry_at(i).group.index;
    return all;
  }();

  static void note(std::uint32_t identity, std::uint16_t& count,
                   std::array<std::uint32_t, MigrationReport::named>& first) {
    if (count < first.size()) first[count] = identity;
    ++count;
  }

  const ParameterValues& before_;
  ParameterValues result_;
  std::array<bool, persistent_count> taken_{};
  MigrationReport report_;
  std::ptrdiff_t next_ = 0;  ///< behind the parameter that was taken last
};

}  // namespace kmax::firmware
