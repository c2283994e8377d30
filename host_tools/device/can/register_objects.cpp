#include "host_tools/device/can/register_objects.hpp"

#include <map>

#include "firmware/canopen/object_places.hpp"

namespace kmax::link {

namespace {
using firmware::Access;
using firmware::Scope;

using Table = std::map<std::uint16_t, RegisterObject>;

Table make_table(bool holding) {
  Table table;
  for (std::size_t slot = 0; slot < firmware::slot_count; ++slot) {
    const auto [entry, axis] = firmware::owner_of(slot);
    const firmware::Entry& definition = firmware::entry_at(entry);
    if ((definition.access == Access::read_write) != holding) continue;
    const std::uint16_t address = firmware::modbus_address(entry, axis);
    const std::size_t offset = definition.scope() == Scope::axis ? axis * firmware::axis_index_offset : 0;
    table[address] = {
        entry,
        address,
        {static_cast<std::uint16_t>(definition.index() + offset), definition.object_subindex()}};
  }
  return table;
}

const Table& table_of(RegisterTable kind) {
  static const Table holding = make_table(true), input = make_table(false);
  return kind == RegisterTable::holding ? holding : input;
}
}  // namespace

std::optional<std::vector<RegisterObject>> objects_in(RegisterTable kind, std::uint16_t address,
                                                      std::size_t count) {
  const Table& table = table_of(kind);
  std::vector<RegisterObject> values;
  for (std::size_t covered = 0; covered < count;) {
    if (address + covered > 0xFFFF) return std::nullopt;
    const auto found = table.find(static_cast<std::uint16_t>(address + covered));
    if (found == table.end()) return std::nullopt;
    covered += found->second.words();
    if (covered > count) return std::nullopt;
    values.push_back(found->second);
  }
  return values;
}

std::vector<std::uint16_t> registers_from_bytes(const RegisterObject& value, std::uint8_t node,
                                                std::span<const std::uint8_t> bytes) {
  const firmware::Entry& definition = value.definition();
  std::uint32_t raw = 0;
  for (std::size_t i = 0; i < value.bytes(); ++i) raw |= std::uint32_t{bytes[i]} << (8 * i);
  if (definition.type == firmware::Type::integer8)
    raw = static_cast<std::uint32_t>(static_cast<std::int32_t>(static_cast<std::int8_t>(raw)));
  if (definition.node_relative)
    raw = firmware::canopen::stored_cob_id(raw, static_cast<std::uint32_t>(definition.default_value), node);
  if (value.words() == 1) return {static_cast<std::uint16_t>(raw)};
  return {static_cast<std::uint16_t>(raw >> 16), static_cast<std::uint16_t>(raw)};
}

std::optional<std::vector<std::uint8_t>> bytes_from_registers(const RegisterObject& value,
                                                              std::span<const std::uint16_t> registers) {
  std::uint32_t raw = registers[0];
  if (value.words() == 2) raw = raw << 16 | registers[1];
  if (value.bytes() == 1) {
    const auto number = static_cast<std::int16_t>(raw);
    const bool is_signed = firmware::is_signed(value.definition().type);
    if (is_signed ? number < -128 || number > 127 : raw > 0xFF) return std::nullopt;
  }
  std::vector<std::uint8_t> bytes;
  for (std::size_t i = 0; i < value.bytes(); ++i) bytes.push_back(static_cast<std::uint8_t>(raw >> (8 * i)));
  return bytes;
}

}  // namespace kmax::link
