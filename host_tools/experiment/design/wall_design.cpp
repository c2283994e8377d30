#include "host_tools/experiment/design/wall_design.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <numeric>
#include <utility>

#include "host_tools/experiment/job_pool.hpp"
#include "host_tools/experiment/report_words.hpp"

namespace kmax::experiment {
namespace {

constexpr auto result_fields = [](auto& result, const auto& field) {
  field("rung", result.rung);
  field("damping_n_s_per_m", result.damping);
  field("hard", result.hard);
  field("touches", result.touches);
  field("event_limit_hits", result.event_limit_hits);
  field("least_depth_m", result.least_depth);
};

/// The task, or the task with something that might buy more.
struct Variant {
  std::string name;
  DesignTask task;
};

std::vector<Variant> variants_of(const DesignTask& task, bool with_changes) {
  std::vector<Variant> variants{{"as given", task}};
  if (!with_changes) return variants;
  variants.push_back({"encoder ten times finer", task});
  variants.back().task.count_length /= 10.0;
  variants.push_back({"rate doubled", task});
  variants.back().task.rate *= 2.0;
  if (task.set.device.delay > 0.0) {
    variants.push_back({"no delay", task});
    variants.back().task.set.device.delay = 0.0;
  }
  return variants;
}

struct FamilyJob {
  const Variant* variant;
  std::size_t family;
  std::string key;
};

std::string key_of(const Variant& variant, const WallFamily& family) {
  return fmt::format("{}: {}", variant.name, name_of(family));
}

/// The first families of all variants; then all others, the variants' in turn, so that shares are alike.
std::pair<std::vector<FamilyJob>, std::vector<FamilyJob>> jobs_of(const std::vector<Variant>& variants) {
  std::pair<std::vector<FamilyJob>, std::vector<FamilyJob>> jobs;
  for (const Variant& variant : variants) {
    const auto families = families_of(variant.task);
    for (std::size_t n = 0; n < families.size(); ++n)
      (n == 0 ? jobs.first : jobs.second).push_back({&variant, n, key_of(variant, families[n])});
  }
  return jobs;
}

/// The searches by their keys, from journals or made.
class Searches {
 public:
  Searches(std::span<const RunJournal* const> known, RunJournal* journal, const DesignRun& run)
      : known_(known), journal_(journal), run_(run) {}

  void make(const std::vector<FamilyJob>& jobs) {
    std::vector<const FamilyJob*> open;
    for (const FamilyJob& job : jobs)
      if (!take_known(job.key)) open.push_back(&job);
    auto results = collect_jobs<FamilyResult>(
        open.size(), run_.threads, [&](std::size_t n) { return search(*open[n]); }, run_.progress);
    for (std::size_t n = 0; n < open.size(); ++n) done_[open[n]->key] = std::move(results[n]);
  }

  const FamilyResult& of(const Variant& variant, const WallFamily& family) const {
    return done_.at(key_of(variant, family));
  }

 private:
  bool take_known(const std::string& key) {
    const RunJournal::Json* found = journal_ != nullptr ? journal_->find(key) : nullptr;
    for (const RunJournal* journal : known_) found = found == nullptr ? journal->find(key) : found;
    if (found == nullptr) return false;
    read_fields(*found, done_[key], result_fields);
    return true;
  }

  FamilyResult search(const FamilyJob& job) const {
    const DesignTask& task = job.variant->task;
    const auto families = families_of(task);
    // Whoever must beat the first family begins with what ended it.
    const FamilyResult* first = job.family > 0 ? &of(*job.variant, families.front()) : nullptr;
    FamilyResult result = search_family(task, families[job.family], first != nullptr ? first->rung : -1,
                                        first != nullptr ? first->hard : std::vector<std::size_t>());
    if (journal_ != nullptr) {
      RunJournal::Json json;
      write_fields(json, result, result_fields);
      journal_->add(job.key, json);
    }
    return result;
  }

  std::span<const RunJournal* const> known_;
  RunJournal* journal_;
  const DesignRun& run_;
  std::map<std::string, FamilyResult> done_;
};

struct Candidate {
  WallFamily family;
  FamilyResult result;
};

/// Those with a wall, the stiffest first; counts into `design`.
std::vector<Candidate> candidates_of(const Variant& variant, const Searches& searches, WallDesign& design) {
  std::vector<Candidate> candidates;
  for (const WallFamily& family : families_of(variant.task)) {
    const FamilyResult& result = searches.of(variant, family);
    design.touches += result.touches;
    design.event_limit_hits += result.event_limit_hits;
    if (result.least_depth > 0.0)
      design.least_depth =
          design.least_depth > 0.0 ? std::min(design.least_depth, result.least_depth) : result.least_depth;
    if (result.rung >= 0) candidates.push_back({family, result});
  }
  std::stable_sort(candidates.begin(), candidates.end(), [](const Candidate& one, const Candidate& other) {
    return one.result.rung > other.result.rung;
  });
  return candidates;
}

std::vector<std::size_t> touches_by(const DesignTask& task, std::size_t person) {
  std::vector<std::size_t> numbers(task.protocol.touches());
  std::iota(numbers.begin(), numbers.end(), person * numbers.size());
  return numbers;
}

void count(const WallTrials& trials, WallDesign& design) {
  design.touches += trials.touches();
  design.event_limit_hits += trials.event_limit_hits();
}

/// What each person's trials give, with a table of their own; counted.
template <typename Result, typename Make>
std::vector<Result> by_each_person(const DesignTask& task, const DesignRun& run, WallDesign& design,
                                   const Make& make) {
  struct Counted {
    Result result{};
    std::uint64_t touches = 0, event_limit_hits = 0;
  };
  const auto counted = collect_jobs<Counted>(
      task.set.subjects.size(), run.threads,
      [&](std::size_t person) {
        WallTrials trials(task);
        Result result = make(trials, person);
        return Counted{std::move(result), trials.touches(), trials.event_limit_hits()};
      },
      run.progress);
  std::vector<Result> results;
  for (const Counted& one : counted) {
    results.push_back(one.result);
    design.touches += one.touches;
    design.event_limit_hits += one.event_limit_hits;
  }
  return results;
}

/// Does every touch hold, begun at each quarter of a sample's way?
bool holds_in_four_phases(const DesignTask& task, const DesignedWall& wall, const DesignRun& run,
                          WallDesign& design) {
  const auto held = by_each_person<int>(task, run, design, [&](WallTrials& trials, std::size_t person) {
    for (const std::size_t number : touches_by(task, person))
      for (const double phase : {0.0, 0.25, 0.5, 0.75})
        if (!trials.touch(wall, number, phase).held()) return 0;
    return 1;
  });
  return std::all_of(held.begin(), held.end(), [](int one) { return one == 1; });
}

void tell_bound(const DesignTask& task, int rung, WallDesign& design) {
  if (rung >= top_rung) return;
  WallTrials trials(task);
  DesignedWall next = design.wall;
  // By everybody only each second rung was tried.
  for (int above = rung + 1; above <= std::min(rung + 16, top_rung); ++above) {
    next.stiffness = stiffness_of(above);
    if (const auto ending = trials.first_not_held(next)) {
      design.bound = {case_of(task, ending->number), *ending, next.stiffness};
      break;
    }
  }
  count(trials, design);
}

void tell_price(const DesignTask& task, WallDesign& design) {
  const auto people = static_cast<double>(task.set.subjects.size());
  for (std::size_t person = 0; person < task.set.subjects.size(); ++person) {
    const TouchPrice paid = price_of(touch_of(task, design.wall, {person, 0.2, 1.0}));
    design.price.field_at_rest += paid.field_at_rest / people;
    design.price.work += paid.work / people;
    design.price.rate_hardness += paid.rate_hardness / people;
    ++design.touches;
  }
  WallTrials trials(task);
  const WallTrials::Deepest deepest = trials.deepest(design.wall);
  design.price.depth = deepest.depth;
  design.deepest = case_of(task, deepest.number);
  count(trials, design);
}

}  // namespace

RunJournal::Json design_settings(const DesignTask& task) {
  return {{"people_and_device", subject_set_text(task.set)},
          {"rate_hz", task.rate},
          {"count_length_m", task.count_length},
          {"approach_speeds_m_per_s", task.protocol.approach_speeds},
          {"pushes_n", task.protocol.pushes},
          {"moves_m", task.protocol.threshold},
          {"feels_n", task.protocol.force_threshold},
          {"least_rendered_share", TouchSetup().least_rendered_share},
          {"field_n", task.field},
          {"growth_time_s", task.growth_time},
          {"depth_m", task.depth ? RunJournal::Json(*task.depth) : RunJournal::Json(nullptr)},
          {"margin", task.margin}};
}

void search_share(const DesignTask& task, const Share& share, RunJournal& journal, const DesignRun& run) {
  validate(task);
  const auto variants = variants_of(task, true);
  const auto [first, others] = jobs_of(variants);
  Searches searches({}, &journal, run);
  searches.make(first);
  std::vector<FamilyJob> mine;
  for (std::size_t n = share.part - 1; n < others.size(); n += share.of) mine.push_back(others[n]);
  searches.make(mine);
}

void require_whole(const DesignTask& task, std::span<const RunJournal* const> known) {
  const auto variants = variants_of(task, true);
  const auto [first, others] = jobs_of(variants);
  for (const std::vector<FamilyJob>* jobs : {&first, &others}) {
    for (const FamilyJob& job : *jobs) {
      if (std::none_of(known.begin(), known.end(),
                       [&](const RunJournal* one) { return one->find(job.key) != nullptr; }))
        throw JournalError(
            fmt::format("the search '{}' is in none of the shares: run the share that was not "
                        "finished once more",
                        job.key));
    }
  }
}

WallDesign design_wall(const DesignTask& task, const DesignRun& run, bool with_changes,
                       std::span<const RunJournal* const> known) {
  validate(task);
  const auto variants = variants_of(task, with_changes);
  const auto [first, others] = jobs_of(variants);
  Searches searches(known, nullptr, run);
  searches.make(first);
  searches.make(others);

  WallDesign design;
  const std::vector<Candidate> candidates = candidates_of(variants.front(), searches, design);
  design.found = !candidates.empty();
  if (!design.found) return design;
  const auto& [family, result] = candidates.front();
  design.wall = {family, result.damping, 0.0};
  design.hard = result.hard;
  const int best = result.rung;
  design.largest = stiffness_of(best);
  tell_bound(task, best, design);
  int lowered = best;
  do {
    design.wall.stiffness = stiffness_with_margin(task, lowered);
    lowered -= 2;
  } while (lowered >= 0 && !holds_in_four_phases(task, design.wall, run, design));
  tell_price(task, design);

  for (std::size_t n = 1; n < variants.size(); ++n) {
    WallDesign counted;
    const auto found = candidates_of(variants[n], searches, counted);
    design.changes_touches += counted.touches;
    design.event_limit_hits += counted.event_limit_hits;
    const double stiffness = found.empty() ? 0.0 : stiffness_of(found.front().result.rung);
    design.changes.push_back({variants[n].name, stiffness / design.largest - 1.0});
  }
  if (with_changes && task.set.device.delay == 0.0) design.changes.push_back({"no delay", std::nullopt});
  return design;
}

std::vector<device::Assignment> parameters_of(const DesignTask& task, const DesignedWall& wall) {
  const control::VelocityEstimatorConfig<float>& velocity = wall.family.velocity;
  const bool field = wall.family.coefficient > 0.0;
  std::vector<std::string> texts{fmt::format("wall.law={}", field ? "magnetic" : "plain"),
                                 fmt::format("wall.stiffness={}", static_cast<float>(wall.stiffness)),
                                 fmt::format("wall.damping={}", static_cast<float>(wall.damping)),
                                 fmt::format("velocity.estimator={}", estimator_name(velocity.kind)),
                                 fmt::format("velocity.window={}", velocity.window),
                                 fmt::format("velocity.bandwidth={}", velocity.bandwidth),
                                 fmt::format("haptic.rate={}", static_cast<float>(task.rate))};
  if (wall.family.grows()) {
    const control::HapticLoopConfig<float> loop = touch_of(task, wall, case_of(task, 0)).wall;
    texts.push_back(fmt::format("wall.damping_window={}", loop.damping_window));
    texts.push_back(fmt::format("wall.touch_stiffness={}", loop.wall.growing.touch_stiffness));
    texts.push_back(fmt::format("wall.growth_time={}", loop.wall.growing.growth_time));
    texts.push_back(fmt::format("wall.calm_velocity={}", loop.wall.growing.calm_velocity));
  }
  if (field) {
    texts.push_back(fmt::format("wall.magnetic_coefficient={}", static_cast<float>(wall.family.coefficient)));
    texts.push_back(fmt::format("wall.magnetic_length={}", static_cast<float>(wall.family.length)));
  }
  if (task.set.device.force_limit > 0.0)
    texts.push_back(fmt::format("force.limit={}", static_cast<float>(task.set.device.force_limit)));
  return device::parse_assignments(texts);
}

}  // namespace kmax::experiment
