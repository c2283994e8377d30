#include "host_tools/view/server/command_queue.hpp"

#include <gtest/gtest.h>

namespace kmax::view::command_queue_test {

using Kind = Command::Kind;
using std::chrono::milliseconds;

class CommandQueueTest : public testing::Test {
 protected:
  Command command(Kind kind, ClientId client = 1, int id = 0) {
    return {.kind = kind, .id = id, .client = client};
  }
  std::vector<Kind> all() {
    std::vector<Kind> kinds;
    while (const auto one = queue.take()) kinds.push_back(one->kind);
    return kinds;
  }

  CommandQueue::Clock::time_point now{};
  CommandQueue queue{[this] { return now; }};
};

TEST_F(CommandQueueTest, CommandsComeInOrderAndAStopIsUrgentAtOnce) {
  queue.push(command(Kind::set));
  EXPECT_FALSE(queue.urgent());
  queue.push(command(Kind::save));
  queue.push(command(Kind::stop));
  ASSERT_TRUE(queue.urgent());
  EXPECT_EQ(queue.urgent()->why, Urgency::Why::asked);
  EXPECT_EQ(all(), (std::vector{Kind::set, Kind::save, Kind::stop}));
  EXPECT_TRUE(queue.urgent());
}

TEST_F(CommandQueueTest, WhatArmsIsRevokedByALaterStopAndNotByAnEarlierOne) {
  for (const Kind kind : {Kind::arm, Kind::procedure}) {
    queue.push(command(kind, 1, 11));
    queue.push(command(Kind::set));
    queue.push(command(Kind::stop));
    queue.push(command(kind, 1, 12));
    const auto revoked = queue.settled(*queue.urgent());
    ASSERT_EQ(revoked.size(), 1U);
    EXPECT_EQ(revoked[0].id, 11);
    EXPECT_EQ(all(), (std::vector{Kind::set, Kind::stop, kind}));
    EXPECT_FALSE(queue.urgent());
  }
}

TEST_F(CommandQueueTest, AStopIsTakenHoweverManyCommandsWait) {
  for (std::size_t i = 0; i < CommandQueue::most; ++i) EXPECT_TRUE(queue.push(command(Kind::set)));
  EXPECT_FALSE(queue.push(command(Kind::set)));
  EXPECT_TRUE(queue.push(command(Kind::stop)));
  EXPECT_TRUE(queue.urgent());
  for (int i = 0; i < 1000; ++i) queue.push(command(Kind::stop));
  EXPECT_LE(all().size(), CommandQueue::most);
}

TEST_F(CommandQueueTest, WhoArmedAndGoesIsUrgentAndItsCommandsAreForgotten) {
  queue.joined(1);
  queue.joined(2);
  queue.armed_by(1, 2);
  queue.push(command(Kind::set, 1));
  queue.push(command(Kind::arm, 2));
  queue.left(1);
  EXPECT_FALSE(queue.urgent());
  queue.left(2);
  ASSERT_TRUE(queue.urgent());
  EXPECT_EQ(queue.urgent()->why, Urgency::Why::page_gone);
  EXPECT_EQ(all(), std::vector<Kind>{});
  EXPECT_EQ(queue.owner(1), 2U);
  queue.settled(*queue.urgent());
  EXPECT_FALSE(queue.owner(1));
}

TEST_F(CommandQueueTest, WhoGoesWhileItsCommandToArmIsCarriedOutIsUrgent) {
  queue.joined(1);
  queue.push(command(Kind::arm, 1));
  ASSERT_TRUE(queue.take());
  queue.left(1);
  EXPECT_FALSE(queue.urgent());
  queue.armed_by(0, 1);
  EXPECT_TRUE(queue.urgent());
}

TEST_F(CommandQueueTest, WhoArmedHasToBeHeard) {
  queue.joined(1);
  queue.joined(2);
  queue.armed_by(0, 1);
  now += CommandQueue::patience;
  EXPECT_FALSE(queue.urgent());
  queue.push(command(Kind::alive, 1));
  now += milliseconds(1);
  EXPECT_FALSE(queue.urgent());
  now += CommandQueue::patience;
  queue.push(command(Kind::alive, 2));  // another one does not count
  ASSERT_TRUE(queue.urgent());
  EXPECT_EQ(queue.urgent()->why, Urgency::Why::page_silent);
}

TEST_F(CommandQueueTest, SilenceOfWhoHasNotArmedIsNobodysBusiness) {
  queue.joined(1);
  now += 10 * CommandQueue::patience;
  EXPECT_FALSE(queue.urgent());
}

TEST_F(CommandQueueTest, AStopMayBeLeftForLaterAndKeepsItsPlace) {
  for (const Kind kind : {Kind::cancel, Kind::stop, Kind::save}) queue.push(command(kind));
  EXPECT_EQ(queue.take(CommandQueue::Stops::leave)->kind, Kind::cancel);
  EXPECT_FALSE(queue.take(CommandQueue::Stops::leave));
  EXPECT_EQ(queue.take()->kind, Kind::stop);
  EXPECT_EQ(queue.take(CommandQueue::Stops::leave)->kind, Kind::save);
}

}  // namespace kmax::view::command_queue_test
