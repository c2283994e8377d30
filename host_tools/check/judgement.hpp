#pragma once

#include <array>
#include <cstddef>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "control/stability_criteria.hpp"
#include "firmware/parameters/parameter_values.hpp"
#include "host_tools/check/case_judgement.hpp"
#include "host_tools/check/criterion_text.hpp"
#include "host_tools/device/parameter.hpp"

namespace kmax::check {

/// A parameter that would have to be on this side of `value` for a criterion to be met, everything else
/// unchanged; the value itself, as a float32 of the dictionary, meets it.
struct Change {
  device::Parameter parameter;
  float value;
  bool at_least;
  bool fact;  ///< describes the device or the operator: to be set only if it is true
};

struct Verdict {
  control::CriterionResult<double> result;
  std::optional<double> margin;  ///< margin_of(result)
  std::vector<Change> changes;   ///< for a criterion that fails: each by itself suffices; may be empty
};

/// A set of parameters against all criteria.
struct Judgement {
  control::StabilityCase<double> stability_case;
  std::array<Verdict, control::criterion_count> verdicts;  ///< in the order of control::Criterion
  bool pass = true;                                        ///< no criterion that applies fails
  /// When more than one fails: single changes after which all criteria are met; may be empty.
  std::vector<Change> changes;

  bool follows_velocity = false;  ///< the law is adaptive, whose dependence on velocity no criterion judges

  bool uncovered_damper = false;  ///< B with a velocity that is neither a difference nor a low-passed one
  bool grows = false;             ///< the stiffness begins lower than what is judged

  Structure structure{};  ///< that the device bends by; with one the case's mass is of the motor's side alone

  bool pass_of(Worth worth) const;
  /// All that a guarantee asks for: what guarantees, and the step of abbott_okamura, which no delay changes.
  bool guarantees_met() const;

  /// Stable with every passive hand, as far as the assumptions hold: the guarantees are met, there is
  /// something to guarantee, and nothing of the law is left out of them.
  bool guaranteed() const;
};

/// How far a value is from its bound, as a part of the bound: (bound - value) / bound, or for at_least
/// value / bound - 1; negative when the criterion fails. Within +-1e6: a bound that is 0 or less, which only
/// the value 0 can meet, gives -1e6 for any other. Nothing if the criterion does not apply, or if bound or
/// value is infinite.
std::optional<double> margin_of(const control::CriterionResult<double>& result);

/// The largest number stands for infinity, as control/stability_criteria.hpp says.
bool is_infinite(double number);

/// Spring and damper are 0; a field may be there all the same.
bool has_no_wall(const control::StabilityCase<double>& c);

/// Where the wall stands among Diolaiti's regions, and that in words.
control::DiolaitiRegion region_of(const control::StabilityCase<double>& c);
std::string_view to_string(control::DiolaitiRegion region);
/// The speed below which it comes to rest again, m/s; see control/diolaiti_criterion.hpp.
double escape_speed_of(const control::StabilityCase<double>& c);

/// `values` keep the rules between parameters. Takes about a millisecond, more when much fails: then single
/// parameters are searched for values that help. `structure`: see case_judgement.hpp.
Judgement judge_parameters(const firmware::ParameterValues& values, std::size_t axis,
                           const control::Hand<double>& hand, const Structure& structure = {});

/// What the criteria judge of one axis, see firmware/drive/stability_case.hpp: with the hand that holds it,
/// and each number as the user wrote it: 0.1, not the 0.100000001490116 of the float that is nearest to it.
control::StabilityCase<double> parameter_case(const firmware::ParameterValues& values, std::size_t axis,
                                              const control::Hand<double>& hand = {});

/// The parameters that it reads, of that axis.
std::vector<device::Parameter> parameters_of_case(std::size_t axis);

/// Those that judge_parameters() reads: of the case, of what a guarantee covers, of a wall that grows.
std::vector<device::Parameter> parameters_of_judgement(std::size_t axis);

/// Whether a set of parameters does what is wanted.
using Wanted = std::function<bool(const firmware::ParameterValues&)>;

/// Single parameters whose change alone makes `wanted` true, the user's own choices first, then the facts
/// about device and operator. For each: the change nearest to the present value, rounded to three digits (or
/// as few more as it takes) towards the side on which it is still true.
///
/// `values` is a set for which `wanted` is false. Each parameter is walked from its present value to the end
/// of its range in 60 steps, so what is true only within a gap narrower than that is not found. About 1000
/// calls of `wanted`.
std::vector<Change> find_changes(const firmware::ParameterValues& values, std::size_t axis,
                                 const Wanted& wanted);

/// The verdicts for people: what went in, the criteria by what they are worth, what each failed one would
/// need, and what follows.
std::string judgement_text(const Judgement& judgement, const std::string& hand, std::size_t width = 110);

/// "wall.stiffness at most 1990 N/m".
std::string text_of(const Change& change);

}  // namespace kmax::check
