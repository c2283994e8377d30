#include "host_tools/virtual_board/run/budget.hpp"

#include <gtest/gtest.h>

#include <stdexcept>

namespace kmax::virtual_board::budget_test {

// An axis that does not tick costs nothing, and would keep every bound.
TEST(Budget, IsNotOfAxesThatHaveNotTicked) {
  EXPECT_NO_THROW(require_all_ticks({6'000, 6'000}, 0.3));
  EXPECT_NO_THROW(require_all_ticks({5'998, 5'998}, 0.3)) << "the first and the last may be cut off";
  for (const std::uint64_t made : {0, 1, 3'000, 5'997}) {
    try {
      require_all_ticks({6'000, made}, 0.3);
      FAIL() << made;
    } catch (const std::runtime_error& error) {
      EXPECT_EQ(std::string(error.what()),
                "axis 1 has ticked " + std::to_string(made) + " times in 0.3 s instead of 6000");
    }
    EXPECT_THROW(require_all_ticks({made, 6'000}, 0.3), std::runtime_error);
  }
}

}  // namespace kmax::virtual_board::budget_test
