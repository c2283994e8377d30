#include "host_tools/json/judgement_json.hpp"

#include "host_tools/base/numbers.hpp"
#include "host_tools/check/bent_loop.hpp"
#include "host_tools/check/criterion_text.hpp"

namespace kmax::json {

using check::CriterionText;
using check::Verdict;

namespace {
Json finite_or_null(double number) {
  return check::is_infinite(number) ? Json(nullptr) : Json(number);
}

Json changes_json(const std::vector<check::Change>& changes) {
  Json all = Json::array();
  for (const check::Change& change : changes)
    all.push_back({{"parameter", change.parameter.name()},
                   {"value", base::shortest_double(change.value)},
                   {"unit", std::string(change.parameter.definition().unit)},
                   {"at_least", change.at_least},
                   {"only_if_true", change.fact}});
  return all;
}

Json verdict_json(const Verdict& verdict) {
  const auto& result = verdict.result;
  const CriterionText& text = check::text_of(result.criterion);
  return {{"name", std::string(text.name())},
          {"value", result.applies ? finite_or_null(result.value) : Json(nullptr)},
          {"bound", result.applies ? finite_or_null(result.bound) : Json(nullptr)},
          {"unit", std::string(text.unit)},
          {"margin", verdict.margin ? Json(*verdict.margin) : Json(nullptr)},
          {"pass", result.pass},
          {"applies", result.applies},
          {"at_least", result.at_least},
          {"worth", std::string(check::name_of(text.worth))},
          {"changes", changes_json(verdict.changes)}};
}
}  // namespace

Json judgement_json(const check::Judgement& judgement, const std::string& hand) {
  const auto& c = judgement.stability_case;
  Json criteria = Json::array();
  for (const Verdict& verdict : judgement.verdicts) criteria.push_back(verdict_json(verdict));
  Json worths = Json::object();
  for (const check::Worth worth : {check::Worth::guarantee, check::Worth::necessary, check::Worth::heuristic})
    worths[std::string(check::name_of(worth))] = judgement.pass_of(worth);
  Json document = {{"pass", judgement.pass},
                   {"pass_by_worth", worths},
                   {"guaranteed", judgement.guaranteed()},
                   {"criteria", criteria},
                   {"changes", changes_json(judgement.changes)},
                   {"diolaiti_region", std::string(check::to_string(check::region_of(c)))},
                   {"case",
                    {{"stiffness_n_per_m", c.stiffness},
                     {"wall_damping_n_s_per_m", c.wall_damping},
                     {"magnetic_coefficient_n", c.magnetic_coefficient},
                     {"magnetic_length_m", c.magnetic_length},
                     {"period_s", c.period},
                     {"delay_s", c.delay},
                     {"quantum_m", c.quantum},
                     {"mass_kg", c.mass},
                     {"damping_n_s_per_m", c.damping},
                     {"friction_n", c.friction},
                     {"operator_force_n", c.operator_force},
                     {"operator_speed_m_per_s", c.operator_speed},
                     {"force_limit_n", c.force_limit},
                     {"hand", hand}}}};
  if (const auto& structure = judgement.structure) {
    // The region is of one mass.
    document["diolaiti_region"] = nullptr;
    document["case"]["structure_stiffness_n_per_m"] = structure->stiffness;
    document["case"]["structure_damping_n_s_per_m"] = structure->damping;
    document["case"]["handle_mass_kg"] = structure->handle_mass;
    document["case"]["felt_stiffness_n_per_m"] = check::felt_stiffness(c.stiffness, *structure);
  }
  return document;
}

}  // namespace kmax::json
