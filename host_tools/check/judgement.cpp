#include "host_tools/check/judgement.hpp"

#include <algorithm>
#include <limits>

#include "firmware/drive/stability_case.hpp"
#include "host_tools/base/numbers.hpp"

namespace kmax::check {

using control::CriterionResult;
using firmware::ParameterValues;

bool is_infinite(double number) {
  return !(number < std::numeric_limits<double>::max());
}

std::optional<double> margin_of(const CriterionResult<double>& result) {
  if (!result.applies || is_infinite(result.value) || is_infinite(result.bound)) return std::nullopt;
  constexpr double most = 1e6;
  const double above = result.at_least ? result.value - result.bound : result.bound - result.value;
  if (above == 0) return 0.0;
  if (result.bound <= 0) return above > 0 ? most : -most;
  return std::clamp(above / result.bound, -most, most);
}

namespace {
bool met(const CriterionResult<double>& result) {
  return result.applies && result.pass;
}
}  // namespace

bool Judgement::pass_of(Worth worth) const {
  return std::all_of(verdicts.begin(), verdicts.end(), [worth](const Verdict& verdict) {
    return verdict.result.pass || text_of(verdict.result.criterion).worth != worth;
  });
}

bool Judgement::guarantees_met() const {
  return pass_of(Worth::guarantee) &&
         verdicts[static_cast<std::size_t>(control::Criterion::abbott_okamura)].result.pass;
}

bool Judgement::guaranteed() const {
  const bool anything = !has_no_wall(stability_case) || stability_case.magnetic_coefficient > 0;
  return anything && guarantees_met() && !follows_velocity && !uncovered_damper;
}

bool has_no_wall(const control::StabilityCase<double>& c) {
  return !(c.stiffness > 0) && c.wall_damping == 0;
}

control::DiolaitiRegion region_of(const control::StabilityCase<double>& c) {
  return control::diolaiti_region(c.stiffness, c.damping, c.friction,
                                  control::period_with_delay(c.period, c.delay), c.quantum);
}

double escape_speed_of(const control::StabilityCase<double>& c) {
  return control::escape_speed(c.stiffness, c.damping, c.friction,
                               control::period_with_delay(c.period, c.delay), c.quantum);
}

std::string_view to_string(control::DiolaitiRegion region) {
  switch (region) {
    case control::DiolaitiRegion::passive:
      return "passive";
    case control::DiolaitiRegion::limit_cycle:
      return "limit cycle";
    case control::DiolaitiRegion::locally_stable:
      return "locally stable";
    case control::DiolaitiRegion::unstable:
      break;
  }
  return "unstable";
}

Judgement judge_parameters(const ParameterValues& values, std::size_t axis, const control::Hand<double>& hand,
                           const Structure& structure) {
  Judgement judgement{parameter_case(values, axis, hand), {}, true, {}};
  judgement.structure = structure;
  judgement.follows_velocity = control::follows_velocity(values.choice<control::WallKind, "wall.law">(axis));
  using control::VelocityEstimatorKind;
  const auto estimator = values.choice<VelocityEstimatorKind, "velocity.estimator">(axis);
  const std::int32_t window = values.whole<"wall.damping_window">(axis);
  const bool covered = window == 1 || (window == 0 && (estimator == VelocityEstimatorKind::difference ||
                                                       estimator == VelocityEstimatorKind::low_pass));
  const double touch_stiffness = static_cast<double>(values.real<"wall.touch_stiffness">(axis));
  judgement.grows = touch_stiffness > 0 && touch_stiffness < judgement.stability_case.stiffness;
  judgement.uncovered_damper = judgement.stability_case.wall_damping != 0 && !covered;
  std::vector<control::Criterion> failed;
  for (std::size_t i = 0; i < control::criterion_count; ++i) {
    const auto criterion = static_cast<control::Criterion>(i);
    Verdict& verdict = judgement.verdicts[i];
    verdict.result = judge(criterion, judgement.stability_case, structure);
    verdict.margin = margin_of(verdict.result);
    if (verdict.result.pass) continue;
    failed.push_back(criterion);
    verdict.changes = find_changes(values, axis, [&](const ParameterValues& changed) {
      // A criterion that is only switched off is not met.
      return met(judge(criterion, parameter_case(changed, axis, hand), structure));
    });
  }
  judgement.pass = failed.empty();
  if (failed.size() > 1) {
    judgement.changes = find_changes(values, axis, [&](const ParameterValues& changed) {
      const auto c = parameter_case(changed, axis, hand);
      // What fails now is the likeliest to fail again.
      for (const control::Criterion criterion : failed) {
        if (!met(judge(criterion, c, structure))) return false;
      }
      const auto results = judge_all(c, structure);
      return std::all_of(results.begin(), results.end(), [](const auto& result) { return result.pass; });
    });
  }
  return judgement;
}

control::StabilityCase<double> parameter_case(const firmware::ParameterValues& values, std::size_t axis,
                                              const control::Hand<double>& hand) {
  auto judged = firmware::stability_case<double>(values, axis, base::shortest_double);
  judged.hand = hand;
  return judged;
}

std::vector<device::Parameter> parameters_of_case(std::size_t axis) {
  std::vector<device::Parameter> all;
  for (const auto& one : firmware::case_parameters) all.emplace_back(one.entry, axis);
  return all;
}

std::vector<device::Parameter> parameters_of_judgement(std::size_t axis) {
  using device::Parameter;
  std::vector<Parameter> all = parameters_of_case(axis);
  for (const Parameter& beside :
       {Parameter::of<"velocity.estimator">(axis), Parameter::of<"wall.damping_window">(axis),
        Parameter::of<"wall.touch_stiffness">(axis)})
    if (std::find(all.begin(), all.end(), beside) == all.end()) all.push_back(beside);
  return all;
}

}  // namespace kmax::check
