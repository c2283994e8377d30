#include "host_tools/kmax/recording/watch_view.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <sstream>

#include "tests/host_tools/thrown_message.hpp"

namespace kmax::cli::watch_view_test {

std::vector<WatchedAxis> axes() {
  WatchedAxis good{.axis = 0, .force_limit = 2.5F};
  good.measured = {.tick = 77, .position = 0.0123F, .velocity = -0.5F, .force = 1.25F, .flags = 0x11};
  good.status.statusword = firmware::statusword::base_of(firmware::DriveState::operation_enabled);
  WatchedAxis bad{.axis = 1};
  bad.status.statusword = firmware::statusword::base_of(firmware::DriveState::fault);
  bad.status.error_code = firmware::text_of(firmware::Fault::over_speed).error_code;
  bad.status.fault_value = 6;
  bad.status.fault_bound = 5;
  return {good, bad};
}

std::string joined(const std::vector<std::string>& lines) {
  std::string all;
  for (const std::string& line : lines) all += line + "\n";
  return all;
}

TEST(WatchView, TheTableShowsBothAxesAndTheFaultInWords) {
  const std::string all = joined(watch_table(axes(), 80, false));
  EXPECT_CONTAINS(all, "axis 0: armed, force is on (Operation enabled)\n");
  EXPECT_CONTAINS(all, "  position      +12.300 mm\n  velocity       -500.0 mm/s\n");
  EXPECT_CONTAINS(all, "  force          +1.250 N   [              |#######       ] 2.5 N\n");
  EXPECT_CONTAINS(all, "  flags    inside the wall, armed\n");
  EXPECT_CONTAINS(all, "axis 1: fault (Fault)\n");
  EXPECT_CONTAINS(all, "faster than");
  EXPECT_CONTAINS(all, "kmax clear --axis 1");
  EXPECT_LE(watch_table(axes(), 80, false).size(), 22u) << "24 rows hold it, with the title";
}

TEST(WatchView, NoLineIsWiderThanTheTerminal) {
  for (const std::size_t width : {1u, 10u, 37u, 40u, 80u, 200u}) {
    for (const std::string& line : watch_table(axes(), width, false)) EXPECT_LE(line.size(), width);
  }
}

TEST(WatchView, BarsGiveWayBeforeTheirEnds) {
  EXPECT_CONTAINS(joined(watch_table(axes(), 60, false)),
                  "  force          +1.250 N   [           |######     ] 2.5 N\n");
}

TEST(WatchView, ColourTakesNoPlace) {
  const auto plain = watch_table(axes(), 30, false), coloured = watch_table(axes(), 30, true);
  ASSERT_EQ(plain.size(), coloured.size());
  EXPECT_EQ(coloured[0], "\x1b[32m" + plain[0] + "\x1b[0m");
  EXPECT_EQ(joined(plain).find('\x1b'), std::string::npos);
}

TEST(WatchView, ABarEndsWhereItsValueDoes) {
  EXPECT_EQ(bar(0.0F, 2.0F, 4), "[    |    ]");
  EXPECT_EQ(bar(1.0F, 2.0F, 4), "[    |##  ]");
  EXPECT_EQ(bar(-2.0F, 2.0F, 4), "[####|    ]");
  EXPECT_EQ(bar(2.1F, 2.0F, 4), "[    |###!]");
  EXPECT_EQ(bar(-INFINITY, 2.0F, 4), "[!###|    ]");
  EXPECT_EQ(bar(NAN, 2.0F, 4), "[    |###!]");
  EXPECT_EQ(bar(1.0F, 0.0F, 4), "[    |###!]");
  EXPECT_EQ(bar(0.0F, 0.0F, 0), "[|]");
}

TEST(WatchView, ALineForALog) {
  const std::string line = watch_line(2, axes());
  EXPECT_TRUE(line.starts_with("2.0 s | axis 0: armed, force is on, +12.300 mm, -500.0 mm/s, +1.2500 N,"))
      << line;
  EXPECT_CONTAINS(line, "flags: inside the wall, armed | axis 1: fault,");
  EXPECT_EQ(line.find('\n'), std::string::npos);
}

TEST(WatchView, Document) {
  const Json good = watch_json(axes()[0]);
  EXPECT_EQ(good["state"], "operation_enabled");
  EXPECT_EQ(good["flags"], Json::parse(R"(["inside the wall", "armed"])"));
  EXPECT_TRUE(good["trouble"].is_null());
  EXPECT_TRUE(watch_json(axes()[1])["trouble"].is_string());
}

TEST(LiveLines, ReplaceTheLinesBefore) {
  std::ostringstream terminal;
  LiveLines live(terminal);
  live.show({"a", "b", "c"}, 4);
  EXPECT_EQ(terminal.str(), "a\x1b[K\nb\x1b[K\nc\x1b[K\n\x1b[J");
  terminal.str("");
  live.show({"d"}, 4);
  EXPECT_EQ(terminal.str(), "\x1b[3Fd\x1b[K\n\x1b[J");
  terminal.str("");
  live.show({"e", "f"}, 4);
  EXPECT_EQ(terminal.str(), "\x1b[1Fe\x1b[K\nf\x1b[K\n\x1b[J");
}

TEST(LiveLines, NoneScrollsAwayOnASmallTerminal) {
  std::ostringstream terminal;
  LiveLines live(terminal);
  live.show({"a", "b", "c"}, 3);
  EXPECT_EQ(terminal.str(), "a\x1b[K\nb\x1b[K\n\x1b[J");
  terminal.str("");
  live.show({"d"}, 1);
  EXPECT_EQ(terminal.str(), "\x1b[2Fd\x1b[K\n\x1b[J");
}

}  // namespace kmax::cli::watch_view_test
