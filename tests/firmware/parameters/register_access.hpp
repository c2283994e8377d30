#pragma once

#include <gtest/gtest.h>

#include <string_view>
#include <vector>

#include "firmware/links/modbus_registers.hpp"
#include "tests/firmware/register_words.hpp"

namespace kmax::firmware {

/// Parameters as a Modbus client reads and writes them.
struct RegisterAccess : ParameterAccess {
  using ParameterAccess::read;
  using ParameterAccess::write;

  Result write(std::uint16_t address, std::span<const std::uint16_t> in, const ArmedAxes& armed,
               std::uint32_t now_us, Link by = Link::serial) {
    const modbus::WantedValues wanted = modbus::wanted_values(address, in);
    if (wanted.refusal != Refusal::none) return refuse(wanted.refusal, wanted.address);
    return write(wanted.values(), by, armed, now_us);
  }
  void read(bool holding, std::uint16_t address, std::span<std::uint16_t> out) const {
    modbus::read_registers(*this, holding, address, out);
  }
  /// All parameters' bits, for "nothing has changed".
  std::vector<std::uint32_t> bits() const {
    std::vector<std::uint32_t> all;
    for (std::size_t slot = 0; slot < slot_count; ++slot) all.push_back(values().raw(slot));
    return all;
  }
};

/// The same by name, disarmed unless it says otherwise.
class NamedParameters : public testing::Test {
 protected:
  Refusal write(std::string_view name, const Words& words, bool armed = false, std::size_t axis = 0) {
    return registers.write(address_of(name, axis), words, armed, now).refusal;
  }
  Refusal set(std::string_view name, double number, bool armed = false, std::size_t axis = 0) {
    return write(name, words_for(name, number), armed, axis);
  }
  Refusal control(std::uint16_t request, bool armed = false) {
    return write("transaction.control", {request}, armed);
  }
  double get(std::string_view name, std::size_t axis = 0) {
    const Entry& entry = entry_at(entry_named(name));
    Words words(register_count(entry.type));
    registers.read(entry.access == Access::read_write, address_of(name, axis), words);
    return number_in(name, words);
  }

  RegisterAccess registers;
  std::uint32_t now = 1000;
};

}  // namespace kmax::firmware
