#pragma once

#include <array>

#include "control/closed_form_criteria.hpp"
#include "control/sampled_stability.hpp"
#include "control/stability_case.hpp"

namespace kmax::control {

/// What of a case the sampled eigenvalues judge.
template <typename Scalar>
constexpr SampledLoop<Scalar> sampled_loop_of(const StabilityCase<Scalar>& c) {
  return {c.mass, c.damping, c.wall_damping, c.period, c.delay, c.hand};
}

/// The sampled eigenvalues of `loop`, for which can_be_judged() and largest_stable_stiffness() are there.
template <typename Scalar, typename Loop>
constexpr CriterionResult<Scalar> judge_sampled_eigenvalues(const StabilityCase<Scalar>& c,
                                                            const Loop& loop) {
  constexpr Criterion criterion = Criterion::sampled_eigenvalues;
  const bool wall = !(c.stiffness <= Scalar(0)) || c.wall_damping != Scalar(0);
  if (!wall || !can_be_judged(loop)) return {criterion, false, true, false, Scalar(0), Scalar(0)};
  const Scalar bound = largest_stable_stiffness(loop);
  return {criterion, true, c.stiffness < bound, false, c.stiffness, bound};
}

/// One criterion for one case: those of closed_form_criteria.hpp, and
///
///   criterion            value   bound                                                    passes
///   sampled_eigenvalues  K, N/m  the smallest K at which the exact sampled loop, with      <
///                                the hand, is not stable (sampled_stability.hpp)
///
/// which applies with a wall, a mass, a period, and a delay of no more than 8 samples. A stiffness beyond the
/// bound does not pass even if it is stable again. Firmware includes closed_form_criteria.hpp instead, which
/// leaves the search (4 KB of code at -Os) out of the image.
template <typename Scalar>
constexpr CriterionResult<Scalar> judge(Criterion criterion, const StabilityCase<Scalar>& c) {
  if (criterion != Criterion::sampled_eigenvalues) return judge_closed_form(criterion, c);
  return judge_sampled_eigenvalues(c, sampled_loop_of(c));
}

/// All of them, in the order of their numbers.
template <typename Scalar>
constexpr std::array<CriterionResult<Scalar>, criterion_count> judge_all(const StabilityCase<Scalar>& c) {
  std::array<CriterionResult<Scalar>, criterion_count> results{};
  for (std::size_t i = 0; i < criterion_count; ++i) results[i] = judge(static_cast<Criterion>(i), c);
  return results;
}

}  // namespace kmax::control
