#include "firmware/command/parameter_access.hpp"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <bit>
#include <cmath>
#include <limits>
#include <utility>
#include <vector>

#include "firmware/command/armed_change.hpp"
#include "tests/firmware/parameters/register_access.hpp"

namespace kmax::firmware::parameter_access_test {
namespace {

// What is set together with a parameter.
std::string_view partner_of(std::string_view name) {
  constexpr std::pair<std::string_view, std::string_view> pairs[] = {
      {"drive.mode", "profile.operation_mode"}, {"encoder.direction", "profile.polarity"}};
  for (const auto& [own, standard] : pairs) {
    if (name == own) return standard;
    if (name == standard) return own;
  }
  return {};
}

struct Written {
  RegisterAccess registers;
  ParameterAccess::Result write(std::uint16_t address, Words words, bool armed = false,
                                std::uint32_t now = 0) {
    return registers.write(address, words, armed, now);
  }
  ParameterAccess::Result write(std::string_view name, double number, std::size_t axis = 0,
                                bool armed = false) {
    return write(address_of(name, axis), words_for(name, number), armed);
  }
  Words read(bool holding, std::uint16_t address, std::size_t count) {
    Words words(count);
    registers.read(holding, address, words);
    return words;
  }
};

TEST(ParameterAccess, EveryParameterCanBeWrittenToItsBoundsAndReadBackOnEveryAxis) {
  for (std::size_t slot = 0; slot < slot_count; ++slot) {
    const auto [entry, axis] = owner_of(slot);
    const Entry& e = entry_at(entry);
    if (e.access != Access::read_write || e.name == "transaction.control" || e.name == "store.command" ||
        e.group.name == "lock")
      continue;
    std::vector<double> numbers = {e.minimum, e.maximum, e.default_value};
    for (const NamedValue& v : e.values) numbers.push_back(v.value);
    for (const double number : numbers) {
      if (!e.values.empty() &&
          check_value(descriptors[entry], raw_from_number(e.type, number)) != Refusal::none)
        continue;
      Written w;
      const auto before = w.registers.bits();
      const Words words = words_for(e.name, number);
      const auto result = w.write(modbus_address(entry, axis), words);
      if (e.name == "wall.adaptive_force_min" || e.name == "wall.adaptive_force_max" ||
          e.name == "supply.voltage_min" || e.name == "supply.voltage_max" ||
          e.name == "compensation.limit") {
        if (result.refusal != Refusal::none) {  // a rule between two parameters
          EXPECT_EQ(w.registers.bits(), before);
          continue;
        }
      }
      EXPECT_EQ(result.refusal, Refusal::none) << e.name << " = " << number;
      EXPECT_EQ(w.read(true, modbus_address(entry, axis), words.size()), words) << e.name;
      auto expected = before;
      expected[slot] = raw_from_number(e.type, number);
      // The same thing in another standard's numbers; which ones, parameter_access_linked_test.cpp says.
      if (const std::string_view other = partner_of(e.name); !other.empty())
        expected[slot_of(entry_named(other), axis)] = w.registers.bits()[slot_of(entry_named(other), axis)];
      EXPECT_EQ(w.registers.bits(), expected) << e.name << ": nothing else may change";
    }
  }
}

TEST(ParameterAccess, WhatIsOutOfRangeIsRefusedWithReasonAndRegisterAndChangesNothing) {
  for (std::size_t slot = 0; slot < slot_count; ++slot) {
    const auto [entry, axis] = owner_of(slot);
    const Entry& e = entry_at(entry);
    if (e.access != Access::read_write || e.name == "transaction.control" || e.name == "drive.controlword")
      continue;
    std::vector<std::pair<Words, Refusal>> wrong;
    const Refusal outside = e.values.empty() ? Refusal::out_of_range : Refusal::not_a_choice;
    if (e.type == Type::float32) {
      const auto low = static_cast<float>(e.minimum), high = static_cast<float>(e.maximum);
      wrong.push_back({words_of_float(std::nextafter(low, -1e30f)), outside});
      wrong.push_back({words_of_float(std::nextafter(high, 1e30f)), outside});
      wrong.push_back({words_of_float(std::numeric_limits<float>::quiet_NaN()), Refusal::not_finite});
      wrong.push_back({words_of_float(-std::numeric_limits<float>::infinity()), Refusal::not_finite});
    } else if (register_count(e.type) == 1) {
      // Of a signed number all 16 bits may be allowed.
      const bool all = e.type == Type::integer16 && e.values.empty() && e.minimum <= -32768;
      if (e.maximum < 65535 && !all) wrong.push_back({{static_cast<std::uint16_t>(e.maximum + 1)}, outside});
      if (e.maximum < 65535 && e.minimum >= 0) wrong.push_back({{0xFFFF}, outside});
      if (e.minimum > 0) wrong.push_back({{static_cast<std::uint16_t>(e.minimum - 1)}, outside});
    } else if (e.type == Type::unsigned32) {
      if (e.maximum < 4294967295.0) wrong.push_back({{0xFFFF, 0xFFFF}, outside});
      if (e.minimum > 0) wrong.push_back({{0, 0}, outside});
    }
    for (const auto& [words, reason] : wrong) {
      Written w;
      const auto before = w.registers.bits();
      const auto result = w.write(modbus_address(entry, axis), words);
      EXPECT_EQ(result.refusal, reason) << e.name;
      EXPECT_EQ(result.address, modbus_address(entry, axis)) << e.name;
      EXPECT_EQ(w.registers.last_refusal().refusal, reason);
      EXPECT_EQ(w.registers.last_refusal().address, modbus_address(entry, axis));
      EXPECT_EQ(w.registers.bits(), before) << e.name;
      EXPECT_EQ(w.registers.changes(), 0u);
      EXPECT_EQ(w.write("force.limit", 1.0).refusal, Refusal::none);
      EXPECT_EQ(w.registers.last_refusal().refusal, Refusal::none) << "a later write that is taken clears it";
    }
  }
}

TEST(ParameterAccess, Signed8BitValuesComeSignExtendedOrAsABareByte) {
  const std::uint16_t side = address_of("wall.side");
  for (const unsigned form : {0xFFFFu, 0x00FFu}) {
    Written w;
    EXPECT_EQ(w.write(side, {static_cast<std::uint16_t>(form)}).refusal, Refusal::none) << form;
    EXPECT_EQ(w.registers.values().whole<"wall.side">(), -1);
    EXPECT_EQ(w.read(true, side, 1), (Words{0xFFFF}));
  }
  // Everything else in 16 bits is wrong, above all what an 8-bit cut would turn into +1 or -1.
  for (unsigned word = 0; word <= 0xFFFF; ++word) {
    if (word == 1 || word == 0xFF || word == 0xFFFF) continue;
    Written w;
    ASSERT_EQ(w.write(side, {static_cast<std::uint16_t>(word)}).refusal, Refusal::not_a_choice) << word;
  }
}

TEST(ParameterAccess, HalfOfATwoRegisterValueIsRefusedWhereverTheRangeCutsIt) {
  for (std::size_t slot = 0; slot < slot_count; ++slot) {
    const auto [entry, axis] = owner_of(slot);
    const Entry& e = entry_at(entry);
    if (e.access != Access::read_write || register_count(e.type) != 2) continue;
    const std::uint16_t first = modbus_address(entry, axis);
    const Words words = words_for(e.name, e.default_value);
    Written w;
    EXPECT_EQ(w.write(first, {words[0]}).refusal, Refusal::value_cut_in_two) << e.name;
    const auto result = w.write(static_cast<std::uint16_t>(first + 1), {words[1]});
    EXPECT_EQ(result.refusal, Refusal::value_cut_in_two) << e.name;
    EXPECT_EQ(result.address, first + 1);
    // As long as a value, but begun in the middle of one.
    const auto before = w.registers.bits();
    EXPECT_EQ(w.write(static_cast<std::uint16_t>(first + 1), words).refusal, Refusal::value_cut_in_two)
        << e.name;
    EXPECT_EQ(w.registers.bits(), before) << e.name;
  }
}

TEST(ParameterAccess, ARangeIsWrittenWholeOrNotAtAllWhicheverValueIsWrong) {
  // The whole wall record, with one wrong value at each place in turn.
  Words good;
  std::vector<std::size_t> starts;
  std::vector<std::size_t> entries;
  for (std::size_t i = 0; i < entry_count && entry_at(i).group.name == "wall"; ++i) {
    starts.push_back(good.size());
    entries.push_back(i);
    const Entry& e = entry_at(i);
    const double number = e.values.empty() ? e.default_value * 0.5 + e.minimum * 0.5 : e.values[0].value;
    for (const std::uint16_t word : words_for(e.name, number)) good.push_back(word);
  }
  ASSERT_EQ(good.size(), 38u);
  for (const std::size_t axis : {0u, 1u}) {
    const std::uint16_t base = address_of("wall.law", axis);
    Written all;
    ASSERT_EQ(all.write(base, good).refusal, Refusal::none);
    EXPECT_EQ(all.registers.changes(), 1u);
    EXPECT_EQ(all.read(true, base, good.size()), good);
    for (std::size_t i = 0; i < starts.size(); ++i) {
      Words bad = good;
      bad[starts[i]] = 0x7FC0;  // a NaN, or far out of any choice
      Written w;
      const auto before = w.registers.bits();
      const auto result = w.write(base, bad);
      EXPECT_NE(result.refusal, Refusal::none);
      EXPECT_EQ(result.address, base + starts[i]);
      EXPECT_EQ(w.registers.bits(), before) << entry_at(entries[i]).name;
    }
    Written cut;
    const auto before = cut.registers.bits();
    EXPECT_EQ(cut.write(base, Words(good.begin(), good.end() - 1)).refusal, Refusal::value_cut_in_two);
    Words longer = good;
    longer.push_back(0);
    EXPECT_EQ(cut.write(base, longer).refusal, Refusal::unknown_register);
    EXPECT_EQ(cut.registers.last_refusal().address, base + good.size());
    EXPECT_EQ(cut.registers.bits(), before);
  }
}

TEST(ParameterAccess, GapsEndsAndReadOnlyPlacesAreNotWritable) {
  Written w;
  const auto before = w.registers.bits();
  for (const unsigned address : {0x003Fu, 0x0201u, 0x07FFu, 0x0FFFu, 0x4000u, 0xFFFFu})
    EXPECT_EQ(w.write(static_cast<std::uint16_t>(address), {0}).refusal, Refusal::unknown_register)
        << address;
  // Input registers have no holding register at their number unless another value lives there.
  EXPECT_EQ(w.write(static_cast<std::uint16_t>(address_of("measured.magnetic_force")), {0, 0}).refusal,
            Refusal::unknown_register);
  EXPECT_EQ(w.write(address_of("refusal.reason"), {0}).refusal, Refusal::unknown_register);
  EXPECT_EQ(w.write(0xFFFF, {0, 0}).refusal, Refusal::unknown_register)
      << "past the end of the address space";
  // The controlword and the transaction are their own; a range over them and their gap does not act.
  EXPECT_EQ(w.write(address_of("drive.controlword"), {0x06, 0}).refusal, Refusal::unknown_register);
  EXPECT_EQ(w.write(address_of("transaction.control"), {1, 0}).refusal, Refusal::unknown_register);
  EXPECT_FALSE(w.registers.transaction_open());
  EXPECT_FALSE(w.registers.fetch_controlword(0));
  EXPECT_EQ(w.registers.bits(), before);
}

TEST(ParameterAccess, ReadableIsExactlyTheRegistersThereAre) {
  for (const bool holding : {true, false}) {
    std::vector<bool> there(0x10000, false);
    for (std::size_t slot = 0; slot < slot_count; ++slot) {
      const auto [entry, axis] = owner_of(slot);
      if ((entry_at(entry).access == Access::read_write) != holding) continue;
      for (int word = 0; word < register_count(entry_at(entry).type); ++word)
        there[static_cast<std::size_t>(modbus_address(entry, axis) + word)] = true;
    }
    for (std::uint32_t address = 0; address <= 0xFFFF; ++address) {
      bool expected = true;
      for (const std::size_t count : {1u, 2u, 3u, 27u, 125u}) {
        if (address + count > 0x10000) break;
        for (std::uint32_t a = address; a < address + count; ++a) expected = expected && there[a];
        ASSERT_EQ(modbus::readable(holding, address, count), expected) << address << " " << count;
      }
    }
    EXPECT_FALSE(modbus::readable(holding, 0xFFFF, 2));
  }
}

TEST(ParameterAccess, ReadingMayStartAndEndWithinAValue) {
  Written w;
  ASSERT_EQ(w.write("wall.position", 0.1).refusal, Refusal::none);
  const Words position = words_for("wall.position", 0.1);
  const std::uint16_t first = address_of("wall.position");
  EXPECT_EQ(w.read(true, static_cast<std::uint16_t>(first + 1), 1), (Words{position[1]}));
  EXPECT_EQ(w.read(true, static_cast<std::uint16_t>(first - 1), 2), (Words{1, position[0]}));
}

TEST(ParameterAccess, ArmedRefusesWhatMustNotChangeButTakesTheSameValueAgain) {
  for (std::size_t i = 0; i < entry_count; ++i) {
    const Entry& e = entry_at(i);
    if (e.access != Access::read_write || e.name == "transaction.control" || e.name == "drive.controlword" ||
        e.name == "store.command" || e.group.name == "lock")
      continue;
    double other = e.default_value;
    for (const NamedValue& v : e.values) other = v.value != e.default_value ? v.value : other;
    if (e.values.empty())
      other = e.name == "haptic.rate" ? 500 : e.default_value == e.minimum ? e.maximum : e.minimum;
    if (e.name == "wall.adaptive_force_max" || e.name == "supply.voltage_max") other = e.maximum;
    if (other == e.default_value) continue;  // a choice of one
    Written w;
    EXPECT_EQ(w.write(e.name, e.default_value, 0, true).refusal, Refusal::none) << e.name;
    EXPECT_EQ(w.registers.changes(), 0u);
    const bool restarts = e.change == Change::disarmed_only;
    const auto wanted = static_cast<float>(other), now = static_cast<float>(e.default_value);
    const bool loosens =
        (e.change == Change::only_higher && wanted < now) ||
        (e.change == Change::only_lower && (wanted > now || (e.unbounded_at_zero && wanted == 0.0f)) &&
         !(e.unbounded_at_zero && now == 0.0f)) ||
        (e.change == Change::only_nearer_zero && std::abs(wanted) > std::abs(now));
    const bool refused = restarts || loosens;
    EXPECT_EQ(w.write(e.name, other, 0, true).refusal, restarts  ? Refusal::while_armed
                                                       : loosens ? Refusal::only_tightens
                                                                 : Refusal::none)
        << e.name;
    EXPECT_EQ(w.registers.changes(), refused || acts_at_once(slot_of(i, 0)) ? 0u : 1u) << e.name;
    Written disarmed;
    // A rule between two parameters.
    if (e.name == "compensation.limit") other = 50;
    if (e.name == "compensation.limit") disarmed.write("guard.friction", 100);
    EXPECT_EQ(disarmed.write(e.name, other).refusal, Refusal::none) << e.name;
    EXPECT_EQ(disarmed.registers.restarting_changes(), restarts ? 1u : 0u) << e.name;
  }
}

TEST(ParameterAccess, StoreCommandsAreForTheApplicationAndNeverAValue) {
  for (const bool in_transaction : {false, true}) {
    Written w;
    if (in_transaction) {
      ASSERT_EQ(w.write("transaction.control", 1).refusal, Refusal::none);
    }
    for (const double command : {0, 1, 2})
      EXPECT_EQ(w.write("store.command", command).refusal, Refusal::store_missing);
    EXPECT_EQ(w.write("store.command", 3).refusal, Refusal::out_of_range);
    if (in_transaction) {
      ASSERT_EQ(w.write("transaction.control", 2).refusal, Refusal::none);
    }
    EXPECT_EQ(w.registers.values().whole<"store.command">(), 0);
    EXPECT_EQ(w.registers.changes(), 0u);
  }
}

TEST(ParameterAccess, ControlwordsAreFetchedOncePerAxisAndAreNoParameterChange) {
  Written w;
  EXPECT_FALSE(w.registers.controlword_waits());
  EXPECT_EQ(w.write(address_of("drive.controlword", 1), {0xABCD}, true).refusal, Refusal::none);
  EXPECT_TRUE(w.registers.controlword_waits());
  EXPECT_FALSE(w.registers.fetch_controlword(0));
  const auto controlword = w.registers.fetch_controlword(1);
  ASSERT_TRUE(controlword);
  EXPECT_EQ(controlword->word, 0xABCD);
  EXPECT_EQ(controlword->by, Link::serial);
  EXPECT_FALSE(w.registers.fetch_controlword(1));
  EXPECT_FALSE(w.registers.controlword_waits());
  // The same word again is a command again.
  w.write(address_of("drive.controlword", 1), {0xABCD}, true);
  EXPECT_TRUE(w.registers.fetch_controlword(1));
  EXPECT_EQ(w.registers.changes(), 0u);
}

RC_GTEST_PROP(ParameterAccess, WhateverIsWrittenRulesHoldRangesHoldAndARefusedWriteChangesNothing, ()) {
  RegisterAccess registers;
  std::uint32_t now = *rc::gen::arbitrary<std::uint32_t>();
  const auto steps = *rc::gen::inRange(1, 60);
  for (int step = 0; step < steps; ++step) {
    now += *rc::gen::inRange<std::uint32_t>(0, 3'000'000);
    const bool armed = *rc::gen::inRange(0, 4) == 0;
    const auto slot = *rc::gen::inRange<std::size_t>(0, slot_count);
    const auto [entry, axis] = owner_of(slot);
    const Entry& e = entry_at(entry);
    std::uint16_t address = modbus_address(entry, axis);
    Words words;
    switch (*rc::gen::inRange(0, 6)) {
      case 0:
        address = address_of("transaction.control");
        words = {*rc::gen::inRange<std::uint16_t>(0, 4)};
        break;
      case 1:
        words = *rc::gen::container<Words>(*rc::gen::inRange<std::size_t>(1, 30),
                                           rc::gen::arbitrary<std::uint16_t>());
        break;
      default: {
        const auto share = static_cast<double>(*rc::gen::inRange(-1, 12)) / 10.0;
        words = words_for(e.name, std::clamp(e.minimum + share * (e.maximum - e.minimum),
                                             is_signed(e.type) ? -2147483648.0 : 0.0,
                                             e.type == Type::integer32 ? 2147483647.0 : 4294967295.0));
      }
    }
    const auto before = registers.bits();
    const ParameterValues values_before = registers.values();
    const auto changes = registers.changes();
    const auto result = registers.write(address, words, armed, now);
    RC_ASSERT(registers.last_refusal().refusal == result.refusal);
    const auto after = registers.bits();
    if (result.refusal != Refusal::none) RC_ASSERT(after == before);
    RC_ASSERT(check_rules(registers.values()).refusal == Refusal::none);
    for (std::size_t s = 0; s < slot_count; ++s) {
      const SlotDescriptor& d = descriptors[owner_of(s).entry];
      if (after[s] == before[s]) continue;
      RC_ASSERT(d.writable);
      RC_ASSERT(check_value(d, after[s]) == Refusal::none);
      RC_ASSERT(armed_change_refusal(values_before, {static_cast<std::uint16_t>(s), after[s]}, Link::serial,
                                     armed) == Refusal::none);
      if (!acts_at_once(s)) RC_ASSERT(registers.changes() == changes + 1);
    }
  }
}

}  // namespace
}  // namespace kmax::firmware::parameter_access_test
