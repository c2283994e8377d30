#pragma once
// An independent audit wrote a second simulator (a person, a controller and a judge of its own) and printed
// what it found; its code is not at hand. Here its numbers stand beside ours, and laws whose numbers differ
// are read in other ways, one change after the other, to see which of them makes the difference.

#include <array>
#include <string>
#include <string_view>
#include <vector>

#include "tests/studies/studies.hpp"

namespace kmax::studies {

/// One row of the audit's table: 500 Hz, 55 um, the people and the device of our sets. N/m.
struct AuditedLaw {
  std::string_view audit, ours;  ///< what it says, and the name in law_baselines()
  double moves, feels;           ///< force clipped at 3.3 N: by the position, by 1 N
  double unclipped;              ///< by the position; 0: not printed
};
inline constexpr std::array<AuditedLaw, 13> audited_laws{{
    {"plain", "plain", 3570.0, 3570.0, 3480.0},
    {"magnetic 2 N (paper 1)", "field of 2 N", 8440.0, 8410.0, 8480.0},
    {"adaptive as printed", "adaptive, instant", 4900.0, 4900.0, 5930.0},
    {"damper 8 N s/m, difference", "damping 8 N s/m, difference", 9630.0, 9060.0, 9540.0},
    {"damper 12", "damping 12 N s/m, difference", 10200.0, 6340.0, 10230.0},
    {"passivity controller (Hannaford, Ryu), alpha <= 15", "passivity controller, alpha <= 15 N s/m", 6210.0,
     3650.0, 5950.0},
    {"the same against stored 1/2 K d^2", "passivity controller against the spring's energy", 9470.0, 3660.0,
     8680.0},
    {"stiffness that grows while calm (from 2 N/mm, 0.2 s)", "grows from 2 N/mm in 0.2 s", 10970.0, 9720.0,
     10890.0},
    {"the same from 3 N/mm with damper 6", "grows from 3 N/mm in 0.2 s, damping 6 N s/m", 10440.0, 9670.0,
     10350.0},
    {"adaptive, slope 10, difference", "adaptive, V_max = 0.24 m/s, difference", 9380.0, 8600.0, 10120.0},
    {"magnetic 2 N, x_0 = 5 mm", "field of 2 N, x_0 = 5 mm", 10110.0, 10090.0, 0.0},
    {"magnetic 2 N + damper 8", "field of 2 N, damping 8 N s/m, difference", 12920.0, 10850.0, 0.0},
    {"magnetic 2 N + stored-energy controller", "field of 2 N, against the spring's energy", 14950.0, 5130.0,
     0.0},
}};

/// A passivity controller as it may be meant.
struct PassivityReading {
  double most = 15.0;         ///< N s/m
  bool keeps_spring = false;  ///< against the energy of a spring that is as deep
  bool present_force =
      false;            ///< the interval's work by the force at its end, instead of the one held over it
  bool clipped = true;  ///< by what the device gave, else by what the wall asked for
  bool forgets = true;  ///< what was given, outside
  bool pulls = true;    ///< the wall may pull the handle in, where the damper is stronger than the spring
  bool own_account = false;  ///< of the damper alpha v^2 T, instead of its force over the interval it is held
  bool counts_field = false;  ///< the work of the field too
  double smoothing = 0.0;     ///< s, low pass of the velocity that is damped by
};
WallChange passivity_read(const PassivityReading& reading);

/// A wall that grows while calm as it may be meant.
struct GrowthReading {
  double touch_stiffness = 2000.0, growth_time = 0.2, damping = 0.0;  ///< N/m, s, N s/m
  double calm = 0.01;                                                 ///< m/s
  double falls = 4.0;      ///< so much faster than it grows while not calm; 0: it keeps what it has
  bool by_itself = false;  ///< by a share of what it is, e-fold in growth_time, else of what is missing
  control::VelocityEstimatorKind calm_by = control::VelocityEstimatorKind::foaw;
};
/// Nobody asks what it comes to: it counts as held wherever it is stable.
WallChange growth_read(const GrowthReading& reading);

/// A damper over one sample which the wall may pull the handle in with: the firmware's does not.
WallChange pulling_damper(double damping);

/// One of our laws with one thing read differently.
struct LawReading {
  std::string law, what;  ///< as law_baselines() names it, and what is changed
  WallChange wall;
};
std::vector<LawReading> law_readings();

struct AuditRow {
  AuditedLaw law;
  PeopleMean moves{}, feels{}, unclipped{};
  double least = 0.0, most = 0.0;  ///< N/m, by the position, when the touches begin elsewhere
  bool within_noise() const;
};
struct ReadResult {
  LawReading reading;
  PeopleMean moves{}, feels{};
};
struct AuditComparison {
  std::vector<AuditRow> rows;
  std::vector<ReadResult> readings;
};
/// `clipped` and `unclipped`: what run_baselines() gives of law_baselines() on each set.
AuditComparison compare_with_audit(const SubjectSet& set, const std::vector<BaselineResult>& clipped,
                                   const std::vector<BaselineResult>& unclipped, const StiffnessRun& run);
report::Section audit_section(const AuditComparison& comparison);

}  // namespace kmax::studies
