#include "host_tools/simulation/contact_measure.hpp"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <cmath>
#include <functional>
#include <limits>
#include <numbers>
#include <vector>

namespace kmax::simulation::contact_measure_test {

std::vector<ContactSample> record(const std::function<double(double)>& position, double begin = 2.0,
                                  double end = 3.0, double step = 0.002) {
  std::vector<ContactSample> samples;
  for (int n = 0; begin + n * step < end; ++n)
    samples.push_back({begin + n * step, position(begin + n * step)});
  return samples;
}

ContactCriterion window() {
  return ContactCriterion{.window_begin = 2.0, .window_end = 3.0};
}

TEST(ContactMeasure, StillHandleInsideTheWallIsStable) {
  const ContactMeasure measure = measure_contact(record([](double) { return -1e-4; }), window());
  EXPECT_EQ(measure.verdict, ContactVerdict::stable);
  EXPECT_EQ(measure.peak_to_peak, 0.0);
  EXPECT_EQ(measure.samples, 500u);
  EXPECT_DOUBLE_EQ(measure.deepest, 1e-4);
  EXPECT_EQ(measure.contact_share, 1.0);
}

TEST(ContactMeasure, LastingOscillationIsUnstable) {
  const ContactMeasure measure =
      measure_contact(record([](double t) { return 0.5e-3 * std::sin(2.0 * 3.14159 * 40.0 * t); }), window());
  EXPECT_EQ(measure.verdict, ContactVerdict::unstable);
  EXPECT_NEAR(measure.peak_to_peak, 1e-3, 1e-5);
  EXPECT_NEAR(measure.contact_share, 0.5, 0.05);
}

TEST(ContactMeasure, OneQuietQuarterMakesItStable) {
  for (int quiet = 0; quiet < 4; ++quiet) {
    const ContactMeasure measure =
        measure_contact(record([&](double t) {
                          const bool still = t >= 2.0 + 0.25 * quiet && t < 2.25 + 0.25 * quiet;
                          return still ? -0.1e-3 : 0.5e-3 * std::sin(2.0 * 3.14159 * 40.0 * t);
                        }),
                        window());
    EXPECT_EQ(measure.verdict, ContactVerdict::stable) << quiet;
    EXPECT_LT(measure.quarter_peak_to_peak[static_cast<std::size_t>(quiet)], 1e-9);
  }
}

TEST(ContactMeasure, ExactlyTheThresholdIsStable) {
  ContactCriterion criterion = window();
  criterion.threshold = 0x1p-12;
  const auto square = [](double height) {
    return record(
        [height](double t) { return static_cast<int>(std::round(t / 0.002)) % 2 == 0 ? 0.0 : -height; });
  };
  EXPECT_EQ(measure_contact(square(0x1p-12), criterion).verdict, ContactVerdict::stable);
  EXPECT_EQ(measure_contact(square(0x1.001p-12), criterion).verdict, ContactVerdict::unstable);
}

TEST(ContactMeasure, HoveringInFrontOfTheWallIsNoContactOnEitherSide) {
  EXPECT_EQ(measure_contact(record([](double) { return 1e-6; }), window()).verdict,
            ContactVerdict::no_contact);
  EXPECT_EQ(measure_contact(record([](double) { return 0.0; }), window()).verdict, ContactVerdict::stable);
  ContactCriterion mirrored = window();
  mirrored.wall_side = -1.0;
  mirrored.wall_position = 0.01;
  EXPECT_EQ(measure_contact(record([](double) { return 0.0099; }), mirrored).verdict,
            ContactVerdict::no_contact);
  EXPECT_EQ(measure_contact(record([](double) { return 0.0101; }), mirrored).verdict, ContactVerdict::stable);
  mirrored.contact_margin = 0.2e-3;
  EXPECT_EQ(measure_contact(record([](double) { return 0.0099; }), mirrored).verdict, ContactVerdict::stable);
}

TEST(ContactMeasure, SamplesOutsideTheWindowDoNotCount) {
  std::vector<ContactSample> samples =
      record([](double t) { return t < 2.0 || t >= 3.0 ? 5.0 : -1e-4; }, 0.0, 4.0);
  const ContactMeasure measure = measure_contact(samples, window());
  EXPECT_EQ(measure.peak_to_peak, 0.0);
  EXPECT_EQ(measure.samples, 500u);
}

TEST(ContactMeasure, RefusesWhatCannotBeJudged) {
  const auto still = [](double) { return 0.0; };
  EXPECT_THROW(measure_contact({}, window()), std::invalid_argument);
  EXPECT_THROW(measure_contact(record(still, 2.0, 2.7), window()), std::invalid_argument);
  EXPECT_THROW(measure_contact(record(still, 2.0, 3.0, 0.2), window()), std::invalid_argument);
  std::vector<ContactSample> backwards = record(still);
  backwards[7].time = 2.0;
  EXPECT_THROW(measure_contact(backwards, window()), std::invalid_argument);
  std::vector<ContactSample> broken = record(still);
  broken[100].position = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THROW(measure_contact(broken, window()), std::invalid_argument);
  ContactCriterion criterion = window();
  criterion.window_end = criterion.window_begin;
  EXPECT_THROW(measure_contact(record(still), criterion), std::invalid_argument);
  criterion = window();
  criterion.threshold = 0.0;
  EXPECT_THROW(measure_contact(record(still), criterion), std::invalid_argument);
  criterion = window();
  criterion.wall_side = 0.0;
  EXPECT_THROW(measure_contact(record(still), criterion), std::invalid_argument);
}

RC_GTEST_PROP(ContactMeasure, VerdictIsTheSameMirroredAndShifted, ()) {
  const double amplitude = *rc::gen::inRange(0, 400) * 1e-6;
  const double centre = *rc::gen::inRange(-400, 400) * 1e-6;
  const double shift = *rc::gen::inRange(-10, 11) / 8.0;
  const auto position = [&](double t) { return centre + amplitude * std::sin(200.0 * t); };
  const ContactMeasure plain = measure_contact(record(position), window());
  ContactCriterion mirrored = window();
  mirrored.wall_side = -1.0;
  mirrored.wall_position = -shift;
  const ContactMeasure mirror =
      measure_contact(record([&](double t) { return -(position(t) + shift); }), mirrored);
  RC_ASSERT(std::abs(plain.peak_to_peak - mirror.peak_to_peak) < 1e-14);
  if (std::abs(centre - amplitude) > 1e-9 && std::abs(2.0 * amplitude - 0.165e-3) > 3e-6) {
    RC_ASSERT(plain.verdict == mirror.verdict);
  }
}

// A real device's position: counts times a transmission that the device holds as a float.
TEST(ContactMeasure, ThreeCountsAreStableWhateverTheRounding) {
  const double turn = 2.0 * std::numbers::pi / 4000.0;  // rad per count
  const double count_length = static_cast<double>(static_cast<float>(0.055e-3 / turn)) * turn;
  for (const int lowest : {-7, -1000, 12345, -363637}) {
    const auto swing = [&](int counts) {
      return record([&, counts](double t) {
        const int number = static_cast<int>(std::round(t / 0.002)) % 2 == 0 ? lowest : lowest + counts;
        return count_length * number;
      });
    };
    ContactCriterion criterion = window();
    criterion.wall_position = count_length * (lowest + 10);
    ASSERT_GT(3 * count_length, criterion.threshold);
    EXPECT_EQ(measure_contact(swing(3), criterion).verdict, ContactVerdict::stable) << lowest;
    EXPECT_EQ(measure_contact(swing(4), criterion).verdict, ContactVerdict::unstable) << lowest;
  }
}

}  // namespace kmax::simulation::contact_measure_test
