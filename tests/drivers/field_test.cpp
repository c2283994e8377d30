#include "drivers/register_field.hpp"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include "drivers/stm32f4/registers/rcc.hpp"
#include "tests/drivers/fake_register.hpp"

namespace kmax::drivers::stm32f4::field_test {

static_assert(Register<volatile std::uint32_t>);
static_assert(Register<FakeRegister>);
static_assert(!Register<const volatile std::uint32_t>);

static_assert(Field<0>::mask == 1U);
static_assert(Field<31>::mask == 0x8000'0000U);
static_assert(Field<0, 32>::mask == 0xFFFF'FFFFU);
static_assert(Field<6, 9>::mask == 0x0000'7FC0U);
static_assert(Field<6, 9>::bits(168) == 168U << 6);
static_assert(Field<20, 4>::of(0x1234'5678U) == 0x3U);

template <unsigned position, unsigned width>
void leaves_neighbours(std::uint32_t before, std::uint32_t value) {
  volatile std::uint32_t word = before;
  using Tested = Field<position, width>;
  Tested::write(word, value);
  RC_ASSERT((word & ~Tested::mask) == (before & ~Tested::mask));
  RC_ASSERT(Tested::read(word) == (value & Tested::maximum));
}

RC_GTEST_PROP(Field, WriteChangesItsBitsOnly, (std::uint32_t before, std::uint32_t value)) {
  leaves_neighbours<0, 1>(before, value);
  leaves_neighbours<31, 1>(before, value);
  leaves_neighbours<6, 9>(before, value);
  leaves_neighbours<16, 16>(before, value);
  leaves_neighbours<0, 32>(before, value);
}

TEST(Field, SetAndClearWideField) {
  volatile std::uint32_t word = 0x0000'0001;
  Field<20, 4>::set(word);
  EXPECT_EQ(word, 0x00F0'0001U);
  Field<20, 4>::clear(word);
  EXPECT_EQ(word, 0x0000'0001U);
}

TEST(BoundedWait, ReadsAtMostAsOftenAsAllowed) {
  FakeRegister never;
  for (const unsigned polls : {1U, 2U, 1000U}) {
    never.reads = 0;
    EXPECT_FALSE(wait_until(never, 1, 1, polls));
    EXPECT_EQ(never.reads, polls);
  }
  never.reads = 0;
  EXPECT_FALSE(wait_until(never, 1, 1, 0));
  EXPECT_EQ(never.reads, 1U) << "zero polls must not mean four thousand million";
}

TEST(BoundedWait, LastReadCounts) {
  FakeRegister late;
  late.on_read = [&](std::uint32_t) { return late.reads == 5 ? 0x30U : 0U; };
  EXPECT_TRUE(wait_until(late, 0xF0, 0x30, 5));
  late.reads = 0;
  EXPECT_FALSE(wait_until(late, 0xF0, 0x30, 4));
}

TEST(PeripheralClock, KeepsWhatIsOnAndReadsBackTwice) {
  FakeRegister enable;
  enable.value = 0x0010'0000;
  enable_peripheral_clock(enable, 0x5);
  ASSERT_EQ(enable.writes.size(), 1U);
  EXPECT_EQ(enable.value, 0x0010'0005U);
  EXPECT_EQ(enable.reads, 3U);
}

}  // namespace kmax::drivers::stm32f4::field_test
