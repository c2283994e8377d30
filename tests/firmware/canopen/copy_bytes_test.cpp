#include "firmware/canopen/copy_bytes.hpp"

#include <gtest/gtest.h>

#include <array>

namespace kmax::firmware::canopen::copy_bytes_test {
namespace {

TEST(CopyBytes, CopiesAllOfTheSourceAndNothingBehindIt) {
  const std::array<std::uint8_t, 3> from{1, 2, 3};
  std::array<std::uint8_t, 5> to{9, 9, 9, 9, 9};
  copy_bytes(from, std::span(to).subspan(1));
  EXPECT_EQ(to, (std::array<std::uint8_t, 5>{9, 1, 2, 3, 9}));
}

TEST(CopyBytes, TakesNothingFromNowhere) {
  std::array<std::uint8_t, 1> to{9};
  copy_bytes({}, to);
  copy_bytes({}, {});
  EXPECT_EQ(to[0], 9);
}

}  // namespace
}  // namespace kmax::firmware::canopen::copy_bytes_test
