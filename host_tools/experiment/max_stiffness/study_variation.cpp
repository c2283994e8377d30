#include "host_tools/experiment/max_stiffness/study_variation.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "host_tools/experiment/job_pool.hpp"
#include "host_tools/experiment/paper_numbers.hpp"

namespace kmax::experiment {
namespace {

std::string in_millimetres(double metres) {
  return fmt::format("{:g} mm", metres * 1e3);
}

}  // namespace

std::vector<StudyVariation> assumption_variations(const SubjectSet& set, const TouchProtocol& protocol) {
  std::vector<StudyVariation> variations;
  const auto add = [&](std::string group, std::string name, bool refit, const auto& change) {
    StudyVariation variation{std::move(name), std::move(group), refit, set, protocol};
    change(variation);
    variations.push_back(std::move(variation));
  };
  const auto unchanged = [](StudyVariation&) {};
  add("none", "as calibrated", false, unchanged);
  for (const double threshold : {0.055e-3, 0.33e-3, 0.66e-3}) {
    add("threshold", in_millimetres(threshold) + " peak to peak", false,
        [&](StudyVariation& v) { v.protocol.threshold = threshold; });
  }
  const auto with_pushes = [&](std::vector<double> pushes, bool refit) {
    std::string name = "pushes of";
    for (const double push : pushes) name += fmt::format(" {:g}", push);
    add("push", name + " N", refit, [&](StudyVariation& v) { v.protocol.pushes = pushes; });
  };
  for (const bool refit : {false, true}) {
    with_pushes({0.3}, refit);
    with_pushes({1.0}, refit);
    with_pushes({0.1, 0.3, 1.0, 3.0}, refit);
  }
  for (const bool refit : {false, true}) {
    for (const std::vector<double>& speeds : {std::vector{0.05, 0.1}, std::vector{0.5, 1.0}}) {
      add("approach speed", fmt::format("approach at {:g} and {:g} m/s", speeds[0], speeds[1]), refit,
          [&](StudyVariation& v) { v.protocol.approach_speeds = speeds; });
    }
  }
  for (const double mass : {0.03, 0.06})
    add("device", fmt::format("mass {:g} kg", mass), true,
        [&](StudyVariation& v) { v.set.device.mass = mass; });
  for (const double damping : {0.0, 0.2, 0.5})
    add("device", fmt::format("damping {:g} N s/m", damping), true,
        [&](StudyVariation& v) { v.set.device.damping = damping; });
  for (const double delay : {0.2e-3, 1e-3})
    add("device", fmt::format("delay {:g} ms", delay * 1e3), true,
        [&](StudyVariation& v) { v.set.device.delay = delay; });
  using simulation::IntegratorKind;
  for (const auto& [kind, substeps, name] :
       {std::tuple{IntegratorKind::semi_implicit_euler, 10.0, "semi-implicit Euler, 10 steps in 2 ms"},
        std::tuple{IntegratorKind::rk4, 4.0, "RK4, 4 steps in 2 ms"}}) {
    add("integrator", name, false, [kind = kind, substeps = substeps](StudyVariation& v) {
      v.integrator.kind = kind;
      v.integrator.substeps = substeps;
    });
  }
  return variations;
}

std::vector<StudyVariation> draw_variations(const SubjectSet& set, const TouchProtocol& protocol,
                                            std::size_t draws) {
  std::vector<StudyVariation> variations;
  for (std::uint64_t seed = 1; seed <= draws; ++seed) {
    StudyVariation variation{fmt::format("people of seed {}", seed), "draw", true, set, protocol};
    variation.set.seed = seed;
    variation.set.fitted.reset();
    variation.set.subjects = draw_subjects(set.subjects.size(), seed, set.subjects.front().person);
    variations.push_back(std::move(variation));
  }
  return variations;
}

namespace {

VariationResult run_variation(const StudyVariation& variation, const CalibrationSettings& calibration,
                              const StiffnessSteps& steps) {
  StiffnessRun run;
  run.steps = steps;
  run.protocol = variation.protocol;
  run.integrator = variation.integrator;
  SubjectSet set = variation.set;
  VariationResult result;
  result.variation = variation;
  if (variation.refit) {
    const OperatorCalibration fit = calibrate_operator(variation.set, calibration, run);
    set = fit.set;
    result.plain_met = fit.plain_met;
    result.magnetic_met = fit.magnetic_met;
  }
  result.friction = set.device.friction;
  result.activation_gain = set.subjects.front().person.activation_gain;
  const MaxStiffnessStudy study = run_max_stiffness_study(set, stiffness_conditions(), run);
  for (const ConditionResult& condition : study.conditions) {
    result.means.push_back(condition.mean());
    result.ends.push_back(counted_ends(condition.subjects));
  }
  return result;
}

RunJournal::Json json_of(const VariationResult& result) {
  RunJournal::Json ends = RunJournal::Json::array();
  for (const CountedEnds& one : result.ends) ends.push_back({one.at_zero, one.beyond_last});
  return {{"friction_n", result.friction},       {"activation_gain_per_n", result.activation_gain},
          {"means_n_per_m", result.means},       {"plain_met", result.plain_met},
          {"magnetic_met", result.magnetic_met}, {"people_at_zero_and_beyond", ends}};
}

VariationResult result_from(const StudyVariation& variation, const RunJournal::Json& known) {
  VariationResult result{variation,
                         known.at("friction_n"),
                         known.at("activation_gain_per_n"),
                         known.at("means_n_per_m"),
                         known.at("plain_met"),
                         known.at("magnetic_met")};
  for (const RunJournal::Json& one : known.at("people_at_zero_and_beyond"))
    result.ends.push_back({one.at(0), one.at(1)});
  return result;
}

std::string key_of(const StudyVariation& variation) {
  return fmt::format("variation and fit: {}, {}, {}, limit {:g} N", variation.group, variation.name,
                     variation.refit ? "fitted again" : "as fitted", variation.set.device.force_limit);
}

}  // namespace

std::vector<VariationResult> run_variations(const std::vector<StudyVariation>& variations,
                                            const CalibrationSettings& calibration, const StiffnessRun& run) {
  // A variation is a long chain of small searches: one thread for each.
  return collect_jobs<VariationResult>(
      variations.size(), run.threads,
      [&](std::size_t index) {
        const StudyVariation& variation = variations[index];
        const std::string key = key_of(variation);
        if (run.journal != nullptr) {
          if (const RunJournal::Json* known = run.journal->find(key)) return result_from(variation, *known);
        }
        VariationResult result = run_variation(variation, calibration, run.steps);
        if (run.journal != nullptr) run.journal->add(key, json_of(result));
        return result;
      },
      run.progress);
}

std::vector<VariationFinding> findings_of(const std::vector<VariationResult>& results) {
  const std::vector<StiffnessCondition> conditions = stiffness_conditions();
  const auto constant = [&](const VariationResult& result) {
    std::vector<double> means;
    for (std::size_t n = 0; n < conditions.size(); ++n) {
      if (!conditions[n].adaptive) means.push_back(result.means[n]);
    }
    return means;
  };
  const auto most_adaptive = [&](const VariationResult& result) {
    double most = 0.0;
    for (std::size_t n = 0; n < conditions.size(); ++n) {
      if (conditions[n].adaptive) most = std::max(most, result.means[n]);
    }
    return most;
  };
  std::vector<VariationFinding> findings;
  const auto count = [&](std::string claim, const auto& holds) {
    VariationFinding finding{std::move(claim)};
    for (const VariationResult& result : results) {
      if (!result.met()) {
        ++finding.missed;
        continue;
      }
      ++finding.of;
      finding.holds += holds(result) ? 1 : 0;
    }
    findings.push_back(std::move(finding));
  };
  count("the largest stiffness rises with every step of F_MC from 0 to 2 N",
        [&](const VariationResult& result) {
          const std::vector<double> means = constant(result);
          return std::adjacent_find(means.begin(), means.end(), [](double a, double b) { return b <= a; }) ==
                 means.end();
        });
  count("the adaptive wall is above the plain one, in its best mode",
        [&](const VariationResult& result) { return most_adaptive(result) > constant(result).front(); });
  count("the adaptive wall stays below a constant 2 N, in its best mode",
        [&](const VariationResult& result) { return most_adaptive(result) < constant(result).back(); });
  constexpr double printed = paper::max_stiffness.back().stiffness;
  static_assert(paper::max_stiffness.back().adaptive);
  count(fmt::format("the adaptive wall reaches {:g} N/mm within 0.4 N/mm, in its best mode", printed / 1e3),
        [&](const VariationResult& result) { return std::abs(most_adaptive(result) - printed) <= 400.0; });
  return findings;
}

}  // namespace kmax::experiment
