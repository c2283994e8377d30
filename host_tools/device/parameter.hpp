#pragma once

#include <compare>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "firmware/canopen/object_access.hpp"
#include "firmware/object_dictionary/dictionary.hpp"

namespace kmax::device {

enum class Table : std::uint8_t { holding, input };

/// One value of a device: an entry of the object dictionary on one axis (0 for entries of the device).
/// Everything about it is looked up in the dictionary.
class Parameter {
 public:
  constexpr Parameter(std::size_t entry, std::size_t axis)
      : entry_(entry), axis_(firmware::entry_at(entry).scope() == firmware::Scope::axis ? axis : 0) {}

  /// A name that does not exist does not compile.
  template <firmware::FixedName name>
  static constexpr Parameter of(std::size_t axis = 0) {
    return {firmware::entry_of<name>(), axis};
  }

  /// The owner of a slot of the dictionary.
  static constexpr Parameter at(std::size_t slot) {
    const firmware::SlotOwner owner = firmware::owner_of(slot);
    return {owner.entry, owner.axis};
  }

  constexpr const firmware::Entry& definition() const { return firmware::entry_at(entry_); }
  constexpr std::size_t entry() const { return entry_; }
  constexpr std::size_t axis() const { return axis_; }
  constexpr std::size_t slot() const { return firmware::slot_of(entry_, axis_); }
  constexpr bool belongs_to_axis() const { return definition().scope() == firmware::Scope::axis; }
  constexpr bool writable() const { return definition().access == firmware::Access::read_write; }
  constexpr Table table() const { return writable() ? Table::holding : Table::input; }
  constexpr std::uint16_t address() const { return firmware::modbus_address(entry_, axis_); }
  constexpr std::uint16_t words() const { return firmware::register_count(definition().type); }
  constexpr std::size_t bytes() const { return firmware::bytes_of(definition().type); }
  /// The slot's 32 bits from as many as its type has, which are the lowest of `bits`: signed ones keep their
  /// sign.
  constexpr std::uint32_t extended(std::uint32_t bits) const {
    return firmware::extended(definition().type, bits);
  }
  constexpr std::uint32_t default_raw() const {
    return firmware::raw_from_number(definition().type, definition().default_value);
  }
  constexpr std::uint16_t index() const {
    return static_cast<std::uint16_t>(definition().index() + axis_ * firmware::axis_index_offset);
  }

  constexpr firmware::canopen::ObjectAddress object() const {
    return {index(), definition().object_subindex()};
  }

  /// Axis 0 and the device without a prefix, other axes as axisN.NAME.
  std::string name() const;

  friend constexpr auto operator<=>(const Parameter&, const Parameter&) = default;

 private:
  std::size_t entry_;
  std::size_t axis_;
};

/// All of them: axis 0, the device, then the further axes.
const std::vector<Parameter>& all_parameters();

/// Resolves `wall.stiffness`, `axis1.wall.stiffness`, `link.timeout`. A name without a prefix is on
/// `default_axis`. Errors: ValueError, with suggestions.
Parameter resolve(std::string_view name, std::size_t default_axis = 0);

/// Names a user may have meant, most likely first.
std::vector<std::string> suggest(std::string_view name);

/// The holding register's owner, if it has one: what refusal.register names.
std::optional<Parameter> owner_of_holding_register(std::uint16_t address);

}  // namespace kmax::device
