#pragma once
// Was a held contact stable? Judged from the recorded position of the handle alone, so that a simulated and a
// real device are judged by the same rule. The papers give no measure; this one is ours:
//
//   unstable   = peak-to-peak position > threshold (by more than its millionth) in every quarter of the
//                judged window
//   stable     = not unstable, and the handle touched the wall
//   no_contact = the handle was never inside the wall during the window
//
// The threshold of 0.165 mm is three counts of the Geomagic Touch's 0.055 mm: an oscillation that cannot be
// the flicker of a count. Exactly three counts are therefore stable, and the millionth keeps them so: a
// device holds its transmission as a float, which at 4000 counts per turn makes three counts 0.165000008 mm,
// and differences of positions round too. That is below 1e-7 of the threshold; the next count is a third of
// it. "In every quarter" separates a lasting oscillation from one that dies out, and from a single slip.
// Contact means that at least one sample of the window lies on the wall's inner side, side * (x - wall) <=
// margin: a hand that hovers in the magnetic field in front of the surface, however still, has not shown that
// the wall is stable. A handle that bounces out of the wall and back is in contact.
//
// The measure sees 3.3 N of clipped force as 0.6 mm at 5.5 N/mm: with a clipped force large amplitudes say
// little.

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <span>
#include <stdexcept>

namespace kmax::simulation {

/// m peak to peak, beyond which a handle moves: three counts of paper 1's device. No paper gives a measure.
inline constexpr double unstable_motion = 0.165e-3;
inline constexpr double rounding_allowance = 1e-6;  // of the threshold

struct ContactSample {
  double time;      // s
  double position;  // m
};

struct ContactCriterion {
  double window_begin = 0.0;           // s
  double window_end = 1.0;             // s
  double threshold = unstable_motion;  // m, > 0
  double wall_position = 0.0;          // m
  double wall_side = 1.0;              // +1 or -1: free space is on this side
  double contact_margin = 0.0;         // m, >= 0: how far outside still counts as contact
};

enum class ContactVerdict { stable, unstable, no_contact };

struct ContactMeasure {
  ContactVerdict verdict = ContactVerdict::no_contact;
  double peak_to_peak = 0.0;                     // m, whole window
  std::array<double, 4> quarter_peak_to_peak{};  // m
  double deepest = 0.0;                          // m, largest penetration in the window; negative = outside
  double contact_share = 0.0;                    // share of the window's samples in contact
  std::size_t samples = 0;
};

// Whether the window has what measure_contact() needs: two samples in every quarter.
inline bool can_be_judged(std::span<const ContactSample> recording, const ContactCriterion& criterion) {
  std::array<std::size_t, 4> count{};
  const double length = criterion.window_end - criterion.window_begin;
  for (const ContactSample& sample : recording) {
    if (sample.time < criterion.window_begin || sample.time >= criterion.window_end) continue;
    const double part = (sample.time - criterion.window_begin) / length * 4.0;
    ++count[std::min<std::size_t>(3, static_cast<std::size_t>(part))];
  }
  return *std::min_element(count.begin(), count.end()) >= 2;
}

// Samples outside [window_begin, window_end) are ignored, so a whole recording can be given. Samples must be
// in order of time, with at least two in every quarter. Throws std::invalid_argument. Cost: one pass, no
// allocation.
inline ContactMeasure measure_contact(std::span<const ContactSample> recording,
                                      const ContactCriterion& criterion) {
  const double length = criterion.window_end - criterion.window_begin;
  if (!(length > 0.0) || !std::isfinite(length)) {
    throw std::invalid_argument(
        fmt::format("contact window from {} s to {} s: the end must lie after the beginning",
                    criterion.window_begin, criterion.window_end));
  }
  if (!(criterion.threshold > 0.0) || !(criterion.contact_margin >= 0.0) ||
      std::abs(criterion.wall_side) != 1.0 || !std::isfinite(criterion.wall_position)) {
    throw std::invalid_argument(fmt::format(
        "contact criterion with threshold {} m, margin {} m, wall at {} m, side {}: the threshold must be > "
        "0, the margin >= 0, the side -1 or +1",
        criterion.threshold, criterion.contact_margin, criterion.wall_position, criterion.wall_side));
  }

  constexpr double infinity = std::numeric_limits<double>::infinity();
  std::array<double, 4> low{infinity, infinity, infinity, infinity};
  std::array<double, 4> high{-infinity, -infinity, -infinity, -infinity};
  std::array<std::size_t, 4> count{};
  std::size_t touching = 0;
  double innermost = infinity;
  double previous = -infinity;
  for (const ContactSample& sample : recording) {
    if (!(sample.time >= previous)) {
      throw std::invalid_argument(fmt::format(
          "recording goes from {} s back to {} s: sort the samples by time", previous, sample.time));
    }
    previous = sample.time;
    if (sample.time < criterion.window_begin || sample.time >= criterion.window_end) continue;
    if (!std::isfinite(sample.position)) {
      throw std::invalid_argument(
          fmt::format("position at {} s is {}: it must be finite", sample.time, sample.position));
    }
    const double part = (sample.time - criterion.window_begin) / length * 4.0;
    const std::size_t quarter = std::min<std::size_t>(3, static_cast<std::size_t>(part));
    low[quarter] = std::min(low[quarter], sample.position);
    high[quarter] = std::max(high[quarter], sample.position);
    ++count[quarter];
    const double outside = criterion.wall_side * (sample.position - criterion.wall_position);
    innermost = std::min(innermost, outside);
    if (outside <= criterion.contact_margin) ++touching;
  }

  const double threshold = criterion.threshold * (1.0 + rounding_allowance);
  ContactMeasure measure;
  bool oscillates = true;
  for (std::size_t quarter = 0; quarter < 4; ++quarter) {
    if (count[quarter] < 2) {
      throw std::invalid_argument(
          fmt::format("quarter {} of the contact window from {} s to {} s holds {} samples: at least 2 are "
                      "needed; record longer or faster",
                      quarter + 1, criterion.window_begin, criterion.window_end, count[quarter]));
    }
    measure.quarter_peak_to_peak[quarter] = high[quarter] - low[quarter];
    oscillates = oscillates && measure.quarter_peak_to_peak[quarter] > threshold;
    measure.samples += count[quarter];
  }
  measure.peak_to_peak =
      *std::max_element(high.begin(), high.end()) - *std::min_element(low.begin(), low.end());
  measure.deepest = -innermost;
  measure.contact_share = static_cast<double>(touching) / static_cast<double>(measure.samples);
  if (touching == 0) {
    measure.verdict = ContactVerdict::no_contact;
  } else {
    measure.verdict = oscillates ? ContactVerdict::unstable : ContactVerdict::stable;
  }
  return measure;
}

}  // namespace kmax::simulation
