#pragma once

#include <array>
#include <optional>

#include "control/stability_criteria.hpp"
#include "host_tools/simulation/device_model.hpp"

// The criteria of control/stability_criteria.hpp for a device that may bend between motor and handle.

namespace kmax::check {

/// The compliance between motor and handle; none: a rigid device.
using Structure = std::optional<simulation::StructureModel>;

/// One criterion for one case. Of a rigid device it is control::judge(). With a structure, encoder, b, f_c
/// and the case's mass are of the motor's side and the hand holds the tip; then
///
///   colgate, field_slope, abbott_okamura   as without: they ask nothing of what the motor's side drives but
///                                          that it be passive, and m does not appear in them
///   saturation_depth                       as without: of wall and encoder alone
///   sampled_eigenvalues                    of the loop with the structure (bent_loop.hpp)
///   gil, diolaiti, resolution(_speed)      do not apply: derived for one mass that the hand holds itself
///
/// `structure`: within simulation::structure_fields.
control::CriterionResult<double> judge(control::Criterion criterion, const control::StabilityCase<double>& c,
                                       const Structure& structure);

using Results = std::array<control::CriterionResult<double>, control::criterion_count>;

/// All of them, in the order of their numbers.
Results judge_all(const control::StabilityCase<double>& c, const Structure& structure);

/// Whether the loop that sampled_eigenvalues judges is stable with the case's wall, also beyond the first
/// loss of stability; false if it cannot be judged.
bool is_stable(const control::StabilityCase<double>& c, const Structure& structure);

}  // namespace kmax::check
