#pragma once
// Every number of the two papers that an experiment compares itself with, in SI units, with the place where
// it is printed. The only place in the program where they are written down.
//
// Both papers (title_1, title_2) give means over people, without spreads: paper 1's tables over six, its
// stiffnesses over twelve.

#include <array>
#include <cstddef>
#include <optional>
#include <string_view>

namespace kmax::experiment::paper {

// As far as the copies that these numbers were taken from say it, which name neither authors nor DOI; the
// authors of the first are those of the journal's page.
inline constexpr std::string_view title_1 =
    "Xiong Lu, Beibei Qi, Hao Zhao, Junbin Sun: A Human Arm's Mechanical Impedance Tuning Method for "
    "Improving the Stability of Haptic Rendering, Robotica, first published online on July 21, 2020.";
inline constexpr std::string_view title_2 =
    "on the relation between the position resolution of a haptic device and its stability, with experiments "
    "on a Phantom Desktop.";

// --- Paper 1, section 4: device and setting of its main experiments ---------------------------------------
inline constexpr double touch_resolution = 0.055e-3;     // m, section 4
inline constexpr double touch_force_limit = 3.3;         // N, section 4
inline constexpr double update_rate = 500.0;             // Hz, section 4.2
inline constexpr double stiffness_step = 100.0;          // N/m, section 4.2
inline constexpr double search_start = 3000.0;           // N/m, section 4.2, constant F_MC
inline constexpr double search_start_adaptive = 5000.0;  // N/m, section 4.3
inline constexpr std::size_t study_subjects = 12;        // section 4.1

// --- Paper 1, Figs. 6 to 8: greatest stable stiffness, and transparency, mean of twelve subjects ----------
struct MaxStiffness {
  std::string_view condition;
  double magnetic_coefficient;  // N; of the adaptive law the interval of F_MC is [0.8, 2] N
  bool adaptive;
  double stiffness;     // N/m
  double transparency;  // rated from 0 to 5; 5 is the plain wall's by definition. Nothing here computes one
  std::string_view source;
};
inline constexpr std::array<MaxStiffness, 3> max_stiffness{{
    {"plain wall", 0.0, false, 3580.0, 5.0, "section 4.2, Figs. 6 and 7"},
    {"F_MC = 2 N", 2.0, false, 8410.0, 2.58, "section 4.2, Figs. 6 and 7"},
    {"adaptive", 0.0, true, 8020.0, 3.72, "section 4.3, Fig. 8"},
}};
// The simulated people are fitted to those of them with a constant field (operator_calibration.hpp).
constexpr bool fitted_to(double constant_coefficient) {
  for (const MaxStiffness& one : max_stiffness) {
    if (!one.adaptive && one.magnetic_coefficient == constant_coefficient) return true;
  }
  return false;
}
// The coefficients that Fig. 6 was measured at, N; the means between 0 and 2 N are only in the picture.
inline constexpr std::array<double, 5> magnetic_coefficients{0.0, 0.5, 1.0, 1.5, 2.0};

// --- Paper 1, Figs. 9 to 12: subject 1 against 5.5 N/mm ---------------------------------------------------
inline constexpr double contact_stiffness = 5500.0;  // N/m, section 4.4
struct ContactVerdict {
  std::string_view figure;
  double magnetic_coefficient;  // N
  bool adaptive;
  bool stable;
  std::string_view words;
};
inline constexpr std::array<ContactVerdict, 4> contact_verdicts{{
    {"9", 0.0, false, false, "large sustained oscillation"},
    {"10", 1.0, false, false, "smaller oscillation, not stable"},
    {"11", 2.0, false, true, "stable"},
    {"12", 0.0, true, true, "stable"},
}};

// --- Paper 1, Tables I and II: six people disturbed by F_I, with a background force F_B --------------------
inline constexpr std::array<double, 4> interference_forces{1.0, 3.0, 5.0, 7.0};  // F_I, N

struct JitterCell {
  double background, interference;  // N
  double amplitude;                 // m, Jit
  double adjustment_time;           // s, AT; a whole number of 15 ms everywhere
};
// Table I, without the cells that the paper did not measure (F_B not below F_I; 1 N and 1 N was).
inline constexpr std::array<JitterCell, 16> table_1{{
    {0, 1, 0.0, 0.0},
    {0, 3, 4.0e-3, 0.075},
    {0, 5, 6.0e-3, 0.120},
    {0, 7, 10.0e-3, 0.195},
    {1, 1, 0.0, 0.0},
    {1, 3, 3.0e-3, 0.060},
    {1, 5, 4.0e-3, 0.090},
    {1, 7, 9.0e-3, 0.165},
    {2, 3, 1.6e-3, 0.045},
    {2, 5, 3.0e-3, 0.120},
    {2, 7, 6.0e-3, 0.105},
    {3, 3, 3.0e-3, 0.060},
    {3, 5, 4.0e-3, 0.090},
    {3, 7, 6.0e-3, 0.090},
    {4, 5, 3.6e-3, 0.075},
    {4, 7, 5.0e-3, 0.090},
}};

struct DeviationCell {
  double background, interference;  // N
  double deviation;                 // m, Dev
};
// Table II. Its layout is damaged in the text that these were taken from; the rows were rebuilt from the
// order of the numbers. The cells are those of Table I.
inline constexpr std::array<DeviationCell, 16> table_2{{
    {0, 1, 0.0},
    {0, 3, 1.40e-3},
    {0, 5, 9.4e-3},
    {0, 7, 16.6e-3},
    {1, 1, 0.0},
    {1, 3, 1.02e-3},
    {1, 5, 7.6e-3},
    {1, 7, 15.0e-3},
    {2, 3, 0.86e-3},
    {2, 5, 4.4e-3},
    {2, 7, 11.0e-3},
    {3, 3, 0.68e-3},
    {3, 5, 3.6e-3},
    {3, 7, 9.2e-3},
    {4, 5, 2.4e-3},
    {4, 7, 7.8e-3},
}};
inline constexpr int pulses = 5;  // with and without F_B, section 2.2.2 and Fig. 3

// Nothing for a pair of forces that was not measured.
constexpr std::optional<JitterCell> jitter(double background, double interference) {
  for (const JitterCell& cell : table_1)
    if (cell.background == background && cell.interference == interference) return cell;
  return std::nullopt;
}
constexpr std::optional<DeviationCell> deviation(double background, double interference) {
  for (const DeviationCell& cell : table_2)
    if (cell.background == background && cell.interference == interference) return cell;
  return std::nullopt;
}

// --- Paper 2, section 3: position resolution ---------------------------------------------------------------
inline constexpr double resolution_stiffness = 1200.0;  // N/m, Figures 1 and 2
struct ResolutionVerdict {
  double resolution;  // m, eta
  bool stable;
  std::string_view source;
};
inline constexpr std::array<ResolutionVerdict, 2> resolution_verdicts{{
    {0.1e-3, true, "Figure 1"},
    {0.4e-3, false, "Figure 2"},
}};
// "Vibration occurs when operating speed exceeds" it; the paper does not say at which resolution. Read as
// that of Figure 1, since at that of Figure 2 the wall vibrates anyway.
inline constexpr double vibration_onset_speed = 0.1;  // m/s
// The device, a Phantom Desktop; from its data sheet, not from the paper.
inline constexpr double desktop_resolution = 0.023e-3;  // m

}  // namespace kmax::experiment::paper
