#include "tests/benchmarks/instruction_budget/fingerprint.hpp"

#include <gtest/gtest.h>

namespace kmax::instruction_budget::fingerprint_test {

// The image for the Cortex-M4F compares its own with the same number.
TEST(Fingerprint, IsTheKnownOneOnThisMachineToo) {
  EXPECT_EQ(Fingerprint{}.of_all(), known_fingerprint);
}

}  // namespace kmax::instruction_budget::fingerprint_test
