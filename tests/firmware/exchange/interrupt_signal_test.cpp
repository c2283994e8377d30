#include "firmware/exchange/interrupt_signal.hpp"

#include <gtest/gtest.h>

namespace kmax::firmware::interrupt_signal_test {
namespace {

TEST(InterruptSignal, IsTakenOnceHoweverOftenItWasRaised) {
  InterruptSignal signal;
  EXPECT_FALSE(signal.take());
  for (const int times : {1, 2, 300}) {
    for (int i = 0; i < times; ++i) signal.ISR_raise();
    EXPECT_TRUE(signal.take()) << times;
    EXPECT_FALSE(signal.take()) << times;
  }
}

}  // namespace
}  // namespace kmax::firmware::interrupt_signal_test
