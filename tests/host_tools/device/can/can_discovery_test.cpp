#include "host_tools/device/can/can_discovery.hpp"

#include <gtest/gtest.h>

#include "host_tools/device/can/can_node_lock.hpp"
#include "host_tools/device/can/unix_can.hpp"
#include "tests/host_tools/device/can/fake_sdo_node.hpp"
#include "tests/host_tools/thrown_message.hpp"

namespace kmax::device::can_discovery_test {

using drivers::CanFrame;
using host_tools_test::FakeSdoNode;
using host_tools_test::frame_of;
using host_tools_test::thrown_message;
using Frames = FakeSdoNode::Frames;
using namespace std::chrono_literals;

CanDiscoverySettings quick() {
  return CanDiscoverySettings{.listening = 60ms, .response_timeout = 40ms};
}

/// Until `count` nodes are found: one that a busy machine holds up for longer than is listened is looked for
/// again.
std::vector<FoundNode> discover(const std::string& path, std::size_t count) {
  std::vector<FoundNode> found;
  for (int attempt = 0; attempt < 50 && found.size() != count; ++attempt)
    found = discover_nodes(path, quick());
  return found;
}

void identify(FakeSdoNode& node) {
  node.put({0x1018, 1}, {1, 0, 0, 0});
  node.put({0x1018, 2}, {2, 0, 0, 0});
  node.put({0x1018, 3}, {0, 0, 1, 0});
  node.put({0x1018, 4}, {0x78, 0x56, 0x34, 0x12});
  node.put({0x1008, 0}, {'K', 'm', 'a', 'x', ' ', '1', 0});
}

TEST(CanDiscovery, FindsAllThatAnswerAndWhoTheyAre) {
  FakeSdoNode node({}, {1, 2, 17, 100, 127});
  identify(node);
  node.start();
  const auto found = discover(node.path(), 5);
  ASSERT_EQ(found.size(), 5u);
  std::vector<int> ids;
  for (const FoundNode& one : found) {
    ids.push_back(one.node);
    EXPECT_EQ(one.device_type, 0xFFFF0192u);
    ASSERT_TRUE(one.identity);
    EXPECT_EQ(*one.identity, (std::array<std::uint32_t, 4>{1, 2, 0x10000, 0x12345678}));
    EXPECT_EQ(one.name, "Kmax 1");
    EXPECT_FALSE(one.in_use);
    EXPECT_FALSE(one.state);
  }
  EXPECT_EQ(ids, (std::vector<int>{1, 2, 17, 100, 127}));
}

TEST(CanDiscovery, AnEmptyBusHasNobody) {
  FakeSdoNode node({}, {});
  node.start();
  EXPECT_TRUE(discover_nodes(node.path(), quick()).empty());
}

TEST(CanDiscovery, ANodeWithoutANameOrIdentityIsFound) {
  FakeSdoNode node;
  node.refuse({0x1018, 1}, FakeSdoNode::Abort::no_object);
  node.start();
  const auto found = discover(node.path(), 1);
  ASSERT_EQ(found.size(), 1u);
  EXPECT_EQ(found[0].device_type, 0xFFFF0192u);
  EXPECT_FALSE(found[0].identity);
  EXPECT_EQ(found[0].name, "");
}

TEST(CanDiscovery, ANodeThatRefusesEvenItsTypeIsFound) {
  FakeSdoNode node;
  node.refuse({0x1000, 0}, FakeSdoNode::Abort::device_state);
  node.start();
  const auto found = discover(node.path(), 1);
  ASSERT_EQ(found.size(), 1u);
  EXPECT_EQ(found[0].node, 5);
  EXPECT_FALSE(found[0].device_type);
}

TEST(CanDiscovery, ASlowNodeIsNotTakenForOneInUse) {
  FakeSdoNode node([](int, const CanFrame& answer) {
    std::this_thread::sleep_for(100ms);
    return Frames{answer};
  });
  identify(node);
  node.start();
  const auto found = discover(node.path(), 1);
  ASSERT_EQ(found.size(), 1u);
  EXPECT_FALSE(found[0].in_use);
  EXPECT_TRUE(found[0].device_type);
  EXPECT_TRUE(found[0].identity);
}

/// A bus with somebody else on it, who says something again and again.
struct Chatter {
  Chatter(const std::string& path, Frames frames)
      : port(path), thread([this, said = std::move(frames)] {
          while (!done) {
            for (const CanFrame& frame : said) port.send(frame);
            std::this_thread::sleep_for(5ms);
            while (port.receive(0us)) {
            }
          }
        }) {}
  ~Chatter() {
    done = true;
    thread.join();
  }
  UnixCan port;
  std::atomic<bool> done = false;
  std::thread thread;
};

TEST(CanDiscovery, HeartbeatsAloneShowANodeAndItsState) {
  FakeSdoNode node;
  node.start();
  const Chatter chatter(node.path(), {frame_of(0x703, {4}), frame_of(0x705, {0x7F})});
  const auto found = discover(node.path(), 2);
  ASSERT_EQ(found.size(), 2u);
  EXPECT_EQ(found[0].node, 3);
  EXPECT_EQ(found[0].state, 4);
  EXPECT_FALSE(found[0].device_type);
  EXPECT_EQ(found[1].node, 5);
  EXPECT_EQ(found[1].state, 127);
  EXPECT_TRUE(found[1].device_type);
}

// A request in another's conversation would end it.
TEST(CanDiscovery, ANodeInConversationIsNotAsked) {
  FakeSdoNode node;
  node.start();
  // Node 9 is in the middle of an upload with somebody; a question to node 11 stays without an answer.
  const Chatter chatter(
      node.path(), {frame_of(0x609, {0x60, 0, 0, 0, 0, 0, 0, 0}), frame_of(0x589, {0, 1, 2, 3, 4, 5, 6, 7}),
                    frame_of(0x60B, {0x40, 0, 0x10, 0, 0, 0, 0, 0})});
  const auto found = discover(node.path(), 2);
  ASSERT_EQ(found.size(), 2u);
  EXPECT_EQ(found[0].node, 5);
  EXPECT_FALSE(found[0].in_use);
  EXPECT_EQ(found[1].node, 9);
  EXPECT_TRUE(found[1].in_use);
}

TEST(CanDiscovery, ANodeThatAnotherKmaxHoldsIsNotAsked) {
  FakeSdoNode node({}, {5, 6});
  node.start();
  const CanNodeLock held(node.path(), 6, {});
  const auto found = discover(node.path(), 2);
  ASSERT_EQ(found.size(), 2u);
  EXPECT_TRUE(found[0].device_type);
  EXPECT_TRUE(found[1].in_use);
  EXPECT_FALSE(found[1].device_type);
}

TEST(CanDiscovery, LeavesNoNodeReserved) {
  FakeSdoNode node({}, {5, 6});
  node.start();
  discover_nodes(node.path(), quick());
  for (std::uint8_t id = 1; id < 128; ++id) EXPECT_TRUE(CanNodeLock::try_to_take(node.path(), id)) << int{id};
}

TEST(CanDiscovery, ABusThatIsClosedMeanwhile) {
  FakeSdoNode node([](int, const CanFrame&) { return Frames{frame_of(FakeSdoNode::hang_up, {})}; });
  node.start();
  EXPECT_CONTAINS(thrown_message<LinkError>([&] { discover_nodes(node.path(), quick()); }), "closed");
}

}  // namespace kmax::device::can_discovery_test
