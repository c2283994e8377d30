#pragma once
// Velocity estimators that were tried instead of FOAW: what each costs, how far it is off, and how stiff a
// damped wall may be with it (docs/velocity_estimators.md). kmax-studies velocity.

#include <array>
#include <string>
#include <vector>

#include "host_tools/experiment/max_stiffness/max_stiffness_study.hpp"
#include "host_tools/report/page.hpp"

namespace kmax::studies {

/// The reference first. `counted`: its line of the instruction budget.
struct VelocityCandidate {
  std::string name, counted;
};
inline const std::array<VelocityCandidate, 6> velocity_candidates{{
    {"FOAW", "alone: FOAW     "},
    {"FOAW of every 2nd sample", "alone: FOAW of every second sample "},
    {"two cones", "alone: two cones "},
    {"interval tracking", "alone: interval tracking "},
    {"edge period, 16", "alone: edge period, 16 samples "},
    {"edge period, 8", "alone: edge period, 8 samples "},
}};
constexpr std::size_t foaw_of_every_second = 1, edge_period = 4;  ///< of 16 intervals, of 16 samples
template <typename Number>
using ByCandidate = std::array<Number, velocity_candidates.size()>;

struct VelocityError {
  double rms = 0.0, worst = 0.0;  ///< m/s
};
struct VelocityCase {
  std::string motion;
  double quantum, rate;  ///< m, Hz
  ByCandidate<VelocityError> errors;
};
/// Slow and fast motions, impacts and rest at an edge; three encoders; 500 Hz, 2 kHz, 20 kHz.
std::vector<VelocityCase> measure_velocity_errors();

std::vector<VelocityCase> at_rate(const std::vector<VelocityCase>& cases, double rate);

/// RMS error over FOAW's: geometric mean over the cases, and the largest.
struct AgainstFoaw {
  double mean = 1.0, largest = 1.0;
};
ByCandidate<AgainstFoaw> against_foaw(const std::vector<VelocityCase>& cases);

/// Of all samples of these motions, the share in which FOAW's window grew by more than one interval: what a
/// search that goes on from the last window would miss.
double share_of_leaps();

struct DampedWall {
  double quantum, rate, damping;  ///< m, Hz, N s/m
  ByCandidate<double> stiffness;  ///< the largest stable one, N/m, by position and force
};
std::vector<DampedWall> run_damped_walls(const simulation::DeviceModel& device,
                                         const experiment::StiffnessRun& run);

/// `counts`: what tests/benchmarks/instruction_budget/instruction_budget.sh printed. Throws
/// std::invalid_argument when a candidate is not in it.
report::Page velocity_page(const std::vector<VelocityCase>& cases, const std::vector<DampedWall>& walls,
                           const std::string& counts);

}  // namespace kmax::studies
