#pragma once
// The stiffest wall of one family that holds for everybody.
//
// A wall holds when none of the task's touches is unstable by either criterion; the smallest of the people
// decides. Few touches are enough to see that a wall does not hold, so each is first touched by those that
// ended others before it, hardest first, and is dropped at the first that is unstable at the stiffness which
// would make it the best so far (branch and bound). Only what survives is touched by everybody; whatever ends
// it then is one of the hard touches from there on. Damping is tried in ratios of the square root of 2, then
// in ratios of 1.044 over the whole range: most of these are dropped at their first touch. A search around
// the best one alone stayed 4 % behind a grid, since stiffness over damping has several peaks.
//
// For one wall of the family the stiffness is found by doubling steps and by halving, which takes for granted
// that a wall which holds also holds when it is softer. One that would be the best so far is therefore
// touched by everybody at rungs_below() as well.

#include <optional>
#include <vector>

#include "host_tools/experiment/design/wall_trials.hpp"

namespace kmax::experiment {

/// At which a wall of this rung has to hold too: each second one down to half of its stiffness, each
/// sixteenth from there to a tenth.
std::vector<int> rungs_below(int rung);

struct FamilyResult {
  int rung = -1;                  ///< highest one that holds for everybody; -1: none above the bound
  double damping = 0.0;           ///< N s/m
  std::vector<std::size_t> hard;  ///< touches that ended walls, hardest first
  std::uint64_t touches = 0;
  std::uint64_t event_limit_hits = 0;
  double least_depth = 0.0;  ///< m, of walls that were let go because somebody got too deep; 0: none was
};

/// `bound`: a rung above which a result is wanted, -1: any. `hard`: touches to begin with; none: one of each
/// person. The same arguments give the same result.
FamilyResult search_family(const DesignTask& task, const WallFamily& family, int bound,
                           std::vector<std::size_t> hard);

struct TriedDamping {
  double damping = 0.0;  ///< N s/m
  int rung = -1;
};
/// For each damping the highest rung that holds for the touches `hard` alone, -1 for none: an upper bound.
std::vector<TriedDamping> stiffness_over_damping(const DesignTask& task, const WallFamily& family,
                                                 const std::vector<double>& dampings,
                                                 std::vector<std::size_t> hard);

/// The stiffness that is left of a rung when the margin is taken off, rounded down to three digits, N/m.
double stiffness_with_margin(const DesignTask& task, int rung);

}  // namespace kmax::experiment
