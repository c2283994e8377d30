#include "host_tools/record/recording.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <sstream>

#include "host_tools/device/link.hpp"

namespace kmax::record::recording_test {

/// A row every 20 ticks, none at every third question, and perhaps an end.
class MadeUpSource final : public RowSource {
 public:
  std::optional<Row> next(std::chrono::microseconds) override {
    if (++asked % 3 == 0) return std::nullopt;
    if (asked > fails_after) throw device::LinkError("gone");
    tick += 20;
    return Row{.tick = tick};
  }
  void stop() override {}
  std::optional<Losses> losses() const override { return Losses{4, 2}; }
  bool axes_apart() const override { return false; }

  std::uint64_t tick = 5000;
  int asked = 0, fails_after = 1'000'000;
};

const RowCsv csv({0}, false);
const auto never = [](const RecordingProgress&) { return false; };

TEST(Recording, EndsAfterTheDevicesTime) {
  MadeUpSource source;
  std::ostringstream out;
  RecordingProgress progress;
  record(source, out, csv, 0.1, never, progress);
  EXPECT_EQ(progress.rows, 100u);
  EXPECT_EQ(progress.first_tick, 5020u);
  EXPECT_EQ(progress.last_tick, 5020u + 99 * 20);
  EXPECT_NEAR(progress.seconds(), 0.099, 1e-12);
  EXPECT_NEAR(progress.rate(), 1000, 1e-9);
  EXPECT_EQ(progress.losses->rows, 4u);
  const std::string text = out.str();
  EXPECT_EQ(std::count(text.begin(), text.end(), '\n'), 101);
  EXPECT_TRUE(text.starts_with("time_s,tick,axis0_position_m"));
}

TEST(Recording, EndsWhenAsked) {
  MadeUpSource source;
  std::ostringstream out;
  RecordingProgress progress;
  record(
      source, out, csv, std::nullopt, [](const RecordingProgress& now) { return now.rows == 7; }, progress);
  EXPECT_EQ(progress.rows, 7u);
}

TEST(Recording, KeepsWhatCameBeforeAnError) {
  MadeUpSource source;
  source.fails_after = 10;
  std::ostringstream out;
  RecordingProgress progress;
  EXPECT_THROW(record(source, out, csv, std::nullopt, never, progress), device::LinkError);
  EXPECT_EQ(progress.rows, 7u);
  const std::string text = out.str();
  EXPECT_EQ(std::count(text.begin(), text.end(), '\n'), 8);
}

TEST(Recording, AnOutputThatTakesNoMoreIsAnError) {
  MadeUpSource source;
  std::ostringstream out;
  RecordingProgress progress;
  const auto break_it = [&](const RecordingProgress& now) {
    if (now.rows == 3) out.setstate(std::ios::badbit);
    return false;
  };
  EXPECT_THROW(record(source, out, csv, std::nullopt, break_it, progress), std::runtime_error);
  EXPECT_EQ(progress.rows, 3u);
}

/// How many characters have been given on to the operating system.
class CountingBuffer final : public std::stringbuf {
 public:
  std::size_t handed_on = 0;

 private:
  int sync() override {
    handed_on = str().size();
    return 0;
  }
};

TEST(Recording, EveryLineIsHandedOnWhole) {
  MadeUpSource source;
  CountingBuffer buffer;
  std::ostream out(&buffer);
  RecordingProgress progress;
  record(
      source, out, csv, std::nullopt,
      [&](const RecordingProgress& now) {
        EXPECT_EQ(buffer.handed_on, buffer.str().size());
        EXPECT_EQ(buffer.str().back(), '\n');
        return now.rows == 5;
      },
      progress);
}

TEST(Recording, OneRowOrNoneHasNoRate) {
  EXPECT_EQ(RecordingProgress{}.rate(), 0);
  EXPECT_EQ((RecordingProgress{.rows = 1, .first_tick = 5, .last_tick = 5}.rate()), 0);
}

}  // namespace kmax::record::recording_test
