#include "firmware/command/parameter_access.hpp"

#include <algorithm>

#include "firmware/command/armed_change.hpp"
#include "firmware/drive/stability_guard.hpp"
#include "firmware/parameters/linked_parameters.hpp"

namespace kmax::firmware {

namespace {
constexpr std::size_t transaction_slot = slot_of(entry_of<"transaction.control">(), 0);
/// Commands and no values; the application takes them before they come here, if it has a store.
constexpr std::array store_entries{entry_of<"store.command">(), entry_of<"lock.code">(),
                                   entry_of<"lock.key">()};
constexpr std::size_t controlword_entry = entry_of<"drive.controlword">();

bool is_setting(const SlotValue& one) {
  return !acts_at_once(one.slot);
}

/// Whether a setting says what is recorded, and nothing else.
bool only_measures(std::size_t slot) {
  const std::uint8_t group = descriptors[owner_of(slot).entry].group;
  return group == descriptors[entry_of<"trace.axis">()].group ||
         group == descriptors[entry_of<"capture.axis">()].group;
}
}  // namespace

bool acts_at_once(std::size_t slot) {
  constexpr std::array entries{controlword_entry,
                               entry_of<"drive.commander">(),
                               entry_of<"profile.target_torque">(),
                               entry_of<"profile.max_torque">(),
                               entry_of<"profile.target_force">(),
                               entry_of<"link.sign_of_life">()};
  static_assert(std::none_of(entries.begin(), entries.end(), [](std::size_t entry) {
    return descriptors[entry].change() != Change::any_time || !descriptors[entry].writable;
  }));
  return std::find(entries.begin(), entries.end(), owner_of(slot).entry) != entries.end();
}

ParameterAccess::Result ParameterAccess::refuse_slot(Refusal refusal, std::size_t slot) {
  const auto [entry, axis] = owner_of(slot);
  return refuse(refusal, register_address(entry, axis));
}

void ParameterAccess::poll(std::uint32_t now_us) {
  if (owner_ && now_us - last_staged_us_ > transaction_timeout_us) drop(*owner_, now_us);
  for (auto& dropped_us : dropped_us_) {
    if (dropped_us && now_us - *dropped_us > stragglers_us) dropped_us.reset();
  }
}

void ParameterAccess::drop(Link owner, std::uint32_t now_us) {
  if (owner_ != owner) return;
  owner_.reset();
  dropped_us_[static_cast<std::size_t>(owner)] = now_us;
}

Refusal ParameterAccess::lock_refusal(const SlotValue& wanted, Link by) const {
  const bool passes = !locked_ || by == Link::local || wanted.raw == values_.raw(wanted.slot) ||
                      acts_at_once(wanted.slot) || only_measures(wanted.slot);
  return passes ? Refusal::none : Refusal::locked;
}

ParameterAccess::Result ParameterAccess::check(const SlotValue& one, Link by, const ArmedAxes& armed) {
  const std::size_t entry = owner_of(one.slot).entry;
  const SlotDescriptor& descriptor = descriptors[entry];
  Refusal refusal = descriptor.writable ? lock_refusal(one, by) : Refusal::read_only;
  if (refusal == Refusal::none) refusal = check_value(descriptor, one.raw);
  if (refusal == Refusal::none) refusal = armed_change_refusal(values_, one, by, armed);
  if (refusal == Refusal::none && std::ranges::find(store_entries, entry) != store_entries.end())
    refusal = Refusal::store_missing;
  return refusal == Refusal::none ? Result{} : refuse_slot(refusal, one.slot);
}

void ParameterAccess::put_aside(const SlotValue& one) {
  staged_.set_raw(one.slot, one.raw);
  mark(one.slot);
  if (const auto partner = set_partner(staged_, one.slot)) mark(*partner);
}

/// The values that were put aside are in force, and those that were are put aside: twice, and nothing has
/// happened.
void ParameterAccess::exchange() {
  for_each_written([this](std::size_t slot) {
    const std::uint32_t raw = values_.raw(slot);
    values_.set_raw(slot, staged_.raw(slot));
    staged_.set_raw(slot, raw);
  });
}

/// What was put aside, if the rules allow it.
ParameterAccess::Result ParameterAccess::apply(Link by, const ArmedAxes& armed) {
  BrokenRule refused;
  bool changed = false, restarts = false, communication_changed = false;
  for_each_written([&](std::size_t slot) {
    const SlotDescriptor& descriptor = descriptors[owner_of(slot).entry];
    if (staged_.raw(slot) == values_.raw(slot)) return;
    // An axis may have been armed, or the device locked, since the value was put aside.
    const SlotValue wanted{slot, staged_.raw(slot)};
    Refusal refusal = lock_refusal(wanted, by);
    if (refusal == Refusal::none) refusal = armed_change_refusal(values_, wanted, by, armed);
    if (refusal != Refusal::none && refused.refusal == Refusal::none) refused = {refusal, slot};
    (descriptor.writable ? changed : communication_changed) = true;
    restarts = restarts || (descriptor.writable && descriptor.disarmed_only());
  });
  exchange();
  BrokenRule broken = check_rules(values_);
  if (broken.refusal == Refusal::none) broken = refused;
  const bool guarded = broken.refusal == Refusal::none && changed;
  if (guarded) broken = check_guard(values_, values_, armed);
  if (broken.refusal != Refusal::none) {
    exchange();
    if (guarded) {  // again, to hear which of the changes it is about
      for (std::size_t slot = 0; slot < slot_count; ++slot) {
        if ((written_[slot / 32] >> slot % 32 & 1U) == 0) staged_.set_raw(slot, values_.raw(slot));
      }
      broken = check_guard(staged_, values_, armed);
    }
    return refuse_slot(broken.refusal, broken.slot);
  }
  if (changed) ++changes_;
  if (restarts) ++restarting_changes_;
  if (communication_changed) ++communication_changes_;
  return last_ = {};
}

ParameterAccess::Result ParameterAccess::set_all(const ParameterValues& wanted, const ArmedAxes& armed) {
  if (owner_) return refuse_slot(Refusal::transaction_open, transaction_slot);
  staged_ = wanted;
  make_partners_agree(staged_, values_);
  written_ = {};
  for (std::size_t slot = 0; slot < slot_count; ++slot) {
    if (descriptors[owner_of(slot).entry].kept && !acts_at_once(slot)) mark(slot);
  }
  return apply(Link::local, armed);
}

ParameterAccess::Result ParameterAccess::write_communication(std::size_t slot, std::uint32_t raw,
                                                             const ArmedAxes& armed) {
  const SlotDescriptor& descriptor = descriptors[owner_of(slot).entry];
  Refusal refusal =
      descriptor.kept && !descriptor.writable ? lock_refusal({slot, raw}, Link::can) : Refusal::read_only;
  if (refusal == Refusal::none) refusal = check_value(descriptor, raw);
  if (refusal == Refusal::none) refusal = armed_change_refusal(values_, {slot, raw}, Link::can, armed);
  if (refusal != Refusal::none) return refuse_slot(refusal, slot);
  if (values_.raw(slot) != raw) ++communication_changes_;
  values_.set_raw(slot, raw);
  return last_ = {};
}

ParameterAccess::Result ParameterAccess::control_transaction(std::uint32_t request, Link by,
                                                             const ArmedAxes& armed, std::uint32_t now_us) {
  if (request > descriptors[owner_of(transaction_slot).entry].maximum())
    return refuse_slot(Refusal::out_of_range, transaction_slot);
  const bool begins = request == 1, commits = request == 2;
  if (owner_ ? owner_ != by || begins : commits)
    return refuse_slot(owner_ ? Refusal::transaction_open : Refusal::no_transaction, transaction_slot);
  if (!commits) dropped_us_[static_cast<std::size_t>(by)].reset();
  owner_.reset();
  if (commits) return apply(by, armed);
  if (begins) {
    owner_ = by;
    written_ = {};
    last_staged_us_ = now_us;
  }
  return last_ = {};
}

ParameterAccess::Result ParameterAccess::write(std::span<const SlotValue> wanted, Link by,
                                               const ArmedAxes& armed, std::uint32_t now_us) {
  poll(now_us);
  if (wanted.size() == 1 && wanted[0].slot == transaction_slot)
    return control_transaction(wanted[0].raw, by, armed, now_us);

  const bool settings = std::any_of(wanted.begin(), wanted.end(), is_setting);
  if (settings && owner_ && owner_ != by) return refuse_slot(Refusal::transaction_open, wanted[0].slot);
  if (settings && dropped_us_[static_cast<std::size_t>(by)])
    return refuse_slot(Refusal::no_transaction, wanted[0].slot);
  for (const SlotValue& one : wanted) {
    if (const Result checked = check(one, by, armed); checked.refusal != Refusal::none) return checked;
  }
  if (settings) {
    if (!owner_) written_ = {};
    for (const SlotValue& one : wanted) {
      if (is_setting(one)) put_aside(one);
    }
    last_staged_us_ = now_us;
    if (!owner_) {
      if (const Result applied = apply(by, armed); applied.refusal != Refusal::none) return applied;
    }
  }
  for (const SlotValue& one : wanted) {
    if (is_setting(one)) continue;
    values_.set_raw(one.slot, one.raw);
    const auto [entry, axis] = owner_of(one.slot);
    if (entry == controlword_entry) commanded_by_[axis] = by;
  }
  return last_ = {};
}

}  // namespace kmax::firmware
