#pragma once
// The stiffest wall for a device that holds for all simulated people, what bounds it, what it costs, and what
// would buy more.
//
// First each family is searched (family_search.hpp), the undamped-by-default one before the others, which
// must beat it; and the same with what might buy more. These searches are jobs of their own: they may be
// shared out to several runs, each of which keeps its share in a journal. The best wall is then verified as
// no search does it, from a tenth of its stiffness upwards by all touches of all people; where it does not
// hold, a softer one or the next family takes its place. With the margin taken off, every touch is made in
// four phases as well. Results do not depend on threads or shares.

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "host_tools/device/value_text.hpp"
#include "host_tools/experiment/design/family_search.hpp"
#include "host_tools/experiment/design/wall_trials.hpp"
#include "host_tools/experiment/progress_report.hpp"
#include "host_tools/experiment/run_journal.hpp"
#include "host_tools/experiment/touch_price.hpp"

namespace kmax::experiment {

struct DesignRun {
  std::size_t threads = 0;  ///< 0: default_jobs()
  ProgressReport progress{};
};

/// All that results depend on, for a journal.
RunJournal::Json design_settings(const DesignTask& task);

/// The k-th of n shares of the searches, 1 to n: put into the journal, those that are in it already left out.
struct Share {
  std::size_t part = 1, of = 1;
};
void search_share(const DesignTask& task, const Share& share, RunJournal& journal, const DesignRun& run);

/// The touch that ends the next stiffer wall.
struct DesignBound {
  TouchCase touch;
  EndingTouch ending;
  double stiffness = 0.0;  ///< N/m, of the wall that it ends
};

/// What changes of the task, and what that buys.
struct DesignChange {
  std::string name;
  std::optional<double> gain;  ///< share of the largest stiffness; none: there is nothing to change
};

struct WallDesign {
  bool found = false;    ///< if not, nothing below has a meaning but least_depth and what is counted
  DesignedWall wall;     ///< with the margin taken off
  double largest = 0.0;  ///< N/m: the stiffest of this family and damping that holds for everybody
  std::optional<DesignBound> bound;  ///< none: it holds up to the most that there is
  TouchPrice price;   ///< of the wall, 0.2 m/s and 1 N, mean of the people; but depth: deepest of all touches
  TouchCase deepest;  ///< the touch of price.depth
  std::vector<DesignChange> changes;
  std::vector<std::size_t> hard;  ///< touches that ended walls, hardest first
  double least_depth = 0.0;       ///< m, family_search.hpp
  std::uint64_t touches = 0;      ///< made in all: for the wall, and for the changes
  std::uint64_t changes_touches = 0;
  std::uint64_t event_limit_hits = 0;
};

/// `known`: journals of shares, whose searches are taken over; the others are made. `with_changes`: also what
/// would buy more. Throws std::invalid_argument.
WallDesign design_wall(const DesignTask& task, const DesignRun& run, bool with_changes = true,
                       std::span<const RunJournal* const> known = {});
/// JournalError naming the first search that none of the journals has.
void require_whole(const DesignTask& task, std::span<const RunJournal* const> known);

/// The wall as the firmware's parameters of axis 0.
std::vector<device::Assignment> parameters_of(const DesignTask& task, const DesignedWall& wall);

}  // namespace kmax::experiment
