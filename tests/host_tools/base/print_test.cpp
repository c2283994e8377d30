#include "host_tools/base/print.hpp"

#include <gtest/gtest.h>

#include <limits>
#include <sstream>
#include <string>
#include <utility>

namespace kmax::base::print_test {

template <typename... Values>
std::string printed(fmt::format_string<Values...> text, Values&&... values) {
  std::ostringstream out;
  print(out, text, std::forward<Values>(values)...);
  return out.str();
}

TEST(Print, WritesWhatFormatMakes) {
  EXPECT_EQ(printed("nothing to fill in, 100 %\n"), "nothing to fill in, 100 %\n");
  EXPECT_EQ(printed("{} is {:.2f} {}, {:08X}", std::string("K"), 3.578, "N/mm", 0xBEEFU),
            "K is 3.58 N/mm, 0000BEEF");
  EXPECT_EQ(printed("{1} before {0:>5}", 7, 'x'), "x before     7");
  EXPECT_EQ(printed("{{}} {}", std::numeric_limits<double>::quiet_NaN()), "{} nan");
}

TEST(Print, AppendsAndLeavesTheStreamsOwnSettingsAlone) {
  std::ostringstream out;
  out << std::hex;
  print(out, "{}-", 255);
  print(out, "{}-", 255);
  out << 255;
  EXPECT_EQ(out.str(), "255-255-ff");
}

TEST(Print, AStreamThatFailsSaysSo) {
  std::ostringstream out;
  out.setstate(std::ios::badbit);
  print(out, "{}", 1);
  EXPECT_TRUE(out.bad());
  EXPECT_EQ(out.str(), "");
}

}  // namespace kmax::base::print_test
