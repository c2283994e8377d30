#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "host_tools/experiment/design/design_task.hpp"

namespace kmax::experiment {

/// What ended a wall.
struct EndingTouch {
  std::size_t number = 0;       ///< case_of()
  bool by_force = false;        ///< else by the position
  double peak_to_peak = 0.0;    ///< N or m
  double rendered_share = 1.0;  ///< TouchOutcome's
  bool softer = false;          ///< nothing oscillates, but the wall grew to too small a share
};

/// Touches of walls by the people of one task, counted, with the tables of each person kept from touch to
/// touch. Not for several threads at once.
class WallTrials {
 public:
  explicit WallTrials(const DesignTask& task);

  /// One touch. `phase`: the share of a sample's way that it begins further out.
  TouchOutcome touch(const DesignedWall& wall, std::size_t number, double phase = 0.0);

  /// Goes through the touches `numbers` up to the first that is not held, which moves to the front: what has
  /// ended one wall is likely to end the next.
  std::optional<EndingTouch> first_not_held(const DesignedWall& wall, std::vector<std::size_t>& numbers);
  /// Through all touches of all people.
  std::optional<EndingTouch> first_not_held(const DesignedWall& wall);
  /// Did everybody get into the wall in one of the touches that the last call of first_not_held() made?
  bool everybody_touched() const;

  /// m, deepest of all touches of all people, and its touch.
  struct Deepest {
    double depth = 0.0;
    std::size_t number = 0;
  };
  Deepest deepest(const DesignedWall& wall);

  std::uint64_t touches() const { return touches_; }
  std::uint64_t event_limit_hits() const { return event_limit_hits_; }

 private:
  const DesignTask& task_;
  std::vector<std::shared_ptr<simulation::PropagatorTable>> tables_;
  std::vector<char> touched_;
  std::uint64_t touches_ = 0, event_limit_hits_ = 0;
};

}  // namespace kmax::experiment
