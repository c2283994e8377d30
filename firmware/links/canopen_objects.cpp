#include "firmware/links/canopen_objects.hpp"

#include <algorithm>

#include "firmware/board_interface/board_identity.hpp"
#include "firmware/canopen/communication_rules.hpp"
#include "firmware/canopen/copy_bytes.hpp"
#include "firmware/canopen/node.hpp"
#include "firmware/object_dictionary/firmware_version.hpp"

namespace kmax::firmware {

using canopen::Abort;
using canopen::ObjectAddress;

namespace {

Abort abort_for(Refusal refusal, const SlotDescriptor& entry, std::uint32_t raw) {
  switch (refusal) {
    case Refusal::none:
      return Abort::none;
    case Refusal::out_of_range: {
      bool above = false;
      if (entry.type == Type::float32) {
        above = std::bit_cast<float>(raw) > std::bit_cast<float>(entry.maximum());
      } else if (is_signed(entry.type)) {
        above = static_cast<std::int32_t>(raw) > static_cast<std::int32_t>(entry.maximum());
      } else {
        above = raw > entry.maximum();
      }
      return above ? Abort::value_too_high : Abort::value_too_low;
    }
    case Refusal::not_a_choice:
    case Refusal::not_finite:
    case Refusal::wrong_code:
      return Abort::value_range;
    case Refusal::adaptive_interval_empty:
    case Refusal::supply_interval_empty:
    case Refusal::supply_above_ceiling:
      return Abort::maximum_below_minimum;
    case Refusal::rate_does_not_divide:
    case Refusal::compensation_beyond_friction:
    case Refusal::guard_refused:
      return Abort::incompatible;
    case Refusal::capture_without_channels:
      return Abort::incompatible_inside;
    case Refusal::transaction_open:
      return Abort::local_control;
    case Refusal::store_missing:
    case Refusal::capture_missing:
      return Abort::hardware;
    case Refusal::read_only:
      return Abort::read_only;
    case Refusal::locked:
      return Abort::unsupported_access;
    default:
      return Abort::device_state;
  }
}

std::uint32_t little_endian(std::span<const std::uint8_t> in) {
  std::uint32_t raw = 0;
  for (std::size_t i = 0; i < in.size(); ++i) raw |= std::uint32_t{in[i]} << (8 * i);
  return raw;
}

void put_bytes(std::uint32_t value, std::uint32_t offset, std::span<std::uint8_t> out) {
  for (std::size_t i = 0; i < out.size(); ++i)
    out[i] = static_cast<std::uint8_t>(value >> (8 * ((offset + i) & 3U)));
}

/// Bytes from `offset` of a sequence of 32-bit words.
template <typename Word>
void put_words(std::uint32_t offset, std::span<std::uint8_t> out, Word word) {
  std::size_t done = 0;
  while (done < out.size()) {
    const std::uint32_t at = offset + static_cast<std::uint32_t>(done);
    const std::size_t piece = std::min<std::size_t>(out.size() - done, 4 - at % 4);
    put_bytes(word(at / 4), at, out.subspan(done, piece));
    done += piece;
  }
}

}  // namespace

const CanopenObjects::Place& CanopenObjects::find(ObjectAddress address) {
  if (found_.address == address) return found_;
  found_ = {address, Abort::none, canopen::slot_at(address)};
  if (found_.slot) return found_;
  found_.special = canopen::special_at(address);
  if (found_.special != nullptr) return found_;
  const auto highest = canopen::highest_subindex(address.index);
  if (!highest)
    found_.abort = Abort::no_object;
  else if (address.subindex != 0 || *highest == 0)
    found_.abort = Abort::no_subindex;
  return found_;
}

Abort CanopenObjects::special_size(const canopen::SpecialPlace& place, std::uint8_t subindex,
                                   std::uint32_t& size) const {
  switch (place.what) {
    case SpecialObject::error_register:
    case SpecialObject::error_history_count:
      size = 1;
      return Abort::none;
    case SpecialObject::error_history:
      size = 4;
      return subindex <= node_.emergency().history_count() ? Abort::none : Abort::no_subindex;
    case SpecialObject::device_type:
    case SpecialObject::store_parameters:
    case SpecialObject::restore_defaults:
    case SpecialObject::sdo_request:
    case SpecialObject::sdo_response:
      size = 4;
      return Abort::none;
    case SpecialObject::device_name:
    case SpecialObject::hardware_version:
    case SpecialObject::software_version:
      size = static_cast<std::uint32_t>(text_of(place.what).size());
      return Abort::none;
    case SpecialObject::trace_records:
      size = trace_object_bytes;
      return Abort::none;
    case SpecialObject::capture_samples: {
      if (!of_.axes.tick().capture().readable()) return Abort::device_state;
      const CaptureReadings readings = of_.axes.tick().capture().readings();
      size = 4 * readings.taken * readings.channels;
      return Abort::none;
    }
    case SpecialObject::fault_log:
      size = 4 * fault_log_words;
      return Abort::none;
    case SpecialObject::scratch:
      size = scratch_size_;
      return Abort::none;
  }
  return Abort::general;
}

Abort CanopenObjects::read_begin(ObjectAddress address, std::uint32_t& size) {
  const auto& [asked, abort, slot, special] = find(address);
  if (abort != Abort::none) return abort;
  if (special != nullptr) return special_size(*special, address.subindex, size);
  size = slot ? bytes_of(descriptors[owner_of(*slot).entry].type) : 1U;
  return Abort::none;
}

std::uint32_t CanopenObjects::number_of(const canopen::SpecialPlace& place, std::uint8_t subindex) const {
  const auto& emergency = node_.emergency();
  switch (place.what) {
    case SpecialObject::device_type:
      return device_type_of_several_axes;
    case SpecialObject::error_register:
      return emergency.error_register();
    case SpecialObject::error_history_count:
      return emergency.history_count();
    case SpecialObject::error_history:
      return emergency.history_at(subindex - 1U);
    case SpecialObject::sdo_request:
      return canopen::cob_id::sdo_request + node_.node_id();
    case SpecialObject::sdo_response:
      return canopen::cob_id::sdo_response + node_.node_id();
    case SpecialObject::store_parameters:
    case SpecialObject::restore_defaults:
      return 1;  // on command
    case SpecialObject::device_name:
    case SpecialObject::hardware_version:
    case SpecialObject::software_version:
    case SpecialObject::trace_records:
    case SpecialObject::capture_samples:
    case SpecialObject::scratch:
    case SpecialObject::fault_log:
      break;  // no numbers: read_special() has them
  }
  return 0;
}

std::span<const char> CanopenObjects::text_of(SpecialObject what) const {
  constexpr std::string_view name = "Kmax haptic device controller";
  if (what == SpecialObject::device_name) return name;
  if (what == SpecialObject::hardware_version) return of_.board.board_name;
  return firmware_version_text;
}

Abort CanopenObjects::read_special(const canopen::SpecialPlace& place, std::uint8_t subindex,
                                   std::uint32_t offset, std::span<std::uint8_t> out) const {
  switch (place.what) {
    case SpecialObject::device_name:
    case SpecialObject::hardware_version:
    case SpecialObject::software_version: {
      const auto text = text_of(place.what);
      std::transform(text.begin() + offset, text.begin() + offset + static_cast<std::ptrdiff_t>(out.size()),
                     out.begin(), [](char c) { return static_cast<std::uint8_t>(c); });
      return Abort::none;
    }
    case SpecialObject::trace_records: {
      const auto first = trace_window + (subindex - 1U) * (trace_object_bytes / 2);
      put_words(offset, out, [&](std::uint32_t word) {
        const auto high = static_cast<std::uint16_t>(first + 2 * word);
        return std::uint32_t{of_.axes.tick().trace().word_at(high)} << 16 |
               of_.axes.tick().trace().word_at(static_cast<std::uint16_t>(high + 1));
      });
      return Abort::none;
    }
    case SpecialObject::capture_samples:
      if (!of_.axes.tick().capture().readable()) return Abort::device_state;  // another capture has begun
      put_words(offset, out, [&](std::uint32_t word) { return of_.axes.tick().capture().value_at(word); });
      return Abort::none;
    case SpecialObject::fault_log:
      put_words(offset, out, [&](std::uint32_t word) { return of_.axes.log().word(subindex - 1U, word); });
      return Abort::none;
    case SpecialObject::scratch:
      canopen::copy_bytes(std::span(scratch_).subspan(offset, out.size()), out);
      return Abort::none;
    default:
      put_bytes(number_of(place, subindex), offset, out);
      return Abort::none;
  }
}

Abort CanopenObjects::read(ObjectAddress address, std::uint32_t offset, std::span<std::uint8_t> out) {
  const auto& [asked, abort, slot, special] = find(address);
  if (abort != Abort::none) return abort;
  if (special != nullptr) return read_special(*special, address.subindex, offset, out);
  if (!slot) {
    put_bytes(canopen::highest_subindex(address.index).value_or(0), offset, out);
    return Abort::none;
  }
  if (!descriptors[owner_of(*slot).entry].kept) of_.readings.refresh(*slot);
  put_bytes(value(*slot), offset, out);
  return Abort::none;
}

Abort CanopenObjects::write_begin(ObjectAddress address, canopen::WriteBounds& bounds) {
  const auto& [asked, abort, slot, special] = find(address);
  if (abort != Abort::none) return abort;
  if (special != nullptr) {
    if (special->access != ObjectAccessKind::read_write) return Abort::read_only;
    const bool scratch = special->what == SpecialObject::scratch;
    const std::uint32_t bytes = special->type == ObjectType::unsigned8 ? 1 : 4;
    bounds = scratch ? canopen::WriteBounds{1, scratch_bytes} : canopen::WriteBounds{bytes, bytes};
    return Abort::none;
  }
  if (!slot || !descriptors[owner_of(*slot).entry].kept) return Abort::read_only;
  const std::uint32_t bytes = bytes_of(descriptors[owner_of(*slot).entry].type);
  bounds = {bytes, bytes};
  return Abort::none;
}

/// Of what is longer than a read of it and changes: the scratch pad, and a capture after which another one
/// has been taken. Every transfer asks, so that nothing is searched for.
std::uint32_t CanopenObjects::version(ObjectAddress address) const {
  constexpr std::uint16_t scratch = index_of(SpecialObject::scratch);
  constexpr std::uint16_t capture = index_of(SpecialObject::capture_samples);
  if (address.index == scratch) return scratch_version_;
  if (address.index != capture) return 0;
  return of_.axes.tick().capture().readings().first_tick;
}

Abort CanopenObjects::write(ObjectAddress address, std::span<const std::uint8_t> in, std::uint8_t server) {
  const auto& [asked, abort, slot, special] = find(address);
  if (abort != Abort::none) return abort;
  if (special != nullptr) return write_special(*special, in);
  if (!slot) return Abort::read_only;
  const std::uint32_t raw = extended(descriptors[owner_of(*slot).entry].type, little_endian(in));
  return write_slot(*slot, raw, can_links[server]);
}

Abort CanopenObjects::write_special(const canopen::SpecialPlace& place, std::span<const std::uint8_t> in) {
  switch (place.what) {
    case SpecialObject::error_history_count:
      if (of_.parameters.locked()) {
        of_.parameters.refuse_slot(Refusal::locked, slot_of(entry_of<"lock.code">(), 0));
        return abort_for(Refusal::locked, {}, 0);
      }
      if (in[0] != 0) return Abort::value_range;
      node_.emergency().erase_history();
      return Abort::none;
    case SpecialObject::store_parameters:
      if (little_endian(in) != signature_save) return Abort::not_transferred;
      return abort_for(of_.store.save(of_.axes.any_armed()).refusal, {}, 0);
    case SpecialObject::restore_defaults:
      if (little_endian(in) != signature_load) return Abort::not_transferred;
      return abort_for(of_.store.save_defaults(of_.axes.any_armed()).refusal, {}, 0);
    case SpecialObject::scratch:
      canopen::copy_bytes(in, scratch_);
      scratch_size_ = static_cast<std::uint32_t>(in.size());
      ++scratch_version_;
      return Abort::none;
    default:
      return Abort::read_only;
  }
}

/// A command is a sign of life of whoever commands, if it is taken; before it acts, since the command to arm
/// needs it. A setting is none, in a PDO or not: any tool on the bus may write one.
Abort CanopenObjects::write_slot(std::size_t slot, std::uint32_t raw, Link by) {
  if (!acts_at_once(slot)) return set_slot(slot, raw, by);
  LinkState& link = of_.links[by];
  const LinkState before = link;
  link.heard_us = of_.axes.now_us();
  const auto owner = owner_of(slot);
  if (descriptors[owner.entry].per_axis) link.heard_over_usb[owner.axis] = over_usb_;
  const Abort abort = set_slot(slot, raw, by);
  if (abort != Abort::none) {
    link.heard_us = before.heard_us;
    link.heard_over_usb = before.heard_over_usb;
  }
  return abort;
}

Abort CanopenObjects::set_slot(std::size_t slot, std::uint32_t raw, Link by) {
  const SlotDescriptor& descriptor = descriptors[owner_of(slot).entry];
  if (!descriptor.writable) {
    const std::uint8_t node_id = node_.node_id();
    // Locked comes first: what would be right in another order of writes, or not, is no matter then.
    const Abort abort = of_.parameters.locked()
                            ? Abort::none
                            : canopen::check_communication(of_.parameters.values(), slot, raw, node_id);
    if (abort != Abort::none) return abort;
    const std::uint32_t stored = canopen::stored_communication(slot, raw, node_id);
    return abort_for(of_.parameters.write_communication(slot, stored, of_.axes.armed()).refusal, descriptor,
                     raw);
  }
  const SlotValue one{slot, raw};
  return abort_for(of_.writes.write({&one, 1}, by).refusal, descriptor, raw);
}

void CanopenObjects::refresh() {
  of_.readings.refresh();
}

std::uint32_t CanopenObjects::value(std::size_t slot) const {
  const std::uint32_t raw = of_.parameters.values().raw(slot);
  return canopen::is_communication(slot) ? canopen::shown_communication(slot, raw, node_.node_id()) : raw;
}

bool CanopenObjects::take(std::size_t slot, std::uint32_t raw) {
  const Supervisor& supervisor = of_.axes.supervisor(owner_of(slot).axis);
  const bool commanded = supervisor.makes_force() && is_can(supervisor.commander());
  return write_slot(slot, raw, commanded ? supervisor.commander() : Link::can) == Abort::none;
}

}  // namespace kmax::firmware
