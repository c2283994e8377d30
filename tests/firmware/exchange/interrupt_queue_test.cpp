#include "firmware/exchange/interrupt_queue.hpp"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <deque>
#include <thread>

namespace kmax::firmware::interrupt_queue_test {
namespace {

TEST(InterruptQueue, HoldsExactlyItsCapacityDropsTheNewestAndCounts) {
  InterruptQueue<int, 8> queue;
  int item = -1;
  EXPECT_FALSE(queue.pop(item));
  EXPECT_EQ(item, -1);
  for (int i = 0; i < 11; ++i) queue.ISR_push(i);
  EXPECT_EQ(queue.overflows(), 3u);
  for (int i = 0; i < 8; ++i) {
    ASSERT_TRUE(queue.pop(item));
    EXPECT_EQ(item, i);
  }
  EXPECT_FALSE(queue.pop(item));
  queue.ISR_push(99);
  ASSERT_TRUE(queue.pop(item));
  EXPECT_EQ(item, 99);
  EXPECT_EQ(queue.overflows(), 3u);
}

// An interrupt that comes while the reader copies an item: the place being read must not be written.
struct Nosy {
  static inline InterruptQueue<Nosy, 2>* queue = nullptr;
  static inline int pushed_in_between = 0;
  int value = 0;
  Nosy() = default;
  explicit Nosy(int v) : value(v) {}
  Nosy(const Nosy&) = default;
  Nosy& operator=(const Nosy& other) {
    const int before = other.value;
    if (queue != nullptr) {
      auto* interrupted = queue;
      queue = nullptr;
      interrupted->ISR_push(Nosy(1000 + ++pushed_in_between));
    }
    value = other.value;
    EXPECT_EQ(value, before) << "overwritten while being read";
    return *this;
  }
};

TEST(InterruptQueue, InterruptDuringAPopOfAFullQueueDropsItsItemOnly) {
  InterruptQueue<Nosy, 2> queue;
  queue.ISR_push(Nosy(1));
  queue.ISR_push(Nosy(2));
  Nosy item;
  Nosy::queue = &queue;
  ASSERT_TRUE(queue.pop(item));
  EXPECT_EQ(item.value, 1);
  EXPECT_EQ(queue.overflows(), 1u);
  ASSERT_TRUE(queue.pop(item));
  EXPECT_EQ(item.value, 2);
  EXPECT_FALSE(queue.pop(item));
}

RC_GTEST_PROP(InterruptQueue, IsAQueueThatRefusesWhenFull, ()) {
  InterruptQueue<int, 4> queue;
  std::deque<int> model;
  std::uint32_t lost = 0;
  const auto steps = *rc::gen::container<std::vector<bool>>(rc::gen::arbitrary<bool>());
  int next = 0;
  for (const bool push : steps) {
    if (push) {
      queue.ISR_push(next);
      if (model.size() < 4) {
        model.push_back(next);
      } else {
        ++lost;
      }
      ++next;
    } else {
      int item = -1;
      RC_ASSERT(queue.pop(item) == !model.empty());
      if (!model.empty()) {
        RC_ASSERT(item == model.front());
        model.pop_front();
      }
    }
    RC_ASSERT(queue.overflows() == lost);
  }
}

// The queue needs nothing that a single core gives: its acquire/release pairs make it a queue between two
// threads as well, which is what this shows (run it under a thread sanitizer too). DoubleBuffer and Seqlock
// rely on an interrupt running to its end and would be data races between threads, so they are not stressed
// so.
TEST(InterruptQueue, BetweenTwoThreadsNothingIsTornReorderedOrInvented) {
  struct Pair {
    std::uint32_t number, complement;
  };
  static InterruptQueue<Pair, 64> queue;
  constexpr std::uint32_t count = 200'000;
  std::thread writer([] {
    for (std::uint32_t i = 0; i < count; ++i) queue.ISR_push({i, ~i});
    while (true) {  // the last one must arrive
      const std::uint32_t before = queue.overflows();
      queue.ISR_push({count, ~count});
      if (queue.overflows() == before) break;
      std::this_thread::yield();
    }
  });
  std::uint32_t received = 0, expected_least = 0;
  for (bool done = false; !done;) {
    Pair pair{};
    if (!queue.pop(pair)) {
      std::this_thread::yield();
      continue;
    }
    ASSERT_EQ(pair.complement, ~pair.number);
    ASSERT_GE(pair.number, expected_least);
    expected_least = pair.number + 1;
    ++received;
    done = pair.number == count;
  }
  writer.join();
  EXPECT_GE(received + queue.overflows(), count + 1);
}

}  // namespace
}  // namespace kmax::firmware::interrupt_queue_test
