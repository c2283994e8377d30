// Sets that another firmware has saved.
#include "firmware/parameters/parameter_migration.hpp"

#include <gtest/gtest.h>

#include <bit>
#include <limits>
#include <vector>

#include "tests/firmware/fake_flash.hpp"

namespace kmax::firmware::parameter_migration_test {
namespace {

struct Pair {
  std::uint32_t identity, value;
};

template <FixedName name>
std::uint32_t identity(std::size_t axis = 0) {
  return identity_of(entry_of<name>(), axis).word();
}

std::uint32_t bits(float value) {
  return std::bit_cast<std::uint32_t>(value);
}

/// All persistent parameters with `values`, as a list that a test can spoil.
std::vector<Pair> pairs_of(const ParameterValues& values) {
  std::vector<Pair> pairs;
  for (std::size_t i = 0; i < persistent_count; ++i)
    pairs.push_back({persistent_identity(i), values.raw(persistent_slots[i])});
  return pairs;
}

Pair& pair_of(std::vector<Pair>& pairs, std::uint32_t wanted) {
  for (Pair& pair : pairs) {
    if (pair.identity == wanted) return pair;
  }
  throw std::runtime_error("no such pair");
}

FakeFlash flash_with(const std::vector<Pair>& pairs, std::uint32_t schema) {
  FakeFlash flash;
  std::vector<std::uint32_t> words = {record::magic, 5, schema, 0, static_cast<std::uint32_t>(pairs.size())};
  for (const Pair& pair : pairs) words.insert(words.end(), {pair.identity, pair.value});
  Crc32 crc;
  for (const std::uint32_t word : words) crc.add(word);
  words.insert(words.end(), {crc.value(), record::commit});
  std::copy(words.begin(), words.end(), flash.words[0].begin());
  return flash;
}

struct Taken {
  ParameterValues values;
  LoadReport report;
};

Taken take(const std::vector<Pair>& pairs, const ParameterValues& before = {}) {
  FakeFlash flash = flash_with(pairs, 0x1234);
  Taken taken{before, {}};
  taken.report = Store(flash).load(taken.values);
  EXPECT_TRUE(taken.report.found);
  EXPECT_TRUE(taken.report.other_dictionary);
  EXPECT_EQ(check_rules(taken.values).refusal, Refusal::none);
  return taken;
}

TEST(ParameterMigration, TheOrderOfAnotherFirmwareDoesNotMatter) {
  auto pairs = pairs_of(some_values(1));
  std::reverse(pairs.begin(), pairs.end());
  const Taken taken = take(pairs);
  EXPECT_EQ(persistent_part(taken.values), persistent_part(some_values(1)));
  EXPECT_EQ(taken.report.migration.dropped + taken.report.migration.defaulted, 0);
}

TEST(ParameterMigration, UnknownParametersAreDroppedCountedAndNamed) {
  auto pairs = pairs_of(some_values(1));
  const std::uint32_t unknown[] = {ParameterIdentity{0x2FFF, 1, Type::float32}.word(),
                                   ParameterIdentity{0x2000, 200, Type::unsigned8}.word(), 0xFFFF'FFFFU, 0U};
  for (const std::uint32_t one : unknown) pairs.insert(pairs.begin() + 3, {one, 1});
  const Taken taken = take(pairs);
  EXPECT_EQ(persistent_part(taken.values), persistent_part(some_values(1)));
  EXPECT_EQ(taken.report.migration.dropped, 4);
  EXPECT_EQ(taken.report.migration.defaulted, 0);
  EXPECT_EQ(taken.report.migration.first_dropped[2], unknown[1]);  // in the record's order
}

TEST(ParameterMigration, ReadingsAndCommandsAreNotTaken) {
  auto pairs = pairs_of(ParameterValues{});
  pairs.push_back({identity<"drive.controlword">(), 15});
  pairs.push_back({identity<"measured.force">(), bits(3.0f)});
  pairs.push_back({identity<"transaction.control">(), 1});
  pairs.push_back({identity<"trace.interval">(), 1});
  const Taken taken = take(pairs);
  EXPECT_EQ(taken.report.migration.dropped, 4);
  EXPECT_EQ(taken.values.whole<"drive.controlword">(), 0);
  EXPECT_EQ(taken.values.whole<"trace.interval">(), 0);
}

TEST(ParameterMigration, MissingParametersKeepWhatWasBefore) {
  auto pairs = pairs_of(some_values(1));
  std::erase_if(pairs, [](const Pair& p) { return p.identity == identity<"wall.stiffness">(1); });
  std::erase_if(pairs, [](const Pair& p) { return p.identity == identity<"link.timeout">(); });
  ParameterValues before;
  before.set_real<"wall.stiffness">(77.0f, 1);
  const Taken taken = take(pairs, before);
  EXPECT_EQ(taken.values.real<"wall.stiffness">(1), 77.0f);
  EXPECT_EQ(taken.values.real<"link.timeout">(), 1.0f);
  EXPECT_EQ(taken.report.migration.defaulted, 2);
  EXPECT_EQ(taken.report.migration.first_defaulted[0], identity<"wall.stiffness">(1));
  EXPECT_EQ(taken.report.migration.first_defaulted[1], identity<"link.timeout">());
  EXPECT_EQ(taken.report.migration.first_defaulted[2], 0u);
}

TEST(ParameterMigration, AnEmptySetIsASet) {
  const Taken taken = take({});
  EXPECT_EQ(persistent_part(taken.values), persistent_part(ParameterValues{}));
  EXPECT_EQ(taken.report.migration.defaulted, persistent_count);
  EXPECT_EQ(taken.report.migration.first_defaulted[0], persistent_identity(0));
}

TEST(ParameterMigration, ValuesThatAHostCouldNotWriteAreNotTaken) {
  const auto refused = [](std::uint32_t which, std::uint32_t value) {
    auto pairs = pairs_of(ParameterValues{});
    pair_of(pairs, which).value = value;
    const Taken taken = take(pairs);
    EXPECT_EQ(persistent_part(taken.values), persistent_part(ParameterValues{}));
    EXPECT_EQ(taken.report.migration.defaulted, 1);
    EXPECT_EQ(taken.report.migration.first_defaulted[0], which);
  };
  refused(identity<"wall.stiffness">(), bits(-1.0f));
  refused(identity<"wall.stiffness">(1), bits(2e6f));
  refused(identity<"wall.stiffness">(), bits(std::numeric_limits<float>::quiet_NaN()));
  refused(identity<"wall.damping">(), bits(std::numeric_limits<float>::infinity()));
  refused(identity<"wall.law">(), 99);
  refused(identity<"wall.side">(), 0);
  refused(identity<"motor.pole_pairs">(), 0xFFFF'FFFFU);
  refused(identity<"modbus.baud_rate">(), 115'201);
  refused(identity<"modbus.unit">(), 0);
}

TEST(ParameterMigration, AParameterOfAnotherTypeIsAnotherParameter) {
  auto pairs = pairs_of(some_values(1));
  auto& pair = pair_of(pairs, identity<"wall.stiffness">());
  ParameterIdentity other = ParameterIdentity::of_word(pair.identity);
  other.type = Type::unsigned32;
  pair = {other.word(), 3580};
  const Taken taken = take(pairs);
  EXPECT_EQ(taken.values.real<"wall.stiffness">(), 1000.0f);
  EXPECT_EQ(taken.report.migration.dropped, 1);
  EXPECT_EQ(taken.report.migration.defaulted, 1);
}

TEST(ParameterMigration, RulesBetweenParametersHoldAfterwards) {
  auto pairs = pairs_of(ParameterValues{});
  pair_of(pairs, identity<"haptic.rate">(1)).value = bits(333.0f);
  Taken taken = take(pairs);
  EXPECT_EQ(taken.values.real<"haptic.rate">(1), 20000.0f);
  EXPECT_EQ(taken.report.migration.defaulted, 1);

  // The named one's default does not help: the group goes back, and nothing else.
  pairs = pairs_of(ParameterValues{});
  pair_of(pairs, identity<"wall.stiffness">()).value = bits(7.0f);
  pair_of(pairs, identity<"wall.stiffness">(1)).value = bits(8.0f);
  pair_of(pairs, identity<"wall.adaptive_force_max">(1)).value = bits(0.5f);
  pair_of(pairs, identity<"force.limit">(1)).value = bits(9.0f);
  taken = take(pairs);
  EXPECT_EQ(taken.values.real<"wall.adaptive_force_min">(1), 0.8f);
  EXPECT_EQ(taken.values.real<"wall.adaptive_force_max">(1), 2.0f);
  EXPECT_EQ(taken.values.real<"wall.stiffness">(1), 1000.0f);
  EXPECT_EQ(taken.values.real<"wall.stiffness">(0), 7.0f);
  EXPECT_EQ(taken.values.real<"force.limit">(1), 9.0f);
  EXPECT_EQ(taken.report.migration.defaulted, 2);

  // A whole interval that contradicts itself, on top of a second broken rule.
  pairs = pairs_of(ParameterValues{});
  pair_of(pairs, identity<"supply.voltage_min">()).value = bits(50.0f);
  pair_of(pairs, identity<"supply.voltage_max">()).value = bits(40.0f);
  pair_of(pairs, identity<"haptic.rate">()).value = bits(7777.0f);
  taken = take(pairs);
  EXPECT_EQ(taken.values.real<"supply.voltage_min">(), 8.0f);
  EXPECT_EQ(taken.values.real<"supply.voltage_max">(), 40.0f);
  EXPECT_EQ(taken.values.real<"haptic.rate">(), 20000.0f);
  EXPECT_EQ(taken.report.migration.defaulted, 2);
}

TEST(ParameterMigration, ALimitOfTheSupplyThatTheBoardsPartsDoNotBearIsNotTakenOver) {
  ParameterValues board;
  board.set_real<"supply.ceiling">(25.68f);
  for (const auto& [stored, taken_over] : {std::pair{28.0f, 25.5f}, {25.6f, 25.6f}}) {
    std::vector<Pair> pairs = pairs_of(ParameterValues{});
    pair_of(pairs, identity<"supply.voltage_max">()).value = bits(stored);
    const Taken taken = take(pairs, board);
    EXPECT_EQ(taken.values.real<"supply.voltage_max">(), taken_over);
    EXPECT_EQ(taken.report.migration.first_defaulted[0],
              stored == taken_over ? 0U : identity<"supply.voltage_max">());
  }
}

TEST(ParameterMigration, TheLargestSetThatFitsASector) {
  constexpr std::size_t count_max = (FakeFlash::words_per_sector - record::length_of(0)) / 2;
  std::vector<Pair> pairs = pairs_of(some_values(1));
  for (std::uint32_t i = 0; pairs.size() < count_max; ++i) pairs.push_back({0x4000'0000U + i, i});
  const Taken taken = take(pairs);
  EXPECT_EQ(persistent_part(taken.values), persistent_part(some_values(1)));
  EXPECT_EQ(taken.report.migration.dropped, count_max - persistent_count);
}

TEST(ParameterMigration, TheNextSaveIsThisFirmwaresOwn) {
  auto pairs = pairs_of(some_values(1));
  pairs.push_back({0x7777'0103U, 1});
  FakeFlash flash = flash_with(pairs, 0x1234);
  Store store(flash);
  ParameterValues values;
  store.load(values);
  ASSERT_EQ(save(store, values), SaveProgress::done);
  LoadReport report;
  EXPECT_EQ(loaded(flash, &report), persistent_part(some_values(1)));
  EXPECT_FALSE(report.other_dictionary);
  EXPECT_EQ(report.migration.dropped, 0);
  EXPECT_EQ(report.header.sequence, 6u);
}

TEST(PersistentParameters, IdentitiesAreUniqueAndThoseOfTheBus) {
  for (std::size_t i = 0; i < persistent_count; ++i) {
    for (std::size_t j = 0; j < i; ++j) ASSERT_NE(persistent_identity(i), persistent_identity(j));
  }
  EXPECT_EQ(identity<"wall.stiffness">(0), 0x2000'0405U);
  EXPECT_EQ(identity<"wall.stiffness">(1), 0x2800'0405U);
  EXPECT_EQ(identity<"supply.voltage_min">(), 0x5800'0105U);
  const auto parts = ParameterIdentity::of_word(0x2800'0405U);
  EXPECT_EQ(parts.index, 0x2800);
  EXPECT_EQ(parts.subindex, 4);
  EXPECT_EQ(parts.type, Type::float32);
}

}  // namespace
}  // namespace kmax::firmware::parameter_migration_test
