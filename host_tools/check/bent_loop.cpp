#include "host_tools/check/bent_loop.hpp"

#include <array>
#include <cmath>
#include <limits>

#include "control/handle_transition.hpp"
#include "control/sampled_stability.hpp"

namespace kmax::check {

namespace {
/// Of a spring per mass, in units of one sample: ten times that of the stiffest structure with the lightest
/// tip at the slowest rate, up to which tests compare with eigenvalues by QR. Far beyond, rounding would
/// decide.
constexpr double largest_rate = 1e9;

/// In units of one sample, as control::HandleModel: the motor's position and velocity, then what that has for
/// the tip and the hand, which is a handle of its own without damping to the ground.
struct BentModel {
  static constexpr std::size_t largest_order = 6;
  using Vector = std::array<double, largest_order>;
  using Matrix = std::array<Vector, largest_order>;

  std::size_t order;
  Matrix rate{};
  bool free_position, free_momentum;

  explicit BentModel(const BentLoop& loop) {
    const control::SampledLoop<double>& motor = loop.motor_side;
    const simulation::StructureModel& structure = loop.structure;
    const control::HandleModel<double> tip(structure.handle_mass, 0.0, motor.period, motor.hand);
    constexpr std::size_t q = 2;  // the tip's first state
    order = q + tip.order;
    free_position = tip.free_position;
    free_momentum = tip.free_momentum && motor.damping == 0.0;
    for (std::size_t i = 0; i < tip.order; ++i) {
      for (std::size_t j = 0; j < tip.order; ++j) rate[q + i][q + j] = tip.rate[i][j];
    }
    rate[0][1] = 1.0;
    rate[1][1] = -motor.damping * (motor.period / motor.mass);
    const auto couple = [&](std::size_t row, double mass, std::size_t own, std::size_t other) {
      const double damping = structure.damping * (motor.period / mass);
      const double stiffness = structure.stiffness * (motor.period / mass) * motor.period;
      rate[row][own] -= stiffness;
      rate[row][own + 1] -= damping;
      rate[row][other] += stiffness;
      rate[row][other + 1] += damping;
    };
    couple(1, motor.mass, 0, q);
    couple(q + 1, structure.handle_mass, q, 0);
  }
};

using Equation = control::LoopEquation<double, BentModel>;

bool is_allowed(const BentLoop& loop) {
  const simulation::StructureModel& s = loop.structure;
  return control::is_allowed(loop.motor_side) && s.stiffness > 0.0 && std::isfinite(s.stiffness) &&
         s.damping >= 0.0 && std::isfinite(s.damping) && s.handle_mass > 0.0 && std::isfinite(s.handle_mass);
}

bool can_be_computed(const BentModel& model) {
  for (const auto& row : model.rate) {
    for (const double rate : row) {
      if (!(std::abs(rate) <= largest_rate)) return false;
    }
  }
  return true;
}
}  // namespace

bool can_be_judged(const BentLoop& loop) {
  if (!is_allowed(loop)) return false;
  const BentModel model(loop);
  return can_be_computed(model) && Equation(loop.motor_side, model).finite();
}

bool is_stable(const BentLoop& loop, double stiffness) {
  if (!can_be_judged(loop)) return false;
  const control::SampledLoop<double>& motor = loop.motor_side;
  const double gain = stiffness * (motor.period / motor.mass) * motor.period;
  return control::all_in_left_half_plane(Equation(motor, BentModel(loop)).half_plane_polynomial(gain));
}

double largest_stable_stiffness(const BentLoop& loop) {
  if (!can_be_judged(loop)) return 0.0;
  const Equation equation(loop.motor_side, BentModel(loop));
  const double gain = control::StabilitySearch<double, Equation>(equation).largest_stable_gain();
  return gain < std::numeric_limits<double>::max() ? control::stiffness_of_gain(loop.motor_side, gain) : gain;
}

double felt_stiffness(double wall_stiffness, const simulation::StructureModel& structure) {
  return wall_stiffness / (1.0 + wall_stiffness / structure.stiffness);
}

}  // namespace kmax::check
