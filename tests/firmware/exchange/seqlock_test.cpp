#include "firmware/exchange/seqlock.hpp"

#include <gtest/gtest.h>

#include <array>
#include <cstdint>
#include <functional>
#include <numeric>
#include <utility>

namespace kmax::firmware::seqlock_test {
namespace {

// Reading and publishing copy alike: the interrupt runs in the middle of the former.
struct Interrupted {
  static constexpr std::size_t pieces = 4;
  static inline std::function<void()> interrupt;
  static inline bool publishing = false;
  static inline int interrupts_left = 0;
  static inline std::size_t interrupt_at = 0;
  std::array<int, pieces> piece{};

  Interrupted() = default;
  explicit Interrupted(int value) { piece.fill(value); }
  Interrupted(const Interrupted& other) { *this = other; }
  Interrupted& operator=(const Interrupted& other) {
    for (std::size_t i = 0; i <= pieces; ++i) {
      if (i == interrupt_at && interrupts_left > 0 && interrupt && !publishing) {
        --interrupts_left;
        publishing = true;
        interrupt();
        publishing = false;
      }
      if (i < pieces) piece[i] = other.piece[i];
    }
    return *this;
  }
};

TEST(Seqlock, BeforeTheFirstPublicationTheValueIsEmpty) {
  Seqlock<int> snapshot;
  EXPECT_EQ(snapshot.read(), 0);
  snapshot.ISR_publish(5);
  EXPECT_EQ(snapshot.read(), 5);
  EXPECT_EQ(snapshot.read(), 5);
}

template <std::size_t words>
void expect_to_be_read_whole() {
  using Value = std::array<std::uint32_t, words>;
  struct {
    std::uint32_t before = 0xBEF0;
    Value value{};
    std::uint32_t behind = 0xBE41;
  } read;
  Value published;
  std::iota(published.begin(), published.end(), 1000U);
  Seqlock<Value> lock;
  lock.ISR_publish(published);
  lock.read(read.value);
  EXPECT_EQ(read.value, published) << words;
  EXPECT_EQ(lock.read(), published) << words;
  EXPECT_EQ(read.before, 0xBEF0U) << words;
  EXPECT_EQ(read.behind, 0xBE41U) << words;
}

TEST(Seqlock, ValuesOfAnySizeAreReadToTheirLastWordAndNoFurther) {
  [&]<std::size_t... more>(std::index_sequence<more...>) {
    (expect_to_be_read_whole<1 + more>(), ...);
  }
  (std::make_index_sequence<66>{});
}

TEST(Seqlock, InterruptAtEveryPointOfTheCopyGivesTheNewestWholeValue) {
  for (std::size_t point = 0; point <= Interrupted::pieces; ++point) {
    for (const int times : {1, 2, 5}) {  // also again during the repetition
      Seqlock<Interrupted> snapshot;
      int published = 1;
      snapshot.ISR_publish(Interrupted(published));
      Interrupted::interrupt = [&] { snapshot.ISR_publish(Interrupted(++published)); };
      Interrupted::interrupt_at = point;
      Interrupted::interrupts_left = times;
      Interrupted read;
      snapshot.read(read);
      EXPECT_EQ(Interrupted::interrupts_left, 0);
      EXPECT_EQ(published, 1 + times);
      for (const int piece : read.piece) EXPECT_EQ(piece, published) << "point " << point;
    }
  }
  Interrupted::interrupt = nullptr;
}

}  // namespace
}  // namespace kmax::firmware::seqlock_test
