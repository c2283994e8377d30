#include "host_tools/experiment/design/family_search.hpp"

#include <algorithm>
#include <cmath>

namespace kmax::experiment {
namespace {

/// A quarter below the bound: the best damping may lie between two that are tried first.
constexpr int quarter_below = 29;
/// Into which a step of damping_ratio is parted: 4.4 %.
constexpr int fine_steps = 8;

class FamilySearch {
 public:
  FamilySearch(const DesignTask& task, const WallFamily& family, std::vector<std::size_t> hard)
      : task_(task), family_(family), trials_(task), hard_(std::move(hard)) {
    if (!hard_.empty()) return;
    // The quickest and hardest touch of each.
    const std::size_t each = task.protocol.touches();
    for (std::size_t person = 0; person < task.set.subjects.size(); ++person)
      hard_.push_back((person + 1) * each - 1);
  }

  FamilyResult run(int bound) {
    best_.rung = bound;
    double centre = 0.0;
    try_all(centre);
    if (found_ || may_be_less_deep()) try_finer(found_ ? best_.damping : centre);
    if (!found_) best_.rung = -1;
    best_.hard = hard_;
    best_.touches = trials_.touches();
    best_.event_limit_hits = trials_.event_limit_hits();
    return best_;
  }

  /// The highest rung from `least` to `most` that holds for the hard touches; least - 1 if none.
  int highest(double damping, int least, int most) {
    if (least > most || !holds(damping, least)) return least - 1;
    int low = least, step = 16;
    while (low + step <= most && holds(damping, low + step)) {
      low += step;
      step *= 2;
    }
    int high = std::min(low + step, most + 1);
    while (high - low > 1) {
      const int middle = low + (high - low) / 2;
      (holds(damping, middle) ? low : high) = middle;
    }
    return low;
  }

 private:
  /// A damping between two that were tried may let nobody too deep in, where neither does; not where both let
  /// somebody in to twice the depth: they are a factor of damping_ratio apart.
  bool may_be_less_deep() const { return !task_.depth || !(best_.least_depth > 2.0 * *task_.depth); }

  void try_finer(double centre) {
    const double ratio = std::pow(damping_ratio, 1.0 / fine_steps);
    for (const double damping : finer_dampings(centre, ratio)) try_damping(damping);
    for (const double part : {0.5, 0.25})
      for (const double factor : {std::pow(ratio, -part), std::pow(ratio, part)})
        try_damping(best_.damping * factor);
  }

  /// Over the whole range and a quarter of the least that was tried, the nearest to `centre` first: a better
  /// one makes those that follow cheaper.
  std::vector<double> finer_dampings(double centre, double ratio) const {
    const std::vector<double> coarse = dampings_of(task_);
    const double least = coarse[1] / 4.0;
    std::vector<double> dampings;
    for (double damping = least; damping <= coarse.back(); damping *= ratio) dampings.push_back(damping);
    const auto distance = [&](double damping) {
      return std::abs(std::log(damping / std::max(centre, least)));
    };
    std::ranges::stable_sort(dampings, {}, distance);
    return dampings;
  }

  void try_damping(double damping) { improve(damping, highest(damping, best_.rung + 1, top_rung)); }

  DesignedWall wall_at(double damping, int rung) const { return {family_, damping, stiffness_of(rung)}; }
  bool holds(double damping, int rung) { return !trials_.first_not_held(wall_at(damping, rung), hard_); }

  /// Every damping against the hard touches, then the best ones against everybody. `centre`: the best of the
  /// first, which need not be above the bound.
  void try_all(double& centre) {
    const int least = std::max(0, best_.rung - quarter_below);
    std::vector<TriedDamping> order;
    for (const double damping : dampings_of(task_))
      if (const int rung = highest(damping, least, top_rung); rung >= least) order.push_back({damping, rung});
    std::stable_sort(order.begin(), order.end(),
                     [](const auto& one, const auto& other) { return one.rung > other.rung; });
    if (!order.empty()) centre = order.front().damping;
    for (const TriedDamping& one : order)
      if (one.rung > best_.rung) improve(one.damping, highest(one.damping, best_.rung + 1, one.rung));
  }

  /// Takes a damping that holds up to `rung` for the hard touches as the best, if it is for everybody.
  void improve(double damping, int rung) {
    while (rung > best_.rung) {
      if (const auto ending = trials_.first_not_held(wall_at(damping, rung))) {
        hard_.insert(hard_.begin(), ending->number);
        rung = highest(damping, best_.rung + 1, rung - 1);
      } else if (!allowed(damping, rung)) {
        return;  // a softer one is no less deep
      } else if (const int below = highest_below(damping, rung); below < rung) {
        rung = below;
      } else {
        found_ = true;
        best_.rung = rung;
        best_.damping = damping;
      }
    }
  }

  /// The highest rung up to `rung` below which all hold: a wall may be unstable in between, and what holds
  /// beyond must not hide a better damping. By the hard touches first: whoever finds that a wall does not is
  /// one of them from there on.
  int highest_below(double damping, int rung) {
    const std::vector<int> rungs = rungs_below(rung);
    for (const int lower : rungs)
      if (!holds(damping, lower)) return lower - 1;
    for (const int lower : rungs) {
      if (const auto ending = trials_.first_not_held(wall_at(damping, lower))) {
        hard_.insert(hard_.begin(), ending->number);
        return lower - 1;
      }
    }
    return rung;
  }

  /// Of a wall that everybody has just touched.
  bool allowed(double damping, int rung) {
    // What nobody gets to is no wall: a field may hold the hand off.
    if (!trials_.everybody_touched()) return false;
    if (!task_.depth) return true;
    const double depth = trials_.deepest({family_, damping, stiffness_with_margin(task_, rung)}).depth;
    if (depth <= *task_.depth) return true;
    best_.least_depth = best_.least_depth > 0.0 ? std::min(best_.least_depth, depth) : depth;
    return false;
  }

  const DesignTask& task_;
  const WallFamily& family_;
  WallTrials trials_;
  std::vector<std::size_t> hard_;
  FamilyResult best_;
  bool found_ = false;
};

}  // namespace

std::vector<int> rungs_below(int rung) {
  constexpr int half = 70, tenth = 231;  // rungs that a half and a tenth are below
  std::vector<int> rungs;
  for (int n = std::max(0, rung - tenth); n < rung - half; n += 16) rungs.push_back(n);
  for (int n = std::max(rung % 2, rung - half); n < rung; n += 2) rungs.push_back(n);
  return rungs;
}

FamilyResult search_family(const DesignTask& task, const WallFamily& family, int bound,
                           std::vector<std::size_t> hard) {
  return FamilySearch(task, family, std::move(hard)).run(bound);
}

std::vector<TriedDamping> stiffness_over_damping(const DesignTask& task, const WallFamily& family,
                                                 const std::vector<double>& dampings,
                                                 std::vector<std::size_t> hard) {
  FamilySearch search(task, family, std::move(hard));
  std::vector<TriedDamping> found;
  for (const double damping : dampings) found.push_back({damping, search.highest(damping, 0, top_rung)});
  return found;
}

double stiffness_with_margin(const DesignTask& task, int rung) {
  const double stiffness = (1.0 - task.margin) * stiffness_of(rung);
  const double unit = std::pow(10.0, std::floor(std::log10(stiffness)) - 2.0);
  return std::floor(stiffness / unit * (1.0 + 1e-12)) * unit;
}

}  // namespace kmax::experiment
