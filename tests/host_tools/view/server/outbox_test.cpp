#include "host_tools/view/server/outbox.hpp"

#include <gtest/gtest.h>

namespace kmax::view::outbox_test {

TEST(Outbox, InOrder) {
  Outbox outbox;
  EXPECT_TRUE(outbox.put({.text = "a"}));
  EXPECT_TRUE(outbox.put({.text = "bc"}));
  EXPECT_EQ(outbox.front(), "a");
  EXPECT_EQ(outbox.bytes(), 3U);
  outbox.pop();
  EXPECT_EQ(outbox.front(), "bc");
  outbox.pop();
  EXPECT_TRUE(outbox.empty());
  EXPECT_EQ(outbox.bytes(), 0U);
}

TEST(Outbox, ANewStateTakesThePlaceOfOneThatWaits) {
  Outbox outbox;
  outbox.put({.text = "x"});
  outbox.put({.text = "state 1", .key = "state"});
  outbox.put({.text = "other", .key = "other"});
  outbox.put({.text = "state 22", .key = "state"});
  outbox.pop();
  EXPECT_EQ(outbox.front(), "state 22");
  outbox.pop();
  EXPECT_EQ(outbox.front(), "other");
  EXPECT_EQ(outbox.bytes(), 5U);
}

TEST(Outbox, WhatIsOnItsWayStaysAsItIs) {
  Outbox outbox;
  outbox.put({.text = "old", .key = "state"});
  outbox.begin_front();
  outbox.put({.text = "new", .key = "state"});
  EXPECT_EQ(outbox.front(), "old");
  outbox.pop();
  EXPECT_EQ(outbox.front(), "new");
}

TEST(Outbox, WhoDoesNotReadLosesRowsFirst) {
  Outbox outbox;
  const std::string row(1000, 'r');
  std::size_t put = 0;
  while (outbox.bytes() < Outbox::droppable_from) {
    EXPECT_TRUE(outbox.put({.text = row, .may_be_dropped = true}));
    ++put;
  }
  for (int i = 0; i < 1000; ++i) EXPECT_TRUE(outbox.put({.text = row, .may_be_dropped = true}));
  EXPECT_EQ(outbox.bytes(), put * row.size());
  EXPECT_TRUE(outbox.put({.text = "reply"}));
  EXPECT_EQ(outbox.bytes(), put * row.size() + 5);
}

TEST(Outbox, WhoNeverReadsHasToGo) {
  Outbox outbox;
  bool kept = true;
  for (std::size_t i = 0; kept && i < 2 * Outbox::most / 1000; ++i)
    kept = outbox.put({.text = std::string(1000, 'x')});
  EXPECT_FALSE(kept);
}

}  // namespace kmax::view::outbox_test
