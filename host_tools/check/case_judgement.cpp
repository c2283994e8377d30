#include "host_tools/check/case_judgement.hpp"

#include "host_tools/check/bent_loop.hpp"
#include "host_tools/check/criterion_text.hpp"

namespace kmax::check {

using control::Criterion;
using control::CriterionResult;
using control::StabilityCase;

CriterionResult<double> judge(Criterion criterion, const StabilityCase<double>& c,
                              const Structure& structure) {
  if (!structure) return control::judge(criterion, c);
  if (!text_of(criterion).covers_structure) return {criterion, false, true, false, 0, 0};
  if (criterion != Criterion::sampled_eigenvalues) return control::judge(criterion, c);
  return control::judge_sampled_eigenvalues(c, BentLoop{control::sampled_loop_of(c), *structure});
}

Results judge_all(const StabilityCase<double>& c, const Structure& structure) {
  Results results{};
  for (std::size_t i = 0; i < results.size(); ++i)
    results[i] = judge(static_cast<Criterion>(i), c, structure);
  return results;
}

bool is_stable(const StabilityCase<double>& c, const Structure& structure) {
  const control::SampledLoop<double> loop = control::sampled_loop_of(c);
  return structure ? is_stable(BentLoop{loop, *structure}, c.stiffness)
                   : control::is_stable(loop, c.stiffness);
}

}  // namespace kmax::check
