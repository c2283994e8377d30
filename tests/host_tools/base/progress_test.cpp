#include "host_tools/base/progress.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <sstream>

namespace kmax::base::progress_test {

TEST(Progress, ElsewhereThanOnATerminalItIsALineNowAndThen) {
  std::ostringstream messages;
  const auto begin = std::chrono::steady_clock::now();
  {
    Progress progress(messages);
    for (int i = 0; i < 1000; ++i) progress.show("step " + std::to_string(i));
  }
  const auto seconds =
      std::chrono::duration_cast<std::chrono::seconds>(std::chrono::steady_clock::now() - begin);
  const std::string text = messages.str();
  EXPECT_EQ(text.substr(0, text.find('\n')), "kmax: step 0");
  EXPECT_LE(std::count(text.begin(), text.end(), '\n'), 1 + seconds.count() / 2);
  EXPECT_EQ(text.find('\r'), std::string::npos);
}

TEST(Progress, NothingShownLeavesNoTrace) {
  std::ostringstream messages;
  { const Progress progress(messages); }
  EXPECT_EQ(messages.str(), "");
}

}  // namespace kmax::base::progress_test
