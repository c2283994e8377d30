// Against RM0090, chapter DMA controller.
#include "host_tools/virtual_board/stm32f4/dma.hpp"

#include <gtest/gtest.h>

#include <vector>

#include "tests/host_tools/virtual_board/model_bench.hpp"

namespace kmax::virtual_board::dma_test {

// Bits as RM0090 draws them, written down a second time on purpose.
constexpr std::uint32_t en = 1, to_peripheral = 1U << 6, circ = 1U << 8, words = 2U << 11 | 2U << 13;
constexpr std::uint32_t control(unsigned channel) {
  return channel << 25 | to_peripheral | circ | words;
}
constexpr std::uint32_t stream(unsigned number) {
  return 0x10 + 0x18 * number;
}
constexpr std::uint32_t sram = 0x2000'1000, target = 0x4001'0000;

struct Target final : Peripheral {
  std::uint32_t read(const Access& /*access*/) override { return 0; }
  void write(const Access& access, std::uint32_t value) override { stores.push_back({access.offset, value}); }
  void reset(BoardTime /*now*/) override {}
  std::vector<std::pair<std::uint32_t, std::uint32_t>> stores;
};

struct Bench : testing::ModelBench {
  Bench() : ModelBench({&model}) { bus.attach(target, 0x100, "target", peripheral); }
  void set_up(unsigned number, std::uint32_t cr, std::uint32_t memory, std::uint32_t offset,
              std::uint32_t count = 1) {
    write(stream(number) + 4, count);
    write(stream(number) + 8, target + offset);
    write(stream(number) + 12, memory);
    write(stream(number), cr | en);
  }
  void request(unsigned number, unsigned channel) {
    model.request({number, channel}, now);
    run(1);
  }
  Bus bus;
  Target peripheral;
  DmaModel model{bus};
};

TEST(DmaModel, CarriesAWordAtEachRequestOfItsChannel) {
  Bench bench;
  bench.bus.store(sram, 0x1234'5678);
  bench.set_up(7, control(7), sram, 0x44);
  bench.request(7, 6);
  bench.request(4, 7);
  EXPECT_TRUE(bench.peripheral.stores.empty()) << "other channels and streams";
  bench.request(7, 7);
  bench.bus.store(sram, 5);
  bench.request(7, 7);
  using Stores = std::vector<std::pair<std::uint32_t, std::uint32_t>>;
  EXPECT_EQ(bench.peripheral.stores, (Stores{{0x44, 0x1234'5678}, {0x44, 5}}));
  EXPECT_EQ(bench.model.transfers(7), 2U);
  EXPECT_EQ(bench.read(stream(7) + 4), 1U) << "NDTR, circular";
  EXPECT_EQ(bench.read(0x04), 0x20U << 22) << "TCIF7";
}

TEST(DmaModel, EndsAfterItsNumberUnlessItIsCircular) {
  Bench bench;
  bench.set_up(1, control(7) & ~circ, sram, 0, 2);
  for (int i = 0; i < 3; ++i) bench.request(1, 7);
  EXPECT_EQ(bench.peripheral.stores.size(), 2U);
  EXPECT_EQ(bench.read(stream(1)) & en, 0U);
  EXPECT_THROW(bench.write(stream(1), control(7) | en), RefusedAccess) << "TCIF1 is set";
  bench.write(0x08, 0x20U << 6);
  bench.write(stream(1), control(7) | en);
  bench.request(1, 7);
  EXPECT_EQ(bench.peripheral.stores.size(), 3U);
}

TEST(DmaModel, TheLowerStreamIsServedFirstAtOneInstant) {
  Bench bench;
  bench.set_up(7, control(7), sram, 0x1C);
  bench.set_up(1, control(7), sram, 4);
  bench.model.request({7, 7}, bench.now);
  bench.model.request({1, 7}, bench.now);
  bench.run(1);
  ASSERT_EQ(bench.peripheral.stores.size(), 2U);
  EXPECT_EQ(bench.peripheral.stores[0].first, 4U);
}

TEST(DmaModel, RefusesWhatIsNotModelled) {
  const auto refused = [](auto&& action) {
    Bench bench;
    EXPECT_THROW(action(bench), RefusedAccess);
  };
  refused([](Bench& b) { b.set_up(1, control(7) & ~to_peripheral, sram, 0); });
  refused([](Bench& b) { b.set_up(1, control(7) | 1U << 10, sram, 0); });  // MINC
  refused([](Bench& b) { b.set_up(1, control(7) & ~words, sram, 0); });
  refused([](Bench& b) { b.set_up(1, control(7), 0x1000'0000, 0); });  // the CCM
  refused([](Bench& b) { b.set_up(1, control(7), sram, 0, 0); });
  refused([](Bench& b) {
    b.set_up(1, control(7), sram, 0);
    b.write(stream(1) + 12, sram + 4);
  });
  refused([](Bench& b) { b.write(stream(1) + 20, 4); });  // the FIFO
}

TEST(DmaModel, AResetEndsIt) {
  Bench bench;
  bench.set_up(1, control(7), sram, 0);
  bench.model.request({1, 7}, bench.now);
  bench.model.reset(bench.now);
  bench.run(1);
  bench.request(1, 7);
  EXPECT_TRUE(bench.peripheral.stores.empty());
}

}  // namespace kmax::virtual_board::dma_test
