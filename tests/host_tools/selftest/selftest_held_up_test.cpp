// A program that is not run for more than link.timeout finds its axis off. That is no finding about the axis.
#include "host_tools/base/errors.hpp"
#include "host_tools/selftest/selftest.hpp"
#include "tests/host_tools/selftest/tested_axis.hpp"
#include "tests/host_tools/thrown_message.hpp"
#include "tests/in_a_soak.hpp"

namespace kmax::selftest::selftest_held_up_test {

using host_tools_test::thrown_message;
using std::chrono::milliseconds;

constexpr milliseconds too_long{1100};  // link.timeout is 1 s

bool armed(TestedAxis& tested) {
  const auto& legs = tested.drives().bridge(tested.axis).legs;
  return legs[1].enabled || legs[2].enabled;
}

std::string verdicts(const Report& report) {
  std::string text;
  for (const CheckResult& check : report.checks) text += check.name + ": " + name_of(check.verdict) + "\n";
  return text;
}

/// Holds up the `message`-th message that is sent while the axis is armed in the `step`-th step whose name
/// begins with `words`, once. Steps and messages count from 0.
Report run_held_up(TestedAxis& tested, const std::string& words, int step, int message, bool& held_up) {
  int steps = -1, messages = 0;
  held_up = false;
  tested.link->held_up = [&, step, message] {
    if (held_up || steps != step || !armed(tested) || messages++ != message) return milliseconds(0);
    held_up = true;
    return too_long;
  };
  SelfTestSettings settings;
  settings.axis = tested.axis;
  settings.link_exchanges = 10;
  const Report report = run_selftest(*tested.device, settings, [&](const std::string& text) {
    if (!text.starts_with(words)) return;
    ++steps;
    messages = 0;
  });
  tested.link->held_up = {};
  return report;
}

// Right after arming, before the pulse is started, and after it, up to the last message of the step.
TEST(SelfTestHeldUp, OnceAnywhereChangesNoVerdict) {
  TestedAxis tested("motor_axes");
  const auto before = tested.settings();
  const std::string expected = verdicts(tested.run());
  EXPECT_EQ(expected.find("not judged"), std::string::npos) << expected;
  for (const auto& [words, step] :
       {std::pair("arming", 0), std::pair("a pulse", 1), std::pair("a pulse", 5)}) {
    const int apart = in_a_soak() ? 7 : 23;
    int message = 0;
    for (bool held_up = true; held_up; message += apart) {
      const Report report = run_held_up(tested, words, step, message, held_up);
      EXPECT_EQ(verdicts(report), expected) << words << " " << step << ", message " << message << "\n"
                                            << text_of(report);
      EXPECT_FALSE(report.fault_at_start) << "the one before has left nothing behind";
    }
    EXPECT_GT(message, apart) << words << " " << step << ": held up at least once";
  }
  EXPECT_EQ(tested.settings(), before);
}

TEST(SelfTestHeldUp, AgainAndAgainTheTestCannotBeCarriedOut) {
  for (const char* words : {"arming", "a pulse"}) {
    TestedAxis tested("motor_axes");
    const auto before = tested.settings();
    bool begun = false;
    int times = 0;
    tested.link->held_up = [&] {
      if (!begun || !armed(tested)) return milliseconds(0);
      ++times;
      return too_long;
    };
    const std::string text = thrown_message<SelfTestEnded>([&] {
      run_selftest(*tested.device, {},
                   [&](const std::string& step) { begun = begun || step.starts_with(words); });
    });
    EXPECT_NE(text.find("3 times in a row the device heard nothing for 1 s and removed the force"),
              std::string::npos)
        << text;
    EXPECT_EQ(times, bench::most_silences) << words;
    tested.link->held_up = {};
    EXPECT_TRUE(tested.disarmed());
    EXPECT_EQ(tested.settings(), before);
  }
}

}  // namespace kmax::selftest::selftest_held_up_test
