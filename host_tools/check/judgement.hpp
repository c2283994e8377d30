#pragma once

#include <array>
#include <optional>
#include <string>
#include <vector>

#include "host_tools/check/criterion_text.hpp"
#include "host_tools/check/parameter_case.hpp"

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

  bool pass_of(Worth worth) const;

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
/// parameters are searched for values that help.
Judgement judge_parameters(const firmware::ParameterValues& values, std::size_t axis,
                           const control::Hand<double>& hand);

}  // namespace kmax::check
