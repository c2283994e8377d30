#include "firmware/canopen/sdo_source.hpp"

#include <gtest/gtest.h>

#include <array>

#include "tests/firmware/canopen/in_memory_objects.hpp"
#include "tests/firmware/canopen/sdo_bench.hpp"

namespace kmax::firmware::canopen::sdo_source_test {
namespace {

constexpr ObjectAddress domain = InMemoryObjects::domain;
using Reads = std::vector<std::pair<std::uint32_t, std::uint32_t>>;

struct SdoSourceTest : testing::Test {
  InMemoryObjects objects;
  std::array<std::uint8_t, 112> window{};
  SdoSource<InMemoryObjects> source{objects, window};
  std::array<std::uint8_t, 7> piece{};
};

TEST_F(SdoSourceTest, ANumberIsReadOnceAndAtOnce) {
  ASSERT_EQ(source.begin({0x2000, 8}), Abort::none);
  EXPECT_EQ(source.size(), 8U);
  EXPECT_EQ(objects.reads, (Reads{{0, 8}}));
  EXPECT_EQ(source.read(0, piece), Abort::none);
  EXPECT_EQ(source.read(7, std::span(piece).first(1)), Abort::none);
  EXPECT_EQ(piece[0], 0x10);
  EXPECT_EQ(objects.reads.size(), 1U);
}

TEST_F(SdoSourceTest, NothingIsReadOfALongValueBeforeItIsAskedForNorOfAnEmptyOne) {
  objects.at(domain).value = pattern(9);
  EXPECT_EQ(source.begin(domain), Abort::none);
  objects.at(domain).value.clear();
  EXPECT_EQ(source.begin(domain), Abort::none);
  EXPECT_EQ(source.size(), 0U);
  EXPECT_EQ(source.read(0, {}), Abort::none);
  EXPECT_TRUE(objects.reads.empty());
}

TEST_F(SdoSourceTest, RefusalsComeThrough) {
  EXPECT_EQ(source.begin({0x4711, 0}), Abort::no_object);
  EXPECT_EQ(source.begin({0x2011, 0}), Abort::write_only);
  objects.at(domain).value = pattern(300);
  objects.at(domain).readable_up_to = 200;
  ASSERT_EQ(source.begin(domain), Abort::none);
  EXPECT_EQ(source.read(0, piece), Abort::none);
  EXPECT_EQ(source.read(112, piece), Abort::device_state);
  EXPECT_EQ(source.read(112, piece), Abort::device_state) << "what failed is not in the window";
}

// The window of one object must not be taken for that of the next.
TEST_F(SdoSourceTest, EachBeginForgetsTheWindow) {
  objects.at(domain).value = pattern(300);
  ASSERT_EQ(source.begin(domain), Abort::none);
  ASSERT_EQ(source.read(0, piece), Abort::none);
  objects.at(domain).value.assign(300, 9);
  ASSERT_EQ(source.begin(domain), Abort::none);
  ASSERT_EQ(source.read(0, piece), Abort::none);
  EXPECT_EQ(piece, (std::array<std::uint8_t, 7>{9, 9, 9, 9, 9, 9, 9}));
}

}  // namespace
}  // namespace kmax::firmware::canopen::sdo_source_test
