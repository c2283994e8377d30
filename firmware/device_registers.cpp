#include "firmware/device_registers.hpp"

namespace kmax::firmware {

namespace {
constexpr std::uint16_t address_of_slot(std::size_t slot) {
  const auto [entry, axis] = owner_of(slot);
  return register_address(entry, axis);
}
constexpr std::size_t controlword_entry = entry_of<"drive.controlword">();
constexpr std::size_t transaction_entry = entry_of<"transaction.control">();
constexpr std::size_t store_entry = entry_of<"store.command">();

// A signed 8-bit value in one register may come with its sign extended (0xFFFF) or as the bare byte (0x00FF).
std::uint32_t pattern_of(Type type, std::uint16_t word) {
  if (type != Type::integer8) return word;
  if (word <= 0xFF)
    return static_cast<std::uint32_t>(static_cast<std::int32_t>(static_cast<std::int8_t>(word)));
  return static_cast<std::uint32_t>(static_cast<std::int32_t>(static_cast<std::int16_t>(word)));
}
}  // namespace

DeviceRegisters::WriteResult DeviceRegisters::check_and_set(ParameterValues& target, std::uint16_t address,
                                                            std::span<const std::uint16_t> in, bool armed) {
  for (std::size_t i = 0; i < in.size();) {
    const auto a = static_cast<std::uint16_t>(address + i);
    const RegisterPlace* place = find(true, a);
    if (place == nullptr) return {Refusal::unknown_register, a};
    if (place->address != a || i + place->words > in.size()) return {Refusal::value_cut_in_two, a};
    const SlotDescriptor& entry = descriptors[owner_of(place->slot).entry];
    const std::uint32_t raw =
        place->words == 2 ? (std::uint32_t{in[i]} << 16) | in[i + 1] : pattern_of(entry.type, in[i]);
    if (const Refusal refusal = check_value(entry, raw); refusal != Refusal::none) return {refusal, a};
    if (armed && entry.disarmed_only && raw != values_.raw(place->slot)) return {Refusal::while_armed, a};
    target.set_raw(place->slot, raw);
    i += place->words;
  }
  return {};
}

DeviceRegisters::WriteResult DeviceRegisters::apply(const ParameterValues& wanted, bool armed) {
  if (const BrokenRule broken = check_rules(wanted); broken.refusal != Refusal::none)
    return refuse(broken.refusal, address_of_slot(broken.slot));
  bool changed = false, restarts = false;
  for (std::size_t slot = 0; slot < slot_count; ++slot) {
    const SlotDescriptor& entry = descriptors[owner_of(slot).entry];
    if (!entry.writable || wanted.raw(slot) == values_.raw(slot)) continue;
    // An axis may have been armed since the value was put aside.
    if (armed && entry.disarmed_only) return refuse(Refusal::while_armed, address_of_slot(slot));
    changed = true;
    restarts = restarts || entry.disarmed_only;
  }
  for (std::size_t slot = 0; slot < slot_count; ++slot) {
    if (descriptors[owner_of(slot).entry].writable) values_.set_raw(slot, wanted.raw(slot));
  }
  if (changed) ++changes_;
  if (restarts) ++restarting_changes_;
  last_ = {};
  return {};
}

DeviceRegisters::WriteResult DeviceRegisters::control_transaction(std::uint16_t address,
                                                                  std::uint32_t request, bool armed,
                                                                  std::uint32_t now_us) {
  if (request <= 1) dropped_ = false;
  switch (request) {
    case 0:
      staging_ = false;
      return last_ = {};
    case 1:
      if (staging_) return refuse(Refusal::transaction_open, address);
      staged_ = values_;
      staging_ = true;
      last_staged_us_ = now_us;
      return last_ = {};
    case 2: {
      if (!staging_) return refuse(Refusal::no_transaction, address);
      staging_ = false;
      // Commands act when written and are not part of a set.
      for (std::size_t axis = 0; axis < axis_count; ++axis) {
        const std::size_t slot = slot_of(controlword_entry, axis);
        staged_.set_raw(slot, values_.raw(slot));
      }
      return apply(staged_, armed);
    }
    default:
      return refuse(Refusal::out_of_range, address);
  }
}

DeviceRegisters::WriteResult DeviceRegisters::write(std::uint16_t address, std::span<const std::uint16_t> in,
                                                    bool armed, std::uint32_t now_us) {
  poll(now_us);
  if (in.size() == 1 && address == register_address(transaction_entry, 0))
    return control_transaction(address, in[0], armed, now_us);
  // A command and no value; the application takes it before it comes here, if it has a store.
  if (in.size() == 1 && address == register_address(store_entry, 0))
    return refuse(in[0] > descriptors[store_entry].maximum ? Refusal::out_of_range : Refusal::store_missing,
                  address);

  for (std::size_t axis = 0; axis < axis_count; ++axis) {
    if (in.size() == 1 && address == register_address(controlword_entry, axis)) {
      values_.set_raw(slot_of(controlword_entry, axis), in[0]);
      commanded_[axis] = true;
      return last_ = {};
    }
  }

  if (dropped_) return refuse(Refusal::no_transaction, address);
  ParameterValues wanted = staging_ ? staged_ : values_;
  const WriteResult checked = check_and_set(wanted, address, in, armed);
  if (checked.refusal != Refusal::none) return refuse(checked.refusal, checked.address);
  if (staging_) {
    staged_ = wanted;
    last_staged_us_ = now_us;
    return last_ = {};
  }
  return apply(wanted, armed);
}

}  // namespace kmax::firmware
