#pragma once
// Words and numbers that the experiments' reports write in one way.

#include <cstddef>
#include <optional>
#include <string>
#include <string_view>

#include "control/velocity_estimator.hpp"
#include "host_tools/experiment/tested_claim.hpp"
#include "host_tools/simulation/device_model.hpp"
#include "host_tools/simulation/operator_model.hpp"

namespace kmax::experiment {

/// A table's "yes" or "no".
std::string yes_no(bool value);

/// Likewise, or `untested`.
std::string yes_no(const TestedClaim& claim, std::string_view untested);

/// A rank correlation, "+0.87"; "-" where there is none.
std::string rank_text(const std::optional<double>& rank);

/// "1 person", "12 people".
std::string people_words(std::size_t count);

/// "1 touch", "4 touches".
std::string touch_words(std::size_t count);

/// "falls", "does not fall" or `untested`.
std::string fall_words(const TestedClaim& falls, std::string_view untested);

/// A sentence on what a simulated hand that does not stiffen tells of a number's fall with F_B: the
/// stiffening is its cause only where it falls with it and not without. `number` is the sentence's subject,
/// "Jit" or "it".
std::string cause_words(std::string_view number, const TestedClaim& falls, const TestedClaim& falls_without);

/// As the parameter velocity.estimator has it.
std::string estimator_name(control::VelocityEstimatorKind estimator);

/// Two sentences on what a device's verdict does not say of a wall with wall.touch_stiffness.
std::string growing_wall_words();

/// What the simulated device makes of a force: "clipped at 3.3 N", "not clipped".
std::string clipping_words(const simulation::DeviceModel& device);

/// A sentence with the numbers of both that decide how stiff a wall can be. Each experiment has its own:
/// those of the largest stiffness are fitted to its means.
std::string model_words(const simulation::DeviceModel& device, const simulation::OperatorModel& person);

}  // namespace kmax::experiment
