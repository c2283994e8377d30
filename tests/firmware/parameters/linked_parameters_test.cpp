#include "firmware/parameters/linked_parameters.hpp"

#include <gtest/gtest.h>

#include <string_view>
#include <utility>
#include <vector>

namespace kmax::firmware::linked_parameters_test {
namespace {

// From the vocabulary and CiA 402-2 (0x6060 and 0x607E), apart from the code under test.
struct Pair {
  std::string_view own, standard;
  std::vector<std::pair<int, int>> values;
};
const std::vector<Pair> pairs = {{"drive.mode", "profile.operation_mode", {{0, -1}, {1, -2}, {2, 10}}},
                                 {"encoder.direction", "profile.polarity", {{1, 0}, {-1, 0xC0}}}};

std::size_t slot_named(std::string_view name, std::size_t axis) {
  return slot_of(find_entry(name), axis);
}
std::int32_t number(const ParameterValues& values, std::string_view name, std::size_t axis) {
  return static_cast<std::int32_t>(values.raw(slot_named(name, axis)));
}
void set(ParameterValues& values, std::string_view name, std::size_t axis, int value) {
  values.set_raw(slot_named(name, axis), static_cast<std::uint32_t>(value));
}

TEST(LinkedParameters, EitherSetsTheOtherToItsCounterpartOnItsAxis) {
  EXPECT_EQ(linked_parameters.size(), pairs.size());
  for (const Pair& pair : pairs) {
    for (const std::size_t axis : {0u, 1u}) {
      for (const auto& [own, standard] : pair.values) {
        ParameterValues values;
        set(values, pair.own, axis, own);
        EXPECT_EQ(set_partner(values, slot_named(pair.own, axis)), slot_named(pair.standard, axis));
        EXPECT_EQ(number(values, pair.standard, axis), standard);

        values = {};
        set(values, pair.standard, axis, standard);
        EXPECT_EQ(set_partner(values, slot_named(pair.standard, axis)), slot_named(pair.own, axis));
        EXPECT_EQ(number(values, pair.own, axis), own);
        for (std::size_t slot = 0; slot < slot_count; ++slot) {
          if (slot == slot_named(pair.own, axis) || slot == slot_named(pair.standard, axis)) continue;
          ASSERT_EQ(values.raw(slot), ParameterValues{}.raw(slot));
        }
      }
    }
  }
}

TEST(LinkedParameters, AllOthersStandAlone) {
  for (std::size_t slot = 0; slot < slot_count; ++slot) {
    const std::string_view name = entry_at(owner_of(slot).entry).name;
    bool paired = false;
    for (const Pair& pair : pairs) paired = paired || name == pair.own || name == pair.standard;
    ParameterValues values;
    EXPECT_EQ(set_partner(values, slot).has_value(), paired) << name;
  }
}

TEST(LinkedParameters, ModesInTheStandardsNumbers) {
  EXPECT_EQ(operation_mode_of(0), -1);
  EXPECT_EQ(operation_mode_of(1), -2);
  EXPECT_EQ(operation_mode_of(2), 10);
  EXPECT_EQ(operation_mode_of(3), 0);
}

// Every set against every present one: whichever differs from now was meant, else the device's own.
TEST(LinkedParameters, OfASetFromElsewhereTheOneThatDiffersFromNowWins) {
  for (const Pair& pair : pairs) {
    for (const auto& [now_own, now_standard] : pair.values) {
      for (const auto& [own, own_means] : pair.values) {
        for (const auto& [standard_means, standard] : pair.values) {
          for (const std::size_t axis : {0u, 1u}) {
            ParameterValues now, wanted;
            set(now, pair.own, axis, now_own);
            set(now, pair.standard, axis, now_standard);
            set(wanted, pair.own, axis, own);
            set(wanted, pair.standard, axis, standard);
            make_partners_agree(wanted, now);
            const bool by_standard = own == now_own && standard != now_standard;
            EXPECT_EQ(number(wanted, pair.own, axis), by_standard ? standard_means : own);
            EXPECT_EQ(number(wanted, pair.standard, axis), by_standard ? standard : own_means);
          }
        }
      }
    }
  }
}

}  // namespace
}  // namespace kmax::firmware::linked_parameters_test
