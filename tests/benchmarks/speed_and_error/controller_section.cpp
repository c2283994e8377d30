#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include "host_tools/experiment/max_stiffness/max_stiffness_study.hpp"
#include "tests/benchmarks/speed_and_error/measurement.hpp"
#include "tests/benchmarks/speed_and_error/sections.hpp"

namespace kmax::benchmark {
namespace {

using simulation::IntegratorConfig;
using simulation::IntegratorKind;

constexpr double accuracy = 100.0;  // N/m: one step of the search, and what two simulators can agree on

/// A study of the largest stiffness, on one thread.
struct Study {
  std::vector<std::vector<double>> stiffness;  // N/m, [wall][person]
  double simulated = 0.0, seconds = 0.0;       // of all touches; of processor time
  double speed() const { return simulated / seconds; }
};

Study study_with(const IntegratorConfig& integrator) {
  const experiment::SubjectSet set = experiment::open_subject_set("clipped");
  Study study;
  const double begun = processor_time();
  for (const experiment::StiffnessCondition& condition : experiment::stiffness_conditions()) {
    study.stiffness.emplace_back();
    for (const experiment::Subject& subject : set.subjects) {
      experiment::TouchSetup setup = experiment::touch_setup(set.device, subject.person, condition);
      setup.integrator = integrator;
      const experiment::MaxStiffness found = experiment::search_max_stiffness(setup, {}, {});
      study.stiffness.back().push_back(found.stiffness);
      study.simulated += found.simulated_time;
    }
  }
  study.seconds = processor_time() - begun;
  return study;
}

struct Distance {
  double of_means = 0.0, of_a_person = 0.0;  // N/m, the largest
};
Distance distance(const Study& one, const Study& truth) {
  Distance largest;
  for (std::size_t wall = 0; wall < truth.stiffness.size(); ++wall) {
    double sum = 0.0;
    for (std::size_t person = 0; person < truth.stiffness[wall].size(); ++person) {
      const double off = one.stiffness[wall][person] - truth.stiffness[wall][person];
      sum += off / static_cast<double>(truth.stiffness[wall].size());
      largest.of_a_person = std::max(largest.of_a_person, std::abs(off));
    }
    largest.of_means = std::max(largest.of_means, std::abs(sum));
  }
  return largest;
}

std::string three_digits(double number) {
  const double step = std::pow(10.0, std::max(0.0, std::floor(std::log10(number)) - 2.0));
  return fmt::format("{:.0f}", std::round(number / step) * step);
}
std::string factor_words(double factor) {
  return factor < 100.0 ? fmt::format("{:.1f}", factor) : three_digits(factor);
}

/// What RK4 needs.
struct StepsNeeded {
  double steps, factor;  // per tick; the exact method is so much faster
};
constexpr double most_steps = 8.0, rounding = 1e-6;

std::string needed_words(const char* whose, const std::optional<StepsNeeded>& needed) {
  if (!needed)
    return fmt::format("RK4 does not give {} within 0.1 N/mm with {:g} steps a tick.", whose, most_steps);
  return fmt::format(
      "RK4 gives {} within 0.1 N/mm with {:g} step{} a tick, and the exact method is {} times as fast.",
      whose, needed->steps, needed->steps > 1.0 ? "s" : "", factor_words(needed->factor));
}

}  // namespace

report::Section controller_section() {
  report::Section section{"With the controller, at the accuracy of a largest stiffness", {}, {}, {}};
  Study exact = study_with({});
  for (int n = 0; n < 2; ++n) exact.seconds = std::min(exact.seconds, study_with({}).seconds);
  report::Table table{
      "The whole study, one thread:",
      {"integrator", "steps per haptic tick", "simulated s per s", "means differ by, at most (N/mm)",
       "a person differs by, at most (N/mm)", "exact is faster by a factor of"},
      {{"exact", "", three_digits(exact.speed()), "", "", "1"}}};
  // The fewest that suffice: 500 Hz, so that steps per 2 ms are steps per tick.
  std::optional<StepsNeeded> of_means, of_people;
  for (double steps = 1.0; !of_people && steps <= most_steps; steps *= 2.0) {
    const Study rk4 = study_with({IntegratorKind::rk4, steps});
    const Distance off = distance(rk4, exact);
    const StepsNeeded found{steps, exact.speed() / rk4.speed()};
    if (!of_means && off.of_means <= accuracy + rounding) of_means = found;
    if (off.of_means <= accuracy + rounding && off.of_a_person <= accuracy + rounding) of_people = found;
    table.rows.push_back({"RK4", fmt::format("{:g}", steps), three_digits(rk4.speed()),
                          fmt::format("{:.2f}", off.of_means / 1e3),
                          fmt::format("{:.1f}", off.of_a_person / 1e3), factor_words(found.factor)});
  }
  section.tables.push_back(std::move(table));
  report::Table both{
      "The two ratios to RK4 side by side, 500 Hz, of this run:",
      {"asked for", "what is compared", "RK4 needs, steps per tick", "exact is faster by a factor of"},
      {}};
  const auto add = [&](const char* asked, const std::optional<StepsNeeded>& needed) {
    both.rows.push_back(
        {asked, "the study with its controller",
         needed ? fmt::format("{:g}", needed->steps) : fmt::format("more than {:g}", most_steps),
         needed ? factor_words(needed->factor) : "-"});
  };
  add("means of the people within 0.1 N/mm", of_means);
  add("everybody's largest stiffness within 0.1 N/mm", of_people);
  for (const EqualError& equal : rk4_at_equal_error())
    both.rows.push_back({"equal error", "integration alone: " + equal.trial, fmt::format("{:g}", equal.steps),
                         (equal.reached ? "" : "more than ") + factor_words(equal.factor)});
  section.tables.push_back(std::move(both));
  section.paragraphs = {
      "Compared: the study of the largest stiffness as 'kmax experiment max-stiffness' makes it (12 people, "
      "eight walls, 15 touches at every stiffness in steps of 0.1 N/mm, 500 Hz), every touch with the "
      "firmware's haptic loop and its judge, once with the exact method and its shared matrices and once "
      "with RK4. Speed: simulated seconds per second of processor time; of the exact method the best of 3. "
      "'speed_and_error_benchmark --controller' measures this section alone.",
      "Against: the exact method's own result. A largest stiffness is wanted to 0.1 N/mm, one step of the "
      "search, of the means of the people or of each of them: a wall that is held just so is decided by "
      "single counts, so one person may be further off than the mean.",
      fmt::format(
          "{} {} The ratio at equal error answers another question, what RK4 would need to be as exact as "
          "the exact method, which no largest stiffness asks for.",
          needed_words("the means", of_means), needed_words("everybody", of_people))};
  return section;
}

}  // namespace kmax::benchmark
