#include "host_tools/simulation/converter_code.hpp"

#include <gtest/gtest.h>

#include <limits>
#include <stdexcept>

namespace kmax::simulation::converter_code_test {

TEST(ConverterCode, IsTheNearestCodeWithinTheRange) {
  EXPECT_EQ(converter_code(0.0), 0);
  EXPECT_EQ(converter_code(1.65), 2048);
  constexpr double step = 3.3 / 4096.0;
  EXPECT_EQ(converter_code(100.49 * step), 100);
  EXPECT_EQ(converter_code(100.51 * step), 101);
  EXPECT_EQ(converter_code(3.3), 4095);
  EXPECT_EQ(converter_code(5.0), 4095);
  EXPECT_EQ(converter_code(-1.0), 0);
  EXPECT_EQ(converter_code(std::numeric_limits<double>::infinity()), 4095);
  EXPECT_THROW(converter_code(std::numeric_limits<double>::quiet_NaN()), std::invalid_argument);
}

}  // namespace kmax::simulation::converter_code_test
