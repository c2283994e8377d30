// Which registers there are, against the dictionary itself: each address of both tables.
#include <gtest/gtest.h>

#include <array>
#include <vector>

#include "tests/firmware/parameters/register_access.hpp"

namespace kmax::firmware::modbus::parameter_registers_test {
namespace {

TEST(ParameterRegisters, EveryAddressHoldsTheWordThatTheDictionarySays) {
  struct Word {
    bool there = false;
    std::uint16_t value = 0;
  };
  RegisterAccess registers;
  std::array<std::vector<Word>, 2> tables{std::vector<Word>(0x10000), std::vector<Word>(0x10000)};
  for (std::size_t slot = 0; slot < slot_count; ++slot) {
    const auto [entry, axis] = owner_of(slot);
    const auto raw = static_cast<std::uint32_t>(0x1234'8000U + 7 * slot);
    registers.values().set_raw(slot, raw);
    const std::size_t words = register_count(entry_at(entry).type);
    for (std::size_t word = 0; word < words; ++word) {
      Word& at = tables[entry_at(entry).access == Access::read_write][modbus_address(entry, axis) + word];
      EXPECT_FALSE(at.there) << entry_at(entry).name;
      at = {true, static_cast<std::uint16_t>(words == 2 && word == 0 ? raw >> 16 : raw)};
    }
  }
  for (const bool holding : {false, true}) {
    for (std::size_t address = 0; address < 0x10000; ++address) {
      const Word& word = tables[holding][address];
      const auto at = static_cast<std::uint16_t>(address);
      ASSERT_EQ(readable(holding, at, 1), word.there) << holding << " " << address;
      std::array<std::uint16_t, 1> read{};
      if (word.there) registers.read(holding, at, read);
      ASSERT_EQ(read[0], word.value) << holding << " " << address;
    }
  }
  EXPECT_FALSE(readable(true, 0x10000, 1));
}

}  // namespace
}  // namespace kmax::firmware::modbus::parameter_registers_test
