#include "drivers/line_look.hpp"

#include <gtest/gtest.h>

namespace kmax::drivers::line_look_test {

/// A line by its look, from 0 on; counts the looks.
template <typename At>
struct Line {
  At at;
  unsigned looks = 0;
  auto look() {
    return [this] { return at(looks++); };
  }
};
template <typename At>
Line(At) -> Line<At>;

TEST(LineLook, ALineIsMeantUnlessItIsAtRestForTenLooksOfTwentySix) {
  Line rest{[](unsigned) { return false; }};
  EXPECT_FALSE(ISR_is_meant(rest.look()));
  EXPECT_EQ(rest.looks, 10U);
  Line active{[](unsigned) { return true; }};
  EXPECT_TRUE(ISR_is_meant(active.look()));
  EXPECT_EQ(active.looks, 26U);
  Line bounces{[](unsigned look) { return look % 10 == 9; }};
  EXPECT_TRUE(ISR_is_meant(bounces.look())) << "never ten in a row";
  EXPECT_EQ(bounces.looks, 26U);
  for (unsigned first = 0; first < 26; ++first) {
    Line released{[first](unsigned look) { return look < first; }};
    EXPECT_EQ(ISR_is_meant(released.look()), first > 16) << first;
    EXPECT_EQ(released.looks, first > 16 ? 26 : first + 10) << first;
  }
}

TEST(LineLook, ALineStaysIfItDoesForTwentyFourLooks) {
  for (unsigned gone = 0; gone < 30; ++gone) {
    Line line{[gone](unsigned look) { return look != gone; }};
    EXPECT_EQ(ISR_stays(line.look()), gone >= 24) << gone;
    EXPECT_EQ(line.looks, gone >= 24 ? 24 : gone + 1) << gone;
  }
}

}  // namespace kmax::drivers::line_look_test
