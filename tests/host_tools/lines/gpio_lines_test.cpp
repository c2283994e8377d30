// The kernel's GPIO lines through libgpiod, on a simulated chip: KMAX_TEST_GPIO names a chip of the kernel's
// gpio-sim with at least four free lines. Without it only what needs no chip is tested.
#include "host_tools/lines/gpio_lines.hpp"

#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <thread>

#include "tests/host_tools/thrown_message.hpp"

namespace kmax::lines::gpio_lines_test {

using std::chrono::milliseconds;

TEST(GpioLines, AChipThatIsNotThereIsNamed) {
  const auto gpio = kernel_gpio_lines();
  EXPECT_CONTAINS(host_tools_test::thrown_message<LineError>(
                      [&] { gpio->describe({.chip = "no_such_chip", .offset = 3, .name = ""}); }),
                  "GPIO chip 'no_such_chip' cannot be opened");
  EXPECT_CONTAINS(host_tools_test::thrown_message<LineError>(
                      [&] { gpio->drive({.chip = "", .offset = {}, .name = "NO_SUCH_LINE"}, true); }),
                  "line \"NO_SUCH_LINE\": there is no line of this name");
}

class SimulatedChip : public testing::Test {
 protected:
  void SetUp() override {
    const char* named = std::getenv("KMAX_TEST_GPIO");
    if (named == nullptr || *named == '\0')
      GTEST_SKIP() << "KMAX_TEST_GPIO names no chip of gpio-sim: the kernel's GPIO lines are not tested";
    chip = std::filesystem::path(named).filename();
    for (const auto& entry : std::filesystem::directory_iterator("/sys/devices/platform")) {
      if (std::filesystem::exists(entry.path() / chip / "sim_gpio0")) folder = entry.path() / chip;
    }
    ASSERT_FALSE(folder.empty()) << chip << " is not a chip of gpio-sim";
    gpio = kernel_gpio_lines();
    for (unsigned line = 0; line < 4; ++line) pull(line, false);
  }

  LineSettings line(unsigned offset, Polarity polarity = Polarity::active_high) const {
    LineSettings settings;
    settings.chip = chip;
    settings.offset = offset;
    settings.polarity = polarity;
    return settings;
  }
  std::filesystem::path of(unsigned offset) const { return folder / ("sim_gpio" + std::to_string(offset)); }
  void pull(unsigned offset, bool up) const {
    std::ofstream(of(offset) / "pull") << (up ? "pull-up" : "pull-down") << std::flush;
  }
  bool high(unsigned offset) const {
    std::string text;
    std::ifstream(of(offset) / "value") >> text;
    return text == "1";
  }

  std::string chip;
  std::filesystem::path folder;
  std::unique_ptr<GpioLines> gpio;
};

TEST_F(SimulatedChip, AnOutputIsHeldAndFallsBackToItsPull) {
  {
    const auto output = gpio->drive(line(0), true);
    EXPECT_TRUE(high(0));
    output->set(false);
    EXPECT_FALSE(high(0));
    output->set(true);
    const LineFacts facts = gpio->describe(line(0));
    EXPECT_EQ(facts.consumer, "kmax");
    EXPECT_TRUE(facts.output);
    EXPECT_FALSE(facts.active.has_value());
    EXPECT_CONTAINS(host_tools_test::thrown_message<LineError>([&] { gpio->drive(line(0), false); }),
                    "another program holds it");
    EXPECT_TRUE(high(0));
  }
  EXPECT_FALSE(high(0));
  EXPECT_EQ(gpio->describe(line(0)).consumer, "");
}

TEST_F(SimulatedChip, ActiveLowTurnsOutputAndReadingAround) {
  const auto output = gpio->drive(line(0, Polarity::active_low), true);
  EXPECT_FALSE(high(0));
  output->set(false);
  EXPECT_TRUE(high(0));
  EXPECT_EQ(gpio->describe(line(1, Polarity::active_low)).active, true);
  EXPECT_EQ(gpio->describe(line(1, Polarity::active_low)).high, false);
  pull(1, true);
  EXPECT_EQ(gpio->describe(line(1, Polarity::active_low)).active, false);
  EXPECT_EQ(gpio->describe(line(1)).active, true);
}

TEST_F(SimulatedChip, AnOpenDrainIsNotPushedHigh) {
  LineSettings drain = line(0);
  drain.drive = Drive::open_drain;
  pull(0, true);
  const auto output = gpio->drive(drain, false);
  EXPECT_FALSE(high(0));
  output->set(true);
  EXPECT_TRUE(high(0));
  pull(0, false);
  EXPECT_FALSE(high(0)) << "it was pushed";
}

TEST_F(SimulatedChip, LookingChangesNothing) {
  gpio->drive(line(2), true);
  const bool output_before = gpio->describe(line(2)).output;
  EXPECT_EQ(gpio->describe(line(2)).output, output_before);
}

TEST_F(SimulatedChip, EveryEdgeIsSeenWithItsTime) {
  const std::array settings = {line(1), line(3, Polarity::active_low)};
  const auto watch = gpio->watch(settings);
  EXPECT_EQ(watch->states(), (std::vector<bool>{false, true}));
  EXPECT_TRUE(watch->wait(milliseconds(0)).empty());
  pull(1, true);
  pull(3, true);
  pull(1, false);
  std::vector<Edge> edges;
  while (edges.size() < 3) {
    const auto found = watch->wait(milliseconds(5000));
    ASSERT_FALSE(found.empty());
    edges.insert(edges.end(), found.begin(), found.end());
  }
  ASSERT_EQ(edges.size(), 3u);
  EXPECT_EQ(edges[0].line, 0u);
  EXPECT_TRUE(edges[0].active);
  EXPECT_EQ(edges[1].line, 1u);
  EXPECT_FALSE(edges[1].active);
  EXPECT_EQ(edges[2].line, 0u);
  EXPECT_FALSE(edges[2].active);
  EXPECT_GT(edges[0].time.count(), 0);
  EXPECT_LE(edges[0].time, edges[1].time);
  EXPECT_LE(edges[1].time, edges[2].time);
}

TEST_F(SimulatedChip, TheWaitEndsAtAnEdgeOfAnotherThread) {
  const std::array settings = {line(1)};
  const auto watch = gpio->watch(settings);
  std::thread other([this] {
    std::this_thread::sleep_for(milliseconds(50));
    pull(1, true);
  });
  const auto edges = watch->wait(milliseconds(60'000));
  other.join();
  ASSERT_EQ(edges.size(), 1u);
  EXPECT_TRUE(edges[0].active);
}

TEST_F(SimulatedChip, ALineBeyondTheChipIsRefused) {
  EXPECT_CONTAINS(host_tools_test::thrown_message<LineError>([&] { gpio->describe(line(60000)); }),
                  "the chip has the lines 0 to");
}

}  // namespace kmax::lines::gpio_lines_test
