#pragma once
// Figs. 9 to 12 of paper 1 on simulated people: one stiffness, 5.5 N/mm, held under every law. Nothing is
// fitted to it. The paper shows one person, its subject 1, about whom it says nothing; here are everybody of
// the set and the person of the supplied scenes.

#include "host_tools/experiment/max_stiffness/max_stiffness_study.hpp"

namespace kmax::experiment {

struct HeldWall {
  std::size_t touches = 0;
  std::size_t unstable = 0;  // of them
  double worst = 0.0;        // m peak to peak, in the touch that moved most
  bool stable() const { return unstable == 0; }
};

struct HeldWallResult {
  StiffnessCondition condition;
  std::string figure;  // of paper 1
  bool paper_stable = false;
  std::vector<HeldWall> people;  // in the order of the set
  HeldWall named;                // the person of the supplied scenes, with the set's gamma
  std::size_t stable_people() const;
  double median_worst() const;  // m
};

inline constexpr std::string_view named_person = "subject 1";

// F_MC = 0, 1 and 2 N and the adaptive wall in each mode, all touches of the run's protocol. Not journaled:
// it takes a second.
std::vector<HeldWallResult> run_held_walls(const SubjectSet& set, double stiffness, const StiffnessRun& run);

}  // namespace kmax::experiment
