#include "firmware/links/modbus_registers.hpp"

#include <algorithm>
#include <optional>

#include "firmware/board_interface/board_identity.hpp"
#include "firmware/object_dictionary/firmware_version.hpp"

namespace kmax::firmware::modbus {

namespace {
/// Where a value is in its table.
struct Place {
  std::uint16_t address;
  std::uint16_t words;
  std::size_t slot;
};

/// Made when compiled: the entries of one table in the order of their registers, of axis 0 or of the device.
template <bool writable>
inline constexpr auto entries_by_register = [] {
  constexpr auto count = std::count_if(descriptors.begin(), descriptors.end(),
                                       [](const SlotDescriptor& d) { return d.writable == writable; });
  std::array<std::uint16_t, count> entries{};
  std::size_t next = 0;
  for (std::size_t entry = 0; entry < entry_count; ++entry) {
    if (descriptors[entry].writable == writable) entries[next++] = static_cast<std::uint16_t>(entry);
  }
  std::sort(entries.begin(), entries.end(),
            [](std::size_t a, std::size_t b) { return descriptors[a].address < descriptors[b].address; });
  return entries;
}();

std::optional<Place> find(bool holding, std::uint32_t address) {
  const std::span<const std::uint16_t> entries =
      holding ? std::span<const std::uint16_t>(entries_by_register<true>) : entries_by_register<false>;
  for (std::size_t axis = 0; axis < axis_count; ++axis) {
    const std::size_t offset = axis * axis_modbus_offset;
    if (address < offset) break;
    const auto after =
        std::upper_bound(entries.begin(), entries.end(), address - offset,
                         [](std::uint32_t a, std::size_t entry) { return a < descriptors[entry].address; });
    if (after == entries.begin()) continue;
    const std::size_t entry = *(after - 1);
    const SlotDescriptor& d = descriptors[entry];
    const std::uint16_t words = register_count(d.type);
    if (address - offset < std::uint32_t{d.address} + words && (axis == 0 || d.per_axis))
      return {{static_cast<std::uint16_t>(d.address + offset), words, slot_of(entry, axis)}};
  }
  return std::nullopt;
}

/// A register that holds more than the byte of an 8-bit type is that number, not its low byte: out of range.
std::uint32_t pattern_of(Type type, std::uint16_t word) {
  return is_signed(type) ? extended(word > 0xFF ? Type::integer16 : type, word) : word;
}
}  // namespace

bool readable(bool holding, std::uint32_t address, std::size_t count) {
  for (std::uint32_t a = address; a < address + count;) {
    const std::optional<Place> place = find(holding, a);
    if (!place) return false;
    a = place->address + std::uint32_t{place->words};
  }
  return true;
}

void read_registers(const ParameterAccess& parameters, bool holding, std::uint16_t address,
                    std::span<std::uint16_t> out) {
  for (std::size_t i = 0; i < out.size(); ++i) {
    const auto a = static_cast<std::uint16_t>(address + i);
    const std::optional<Place> place = find(holding, a);
    const std::uint32_t raw = parameters.read(place->slot);
    out[i] = static_cast<std::uint16_t>(place->words == 2 && a == place->address ? raw >> 16 : raw);
  }
}

WantedValues wanted_values(std::uint16_t address, std::span<const std::uint16_t> in) {
  WantedValues wanted;
  for (std::size_t i = 0; i < in.size();) {
    wanted.address = static_cast<std::uint16_t>(address + i);
    const std::optional<Place> place = find(true, wanted.address);
    const bool whole = place && place->address == wanted.address && i + place->words <= in.size();
    if (!whole) {
      wanted.refusal = place ? Refusal::value_cut_in_two : Refusal::unknown_register;
      return wanted;
    }
    wanted.storage[wanted.count++] = {
        place->slot, place->words == 2 ? std::uint32_t{in[i]} << 16 | in[i + 1]
                                       : pattern_of(descriptors[owner_of(place->slot).entry].type, in[i])};
    i += place->words;
  }
  return wanted;
}

Exception exception_for(Refusal refusal) {
  switch (refusal) {
    case Refusal::none:
      return Exception::none;
    case Refusal::unknown_register:
    case Refusal::read_only:
    case Refusal::value_cut_in_two:
      return Exception::illegal_data_address;
    case Refusal::while_armed:
    case Refusal::only_tightens:
    case Refusal::other_commander:
    case Refusal::armed_by_broadcast:
    case Refusal::no_transaction:
    case Refusal::no_code:
    case Refusal::store_missing:
    case Refusal::capture_missing:
      return Exception::server_device_failure;
    case Refusal::transaction_open:
    case Refusal::store_busy:
    case Refusal::code_waits:
      return Exception::server_device_busy;
    case Refusal::locked:
      return Exception::negative_acknowledge;
    default:
      return Exception::illegal_data_value;
  }
}

}  // namespace kmax::firmware::modbus

namespace kmax::firmware {

using modbus::Exception;

bool ModbusRegisters::has_holding(std::uint16_t address, std::uint16_t count) const {
  return modbus::readable(true, address, count);
}

Exception ModbusRegisters::read_holding(std::uint16_t address, std::span<std::uint16_t> out) {
  if (!modbus::readable(true, address, out.size())) return Exception::illegal_data_address;
  modbus::read_registers(of_.parameters, true, address, out);
  return Exception::none;
}

Exception ModbusRegisters::read_input(std::uint16_t address, std::span<std::uint16_t> out) {
  const auto last = static_cast<std::uint32_t>(address + out.size() - 1);
  if (Trace::contains(address) && Trace::contains(last)) {
    for (std::size_t i = 0; i < out.size(); ++i)
      out[i] = of_.axes.tick().trace().word_at(static_cast<std::uint16_t>(address + i));
    return Exception::none;
  }
  if (Capture::contains(address) && Capture::contains(last)) {
    // Zeros must not be taken for data.
    if (!of_.axes.tick().capture().readable()) return Exception::server_device_busy;
    for (std::size_t i = 0; i < out.size(); ++i)
      out[i] = of_.axes.tick().capture().word_at(static_cast<std::uint16_t>(address + i));
    return Exception::none;
  }
  if (address >= fault_log_window && last < fault_log_window + fault_log_registers) {
    for (std::size_t i = 0; i < out.size(); ++i) {
      const std::size_t at = address - fault_log_window + i;
      const std::uint32_t word = of_.axes.log().word(at / (2 * fault_log_words), at / 2 % fault_log_words);
      out[i] = static_cast<std::uint16_t>(at % 2 == 0 ? word >> 16 : word);
    }
    return Exception::none;
  }
  if (!modbus::readable(false, address, out.size())) return Exception::illegal_data_address;
  of_.readings.refresh();
  modbus::read_registers(of_.parameters, false, address, out);
  return Exception::none;
}

Exception ModbusRegisters::write_holding(std::uint16_t address, std::span<const std::uint16_t> in) {
  const modbus::WantedValues wanted = modbus::wanted_values(address, in);
  if (wanted.refusal != Refusal::none) {
    of_.parameters.refuse(wanted.refusal, wanted.address);
    return modbus::exception_for(wanted.refusal);
  }
  if (broadcast_) {
    for (const SlotValue& one : wanted.values()) {
      if (owner_of(one.slot).entry == entry_of<"drive.controlword">() &&
          asks_for_operation(one.raw & 0xFFFFU)) {
        of_.parameters.refuse_slot(Refusal::armed_by_broadcast, one.slot);
        return modbus::exception_for(Refusal::armed_by_broadcast);
      }
    }
  }
  return modbus::exception_for(of_.writes.write(wanted.values(), link_).refusal);
}

std::string_view ModbusRegisters::identification(std::uint8_t object_id) const {
  switch (object_id) {
    case 0:
      return "Kmax";
    case 1:
      return "kmax-haptic-controller";
    case 2:
      return firmware_version_text;
    case 4:
      return "Kmax haptic device controller";
    case 5:
      return of_.board.board_name;
    default:
      return {};
  }
}

}  // namespace kmax::firmware
