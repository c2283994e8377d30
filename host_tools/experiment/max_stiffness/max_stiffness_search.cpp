#include "host_tools/experiment/max_stiffness/max_stiffness_search.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <memory>
#include <stdexcept>

namespace kmax::experiment {
namespace {

void require(const TouchProtocol& protocol) {
  if (protocol.touches() == 0)
    throw std::invalid_argument("no touch: name at least one approach speed, one push force and one phase");
  if (!(protocol.threshold > 0.0 && protocol.force_threshold >= 0.0))
    throw std::invalid_argument(fmt::format(
        "thresholds of {} m and {} N peak to peak: allowed are above 0, and 0 (not used) or above",
        protocol.threshold, protocol.force_threshold));
}

void require_shared_touches(std::span<const TouchProtocol> protocols) {
  std::size_t phases = 1;
  for (const TouchProtocol& protocol : protocols) phases = std::max(phases, protocol.phases);
  for (const TouchProtocol& protocol : protocols) {
    if (protocol.approach_speeds != protocols.front().approach_speeds ||
        protocol.pushes != protocols.front().pushes || (protocol.phases != 1 && protocol.phases != phases))
      throw std::invalid_argument(
          fmt::format("protocols that are searched at once: allowed are equal speeds and pushes, and phases "
                      "of 1 or of the largest number, {}; one has {}",
                      phases, protocol.phases));
  }
}

/// How far one protocol has come.
struct Search {
  const TouchProtocol& protocol;
  StiffnessClimb climb;
  MaxStiffness result{};
  // At the present stiffness.
  double saturated = 0.0;
  bool touched = false, unstable = false;
};

/// Every touch of the protocols at one stiffness, of each up to the first one that is unstable by it.
class TouchesOfStiffness {
 public:
  explicit TouchesOfStiffness(const TouchSetup& setup)
      : touch_(setup), period_(1.0 / setup.wall.tick_rate), start_position_(setup.motion.start_position) {
    if (!touch_.matrices)
      touch_.matrices =
          std::make_shared<simulation::PropagatorTable>(setup.device, setup.person, study_gain_bits);
  }

  /// Each search goes on from what it found at this stiffness, which all of them were to touch next.
  void touch(double stiffness, std::span<Search* const> searches) {
    touch_.wall.wall.stiffness = static_cast<float>(stiffness);
    std::size_t phases = 1;
    for (Search* search : searches) {
      search->saturated = 0.0;
      search->touched = search->unstable = false;
      phases = std::max(phases, search->protocol.phases);
    }
    const TouchProtocol& any = searches.front()->protocol;
    for (const double speed : any.approach_speeds) {
      for (const double push : any.pushes) {
        for (std::size_t phase = 0; phase < phases; ++phase) {
          begin_from(speed, static_cast<double>(phase) / static_cast<double>(phases));
          touch_.motion.push_force = push;
          judge(searches, phase);
        }
      }
    }
    for (Search* search : searches) {
      search->result.never_touched = !search->touched;
      if (!search->touched) {
        search->climb.give_up();
        continue;
      }
      search->climb.record(!search->unstable);
      if (!search->unstable) search->result.saturated_share = search->saturated;
    }
  }

 private:
  /// Further out by a share of a sample's way.
  void begin_from(double speed, double share) {
    touch_.motion.approach_speed = speed;
    touch_.motion.start_position = start_position_ + touch_.motion.wall_side * share * speed * period_;
  }

  void judge(std::span<Search* const> searches, std::size_t phase) {
    asking_.clear();
    judgements_.clear();
    for (Search* search : searches) {
      if (search->unstable || phase >= search->protocol.phases) continue;
      asking_.push_back(search);
      judgements_.push_back(search->protocol.judgement());
    }
    if (asking_.empty()) return;
    const std::vector<TouchOutcome> outcomes = judge_touch(touch_, judgements_);
    for (std::size_t n = 0; n < asking_.size(); ++n) take(outcomes[n], *asking_[n]);
  }

  void take(const TouchOutcome& outcome, Search& search) const {
    MaxStiffness& result = search.result;
    ++result.touches;
    result.simulated_time += static_cast<double>(outcome.samples) * period_;
    result.event_limit_hits += outcome.event_limit_hits;
    search.saturated = std::max(search.saturated, outcome.saturated_share);
    search.touched = search.touched || outcome.verdict != simulation::ContactVerdict::no_contact;
    search.unstable = !outcome.held();
    if (!search.unstable) return;
    result.ending_speed = touch_.motion.approach_speed;
    result.ending_push = touch_.motion.push_force;
    result.ending_peak_to_peak = outcome.peak_to_peak;
  }

  TouchSetup touch_;
  double period_, start_position_;
  std::vector<Search*> asking_;
  std::vector<TouchJudgement> judgements_;
};

}  // namespace

MaxStiffness search_max_stiffness(const TouchSetup& setup, const TouchProtocol& protocol,
                                  const StiffnessSteps& steps) {
  return search_max_stiffness_by_each(setup, std::span(&protocol, 1), steps).front();
}

std::vector<MaxStiffness> search_max_stiffness_by_each(const TouchSetup& setup,
                                                       std::span<const TouchProtocol> protocols,
                                                       const StiffnessSteps& steps) {
  for (const TouchProtocol& protocol : protocols) require(protocol);
  require_shared_touches(protocols);
  const StiffnessClimb climb(steps, control::follows_velocity(setup.wall.wall.kind));
  std::vector<Search> searches;
  for (const TouchProtocol& protocol : protocols) searches.push_back({protocol, climb});
  TouchesOfStiffness touches(setup);
  for (Search& search : searches) {
    while (const auto stiffness = search.climb.next()) {
      // Those that have come as far share its touches.
      std::vector<Search*> together;
      for (Search& other : searches)
        if (other.climb.next() == stiffness) together.push_back(&other);
      touches.touch(*stiffness, together);
    }
  }
  std::vector<MaxStiffness> results;
  for (Search& search : searches) {
    search.result.stiffness = search.climb.result();
    search.result.beyond_last = search.climb.beyond_last();
    results.push_back(search.result);
  }
  return results;
}

}  // namespace kmax::experiment
