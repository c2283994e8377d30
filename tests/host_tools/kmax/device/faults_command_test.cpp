// kmax faults on a simulated device that outlives the commands, and restarts when told.
#include <gtest/gtest.h>

#include <sstream>

#include "firmware/command/fault_log.hpp"
#include "tests/host_tools/kmax/wired_command_line.hpp"

namespace kmax::cli::faults_command_test {
namespace {
using firmware::DriveState;

class FaultsCommand : public WiredCommandLine {
 protected:
  FaultsCommand() { EXPECT_EQ(kmax({"set", "wall.law=none", "axis1.wall.law=none"}), base::done) << said; }
  /// The host arms and falls silent.
  void trip(int axis) {
    ASSERT_EQ(kmax({"set", "link.timeout=0.25"}), base::done) << said;
    ASSERT_EQ(kmax({"arm", "--axis", std::to_string(axis)}), base::done) << said;
    device->wait(std::chrono::milliseconds(400));
    ASSERT_EQ(device->simulation().board().application().state(static_cast<std::size_t>(axis)),
              DriveState::fault);
    ASSERT_EQ(kmax({"clear", "--axis", std::to_string(axis)}), base::done) << said;
  }
  void restart() {
    auto& board = device->simulation().board();
    board.connect_can(true);
    device->wait(std::chrono::milliseconds(5));
    board.receive_can(std::array{drivers::CanFrame{.identifier = 0, .length = 2, .data = {0x81, 0}}});
    device->wait(std::chrono::milliseconds(5));
  }
  std::vector<std::string> lines() const {
    std::vector<std::string> all;
    std::istringstream text(output);
    for (std::string line; std::getline(text, line);) all.push_back(line);
    return all;
  }
};

TEST_F(FaultsCommand, ATripIsThereWithItsNumbersAndStaysOverARestart) {
  ASSERT_EQ(kmax({"faults"}), base::done) << said;
  EXPECT_EQ(output, "no fault and no reset since power-on, or since the log was erased\n");
  ASSERT_EQ(kmax({"faults", "--json"}), base::done);
  EXPECT_EQ(document(), (Json{{"start", 1}, {"entries", Json::array()}}));
  trip(1);
  const double tick = device->simulation().board().application().values().whole<"info.tick">();
  restart();
  for (const bool again : {false, true}) {
    ASSERT_EQ(kmax({"faults", "--json"}), base::done) << said;
    const Json all = document();
    EXPECT_EQ(all["start"], again ? 3 : 2);
    ASSERT_EQ(all["entries"].size(), 2U) << all;
    EXPECT_EQ(all["entries"][0]["number"], 2);
    EXPECT_EQ(all["entries"][0]["event"], "start");
    EXPECT_EQ(all["entries"][0]["name"], "restart by software");
    EXPECT_EQ(all["entries"][0]["reset_cause"], "software");
    EXPECT_EQ(all["entries"][0]["times"], again ? 2 : 1);
    EXPECT_EQ(all["entries"][0]["crash"], nullptr);
    const Json& fault = all["entries"][1];
    EXPECT_EQ(fault["number"], 1);
    EXPECT_EQ(fault["start"], 1);
    EXPECT_EQ(fault["event"], "fault");
    EXPECT_EQ(fault["name"], "link_silent");
    EXPECT_EQ(fault["error_code"], 0x8130);
    EXPECT_EQ(fault["axis"], 1);
    EXPECT_GT(fault["value"], 0.25);
    EXPECT_LT(fault["value"], 0.26);
    EXPECT_EQ(fault["bound"], 0.25);
    EXPECT_EQ(fault["unit"], "s");
    EXPECT_GT(fault["tick"], 0.0);
    EXPECT_LT(fault["tick"], tick);
    EXPECT_DOUBLE_EQ(fault["time"].get<double>() * 20000, fault["tick"].get<double>());
    for (const char* key : {"position", "velocity", "force", "current", "supply", "temperature"})
      EXPECT_TRUE(fault[key].is_number()) << key;
    restart();
  }
  ASSERT_EQ(kmax({"faults"}), base::done);
  EXPECT_CONTAINS(output, "link_silent");
  EXPECT_CONTAINS(output, "restart by software    3 times");
  EXPECT_CONTAINS(output, " 0.25 s\n");
  ASSERT_EQ(kmax({"faults", "1"}), base::done);
  EXPECT_CONTAINS(output, "that is            the host was silent for longer than link.timeout\n");
  EXPECT_CONTAINS(output, "look at            check the cable and the host program");
  EXPECT_CONTAINS(output, "bound              0.25 s\n");
  ASSERT_EQ(kmax({"faults", "2"}), base::done);
  EXPECT_CONTAINS(output, "times in a row     3\n");
  expect_error({"faults", "9"}, base::wrong_usage, "the fault log has no entry 9; it has 1 to 2");
}

TEST_F(FaultsCommand, AFullLogFitsATerminal) {
  for (int i = 0; i < 18; ++i) trip(i % 2);
  ASSERT_EQ(kmax({"faults"}), base::done);
  EXPECT_EQ(lines().size(), 18U) << "a heading, 16 entries, what to do next";
  for (const std::string& line : lines()) EXPECT_LE(line.size(), 80U) << line;
  EXPECT_CONTAINS(lines()[1], "   18     1");
  EXPECT_CONTAINS(lines()[16], "    3     1");
}

TEST_F(FaultsCommand, IsErasedOnlyDisarmed) {
  trip(0);
  ASSERT_EQ(kmax({"set", "link.timeout=0"}), base::done) << said;
  ASSERT_EQ(kmax({"arm"}), base::done) << said;
  expect_error({"faults", "--clear"}, base::failed, "it cannot change while an axis is armed; disarm first");
  ASSERT_EQ(kmax({"disarm"}), base::done);
  ASSERT_EQ(kmax({"faults", "--clear", "--json"}), base::done) << said;
  EXPECT_EQ(document(), (Json{{"erased", 1}}));
  ASSERT_EQ(kmax({"faults", "--clear"}), base::done) << said;
  EXPECT_EQ(output, "erased 0 entries of the fault log\n");
  restart();
  ASSERT_EQ(kmax({"faults", "--json"}), base::done);
  EXPECT_EQ(document()["entries"].size(), 1U) << "the restart";
  expect_error({"faults", "--clear", "1"}, base::wrong_usage, "excludes");
}

}  // namespace
}  // namespace kmax::cli::faults_command_test
