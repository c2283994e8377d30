// RM0090, memory map; what is attached to it.

#include "host_tools/virtual_board/bus.hpp"

#include <gtest/gtest.h>

#include <stdexcept>

#include "tests/host_tools/virtual_board/cortex_m/program_on_core.hpp"

namespace kmax::virtual_board::bus_test {

std::string refusal(const std::function<void()>& access) {
  try {
    access();
  } catch (const RefusedAccess& refused) {
    return refused.what();
  }
  return "(not refused)";
}

TEST(Bus, DispatchesByBlock) {
  Bus bus;
  RecordingBlock first;
  RecordingBlock second;
  RecordingBlock inside_the_same_page;
  bus.attach(0x4000'0000, 0x54, "FIRST", first);
  bus.attach(0x4000'0400, 0x400, "SECOND", second);
  bus.attach(0x4000'0054, 4, "NEIGHBOUR", inside_the_same_page);
  first.value = 11;
  second.value = 22;
  inside_the_same_page.value = 33;
  EXPECT_EQ(bus.read(0x4000'0050, 4, 5), 11U);
  EXPECT_EQ(bus.read(0x4000'0054, 4, 6), 33U);
  EXPECT_EQ(bus.read(0x4000'07FC, 4, 7), 22U);
  bus.write(0x4000'0402, 2, 0xBEEF, 8);
  ASSERT_EQ(second.records.size(), 2U);
  EXPECT_EQ(second.records[0].offset, 0x3FCU);
  EXPECT_EQ(second.records[0].now, 7U);
  EXPECT_EQ(second.records[1].offset, 2U);
  EXPECT_EQ(second.records[1].bytes, 2U);
  EXPECT_EQ(second.records[1].value, 0xBEEFU);
  EXPECT_EQ(bus.block_name(0x4000'0054), "NEIGHBOUR");
  EXPECT_EQ(bus.block_name(0x4000'0058), "");
}

TEST(Bus, RefusesWhereNothingIs) {
  Bus bus;
  RecordingBlock block;
  bus.attach(0x4000'0000, 0x54, "BLOCK", block);
  for (const std::uint32_t address :
       {0x4000'0054U, 0x4007'FFFCU, 0x5000'0000U, 0xE000'E100U, 0x1FFF'7A10U, 0x4200'0000U}) {
    EXPECT_NE(refusal([&] { bus.read(address, 4, 0); }).find("nothing"), std::string::npos)
        << std::hex << address;
    EXPECT_NE(refusal([&] { bus.write(address, 4, 0, 0); }).find("nothing"), std::string::npos)
        << std::hex << address;
  }
}

TEST(Bus, RefusesUnalignedAccessesAndStoppedClocks) {
  Bus bus;
  RecordingBlock block;
  bool clocked = false;
  bus.attach(0x4001'0000, 0x400, "TIM1", block, [&] { return clocked; });
  EXPECT_NE(refusal([&] { bus.read(0x4001'0000, 4, 0); }).find("clock"), std::string::npos);
  clocked = true;
  EXPECT_EQ(refusal([&] { bus.read(0x4001'0000, 4, 0); }), "(not refused)");
  EXPECT_NE(refusal([&] { bus.read(0x4001'0002, 4, 0); }).find("aligned"), std::string::npos);
  EXPECT_NE(refusal([&] { bus.write(0x4001'0001, 2, 0, 0); }).find("aligned"), std::string::npos);
  EXPECT_EQ(refusal([&] { bus.write(0x4001'0003, 1, 0, 0); }), "(not refused)");
}

TEST(Bus, RefusesToAttachWrongly) {
  Bus bus;
  RecordingBlock block;
  bus.attach(0x4000'0400, 0x400, "TIM3", block);
  EXPECT_THROW(bus.attach(0x4000'07FC, 8, "x", block), std::invalid_argument);
  EXPECT_THROW(bus.attach(0x4000'0000, 0x404, "x", block), std::invalid_argument);
  EXPECT_THROW(bus.attach(0x4000'0404, 4, "x", block), std::invalid_argument);
  EXPECT_THROW(bus.attach(0x2000'0000, 4, "x", block), std::invalid_argument);
  EXPECT_THROW(bus.attach(0x4000'0002, 4, "x", block), std::invalid_argument);
  EXPECT_THROW(bus.attach(0x4000'0000, 0, "x", block), std::invalid_argument);
  EXPECT_THROW(bus.attach(0xE00F'FFFC, 8, "x", block), std::invalid_argument);
  EXPECT_NO_THROW(bus.attach(0xE00F'FFFC, 4, "x", block));
}

TEST(Bus, KeepsItsMemories) {
  Bus bus;
  EXPECT_EQ(bus.load(0x0800'0000), 0xFFFF'FFFFU) << "flash comes erased";
  EXPECT_EQ(bus.load(0x0000'0000), 0xFFFF'FFFFU) << "the boot alias";
  EXPECT_TRUE(bus.store(0x2001'FFFC, 0x0102'0304));
  EXPECT_EQ(bus.sram()[0x1FFFC], 4);
  EXPECT_TRUE(bus.store(0x1000'FFFC, 5));
  EXPECT_EQ(bus.load(0x1000'FFFC), 5U);
  EXPECT_FALSE(bus.store(0x2001'FFFE, 0)) << "half of it lies outside";
  EXPECT_FALSE(bus.store(0x0800'0000, 0));
  EXPECT_FALSE(bus.store(0x4000'0000, 0));
  EXPECT_FALSE(bus.load(0x2002'0000).has_value());
  EXPECT_EQ(bus.memory(0x0800'0000, 0x10'0000).size(), 0x10'0000U);
  EXPECT_TRUE(bus.memory(0x0800'0004, 0x10'0000).empty());
  EXPECT_TRUE(bus.memory(0x1000'FFFF, 2).empty());
}

TEST(Bus, HandsOutStoresToTheParameterSectors) {
  Bus bus;
  EXPECT_NE(refusal([&] { bus.write(0x0800'4000, 4, 0, 0); }).find("flash controller"), std::string::npos);
  int stores = 0;
  bus.on_parameter_store([&](std::uint32_t address, unsigned bytes, std::uint32_t value, BoardTime now) {
    EXPECT_EQ(address, 0x0800'BFFEU);
    EXPECT_EQ(bytes, 2U);
    EXPECT_EQ(value, 0x1234U);
    EXPECT_EQ(now, 9U);
    ++stores;
  });
  bus.write(0x0800'BFFE, 2, 0x1234, 9);
  EXPECT_EQ(stores, 1);
  EXPECT_EQ(bus.read(0x0800'BFFC, 4, 10), 0xFFFF'FFFFU);
  bus.memory(0x0800'BFFC, 4)[3] = 0x7F;
  EXPECT_EQ(bus.read(0x0800'BFFF, 1, 10), 0x7FU);
}

}  // namespace kmax::virtual_board::bus_test
