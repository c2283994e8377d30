#include "firmware/device_registers.hpp"

#include "firmware/parameters/linked_parameters.hpp"
#include "firmware/stability_guard.hpp"

namespace kmax::firmware {

namespace {
constexpr std::uint16_t address_of_slot(std::size_t slot) {
  const auto [entry, axis] = owner_of(slot);
  return register_address(entry, axis);
}
constexpr std::size_t controlword_entry = entry_of<"drive.controlword">();
constexpr std::size_t transaction_entry = entry_of<"transaction.control">();
constexpr std::size_t store_entry = entry_of<"store.command">();
constexpr std::size_t sign_of_life_entry = entry_of<"link.sign_of_life">();
constexpr std::array setpoint_entries = {entry_of<"profile.target_torque">(),
                                         entry_of<"profile.max_torque">()};

constexpr bool is_setpoint(std::size_t entry) {
  return std::find(setpoint_entries.begin(), setpoint_entries.end(), entry) != setpoint_entries.end();
}
// No part of a set of parameters: they act when they are written.
constexpr bool acts_at_once(std::size_t entry) {
  return entry == controlword_entry || is_setpoint(entry);
}
static_assert(
    [] {
      for (const std::size_t entry : setpoint_entries) {
        const SlotDescriptor& d = descriptors[entry];
        if (register_count(d.type) != 1 || d.disarmed_only || !d.writable || !d.per_axis) return false;
      }
      return true;
    }(),
    "setpoints are taken word by word, whatever the axes do");

// A signed 8-bit value in one register may come with its sign extended (0xFFFF) or as the bare byte (0x00FF).
std::uint32_t pattern_of(Type type, std::uint16_t word) {
  if (type != Type::integer8 && type != Type::integer16) return word;
  if (type == Type::integer8 && word <= 0xFF)
    return static_cast<std::uint32_t>(static_cast<std::int32_t>(static_cast<std::int8_t>(word)));
  return static_cast<std::uint32_t>(static_cast<std::int32_t>(static_cast<std::int16_t>(word)));
}
}  // namespace

DeviceRegisters::WriteResult DeviceRegisters::check_and_set(Staged& target, std::uint16_t address,
                                                            std::span<const std::uint16_t> in,
                                                            bool armed) const {
  for (std::size_t i = 0; i < in.size();) {
    const auto a = static_cast<std::uint16_t>(address + i);
    const std::optional<RegisterPlace> place = find(true, a);
    if (!place) return {Refusal::unknown_register, a};
    if (place->address != a || i + place->words > in.size()) return {Refusal::value_cut_in_two, a};
    const SlotDescriptor& entry = descriptors[owner_of(place->slot).entry];
    const std::uint32_t raw =
        place->words == 2 ? (std::uint32_t{in[i]} << 16) | in[i + 1] : pattern_of(entry.type, in[i]);
    if (const Refusal refusal = check_value(entry, raw); refusal != Refusal::none) return {refusal, a};
    if (armed && entry.disarmed_only && raw != values_.raw(place->slot)) return {Refusal::while_armed, a};
    target.values.set_raw(place->slot, raw);
    target.written[place->slot] = true;
    if (const auto partner = set_partner(target.values, place->slot)) target.written[*partner] = true;
    i += place->words;
  }
  return {};
}

bool DeviceRegisters::only_setpoints(std::uint16_t address, std::size_t count) const {
  for (std::size_t i = 0; i < count; ++i) {
    const std::optional<RegisterPlace> place = find(true, static_cast<std::uint16_t>(address + i));
    if (!place || !is_setpoint(owner_of(place->slot).entry)) return false;
  }
  return count != 0;
}

DeviceRegisters::WriteResult DeviceRegisters::take_setpoints(std::uint16_t address,
                                                             std::span<const std::uint16_t> in) {
  // Twice the same way: nothing is taken before everything has been checked.
  for (const bool take : {false, true}) {
    for (std::size_t i = 0; i < in.size(); ++i) {
      const std::size_t slot = find(true, static_cast<std::uint16_t>(address + i))->slot;
      const SlotDescriptor& entry = descriptors[owner_of(slot).entry];
      const std::uint32_t raw = pattern_of(entry.type, in[i]);
      if (take) {
        values_.set_raw(slot, raw);
      } else if (const Refusal refusal = check_value(entry, raw); refusal != Refusal::none) {
        return refuse(refusal, static_cast<std::uint16_t>(address + i));
      }
    }
  }
  return last_ = {};
}

DeviceRegisters::WriteResult DeviceRegisters::apply(const ParameterValues& wanted, const ArmedAxes& armed) {
  if (const BrokenRule broken = check_rules(wanted); broken.refusal != Refusal::none)
    return refuse(broken.refusal, address_of_slot(broken.slot));
  bool changed = false, restarts = false, communication_changed = false;
  for (std::size_t slot = 0; slot < slot_count; ++slot) {
    const std::size_t of = owner_of(slot).entry;
    const SlotDescriptor& entry = descriptors[of];
    if (!entry.kept || acts_at_once(of) || wanted.raw(slot) == values_.raw(slot)) continue;
    // An axis may have been armed since the value was put aside.
    if (armed.any() && entry.disarmed_only) return refuse(Refusal::while_armed, address_of_slot(slot));
    (entry.writable ? changed : communication_changed) = true;
    restarts = restarts || entry.disarmed_only;
  }
  if (changed) {
    if (const BrokenRule broken = check_guard(wanted, values_, armed); broken.refusal != Refusal::none)
      return refuse(broken.refusal, address_of_slot(broken.slot));
  }
  for (std::size_t slot = 0; slot < slot_count; ++slot) {
    if (descriptors[owner_of(slot).entry].kept) values_.set_raw(slot, wanted.raw(slot));
  }
  if (changed) ++changes_;
  if (restarts) ++restarting_changes_;
  if (communication_changed) ++communication_changes_;
  return last_ = {};
}

DeviceRegisters::WriteResult DeviceRegisters::set_all(const ParameterValues& wanted, const ArmedAxes& armed) {
  if (staging_) return refuse(Refusal::transaction_open, register_address(transaction_entry, 0));
  // Where a transaction would be put aside, instead of as much stack again.
  ParameterValues& set = staged_.values;
  set = wanted;
  make_partners_agree(set, values_);
  for (std::size_t slot = 0; slot < slot_count; ++slot) {
    if (acts_at_once(owner_of(slot).entry)) set.set_raw(slot, values_.raw(slot));
  }
  return apply(set, armed);
}

DeviceRegisters::WriteResult DeviceRegisters::write_communication(std::size_t slot, std::uint32_t raw) {
  const SlotDescriptor& entry = descriptors[owner_of(slot).entry];
  if (!entry.kept || entry.writable) return refuse(Refusal::read_only, address_of_slot(slot));
  if (const Refusal refusal = check_value(entry, raw); refusal != Refusal::none)
    return refuse(refusal, address_of_slot(slot));
  if (values_.raw(slot) != raw) ++communication_changes_;
  values_.set_raw(slot, raw);
  return last_ = {};
}

DeviceRegisters::WriteResult DeviceRegisters::control_transaction(std::uint16_t address,
                                                                  std::uint32_t request,
                                                                  const ArmedAxes& armed,
                                                                  std::uint32_t now_us) {
  if (request <= 1) dropped_ = false;
  switch (request) {
    case 0:
      staging_ = false;
      return last_ = {};
    case 1:
      if (staging_) return refuse(Refusal::transaction_open, address);
      staged_.values = values_;
      staged_.written.reset();
      staging_ = true;
      last_staged_us_ = now_us;
      return last_ = {};
    case 2:
      if (!staging_) return refuse(Refusal::no_transaction, address);
      staging_ = false;
      // What was not written here may have changed since the transaction began.
      for (std::size_t slot = 0; slot < slot_count; ++slot) {
        if (!staged_.written[slot]) staged_.values.set_raw(slot, values_.raw(slot));
      }
      return apply(staged_.values, armed);
    default:
      return refuse(Refusal::out_of_range, address);
  }
}

DeviceRegisters::WriteResult DeviceRegisters::write(std::uint16_t address, std::span<const std::uint16_t> in,
                                                    const ArmedAxes& armed, std::uint32_t now_us) {
  poll(now_us);
  if (in.size() == 1 && address == register_address(transaction_entry, 0))
    return control_transaction(address, in[0], armed, now_us);
  // A command and no value; the application takes it before it comes here, if it has a store.
  if (in.size() == 1 && address == register_address(store_entry, 0))
    return refuse(in[0] > descriptors[store_entry].maximum() ? Refusal::out_of_range : Refusal::store_missing,
                  address);

  for (std::size_t axis = 0; axis < axis_count; ++axis) {
    if (in.size() == 1 && address == register_address(controlword_entry, axis)) {
      values_.set_raw(slot_of(controlword_entry, axis), in[0]);
      commanded_[axis] = true;
      return last_ = {};
    }
  }

  if (only_setpoints(address, in.size())) return take_setpoints(address, in);
  // That it was written is all that it says.
  if (in.size() == 1 && address == register_address(sign_of_life_entry, 0)) {
    values_.set_raw(slot_of(sign_of_life_entry, 0), in[0]);
    return last_ = {};
  }

  if (dropped_) return refuse(Refusal::no_transaction, address);
  Staged wanted{staging_ ? staged_.values : values_, {}};
  const WriteResult checked = check_and_set(wanted, address, in, armed.any());
  if (checked.refusal != Refusal::none) return refuse(checked.refusal, checked.address);
  if (!staging_) return apply(wanted.values, armed);
  for (std::size_t axis = 0; axis < axis_count; ++axis) {
    for (const std::size_t entry : setpoint_entries) {
      const std::size_t slot = slot_of(entry, axis);
      if (!wanted.written[slot]) continue;
      values_.set_raw(slot, wanted.values.raw(slot));
      wanted.written[slot] = false;
    }
  }
  wanted.written |= staged_.written;
  staged_ = wanted;
  last_staged_us_ = now_us;
  return last_ = {};
}

}  // namespace kmax::firmware
