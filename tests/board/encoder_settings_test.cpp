#include "board/power/encoder_settings.hpp"

#include <gtest/gtest.h>

namespace kmax::board::encoder_settings_test {
namespace {

using enum EncoderRole;

TEST(EncoderSettings, TheFirstAxisThatIsThereAndAsksForTheChipHasIt) {
  firmware::ParameterValues values;
  const EncoderSettings lines_only = EncoderSettings{}.next(values, {}, {});
  EXPECT_EQ(lines_only.role[0], lines);
  values.set_whole<"encoder.kind">(1, 1);
  const EncoderSettings second = lines_only.next(values, {}, {});
  EXPECT_EQ(second.role[0], lines_beside_chip);
  EXPECT_EQ(second.role[1], chip);
  values.set_whole<"encoder.kind">(1, 0);
  const EncoderSettings both = second.next(values, {}, {});
  EXPECT_EQ(both.role[0], chip);
  EXPECT_EQ(both.role[1], missing);
  EXPECT_TRUE(both.chip_moves_from(second));
  const EncoderSettings absent = both.next(values, {true}, {true});
  EXPECT_EQ(absent.role[0], lines_beside_chip);
  EXPECT_EQ(absent.role[1], chip);
}

TEST(EncoderSettings, AGenerationRisesWithTheAxisOwnChangesAlone) {
  firmware::ParameterValues values;
  const EncoderSettings before = EncoderSettings{}.next(values, {}, {});
  EXPECT_EQ(before.next(values, {}, {}).generation, before.generation);
  EXPECT_FALSE(before.next(values, {}, {}).chip_moves_from(before));
  values.set_whole<"encoder.index">(1, 1);
  const EncoderSettings indexed = before.next(values, {}, {});
  EXPECT_EQ(indexed.generation[0], before.generation[0]);
  EXPECT_EQ(indexed.generation[1], before.generation[1] + 1);
  const EncoderSettings back = indexed.next(values, {}, {true});
  EXPECT_EQ(back.generation[0], indexed.generation[0] + 1) << "an axis that comes or goes";
  EXPECT_EQ(back.generation[1], indexed.generation[1]);
}

}  // namespace
}  // namespace kmax::board::encoder_settings_test
