#pragma once

#include <cstdint>

#include "control/count_extender.hpp"
#include "control/dc_current_controller.hpp"
#include "control/field_oriented_controller.hpp"
#include "control/haptic_loop.hpp"
#include "control/instability_detector.hpp"
#include "control/motor_transmission.hpp"
#include "control/resampler.hpp"
#include "control/velocity_estimator.hpp"
#include "control/wall_law.hpp"
#include "tests/benchmarks/instruction_budget/sine_variants.hpp"
#include "tests/studies/velocity_candidates.hpp"

// The steps of the interrupt path as functions of their own, compiled apart from what calls them: nothing
// about their arguments is known to the compiler, as in the tick. An argument that the step before leaves in
// a register is passed in one.
namespace kmax::instruction_budget {

using Wall = control::WallLaw<float>;
using Instability = control::InstabilityDetector<float>;
using Velocity = control::VelocityEstimator<float>;
using Dc = control::DcCurrentController<float>;
using FieldOriented = control::FieldOrientedController<float>;
using DcDouble = control::DcCurrentController<double>;
struct DcDoubleInput {
  double reference, current, speed, supply;
};
using FieldOrientedDouble = control::FieldOrientedController<double>;
using Haptic = control::HapticLoop<float>;
using Transmission = control::MotorTransmission<float>;

// From the counter's register to position and velocity.
template <typename Counter>
struct Position {
  control::CountExtender<Counter> extender;
  control::Resampler resampler;
  Velocity velocity;
  std::uint32_t samples = 0;
};
struct PositionCoefficients {
  control::Resampler::Coefficients resampler;
  Velocity::Coefficients velocity;
};
struct PositionOutput {
  std::int64_t count = 0;
  float velocity = 0.0F;
};

extern "C" {
void nothing_step();
Wall::Output wall_step(Wall& wall, const Wall::Coefficients& c, float distance, float velocity);
bool instability_step(Instability& detector, const Instability::Coefficients& c, float displacement,
                      float force);
void position16_step(Position<std::uint16_t>& position, const PositionCoefficients& c, PositionOutput& out,
                     std::uint32_t raw);
void position32_step(Position<std::uint32_t>& position, const PositionCoefficients& c, PositionOutput& out,
                     std::uint32_t raw);
void resample_step(Position<std::uint32_t>& position, const PositionCoefficients& c, PositionOutput& out,
                   std::uint32_t raw);
Dc::Output dc_step(Dc& dc, const Dc::Coefficients& c, float reference, float current, float speed,
                   float supply);
FieldOriented::Output field_oriented_step(FieldOriented& controller, const FieldOriented::Coefficients& c,
                                          std::uint32_t angle, float current_b, float current_c,
                                          float electrical_speed, float reference_d, float reference_q,
                                          float supply);
Transmission::Output transmission_step(const Transmission::Coefficients& c, float force);
const Haptic::Output& haptic_step(Haptic& loop, const Haptic::Coefficients& c, std::int64_t count);
control::SineCosine<float> sine_cosine_step(std::uint32_t angle);
control::SineCosine<float> sine_cosine_first_order_step(std::uint32_t angle);
control::SineCosine<float> sine_cosine_nearest_step(std::uint32_t angle);
control::SineCosine<float> sine_cosine_polynomial_step(std::uint32_t angle);
// What the same steps cost in double, for which this processor has no instructions.
void dc_double_step(DcDouble& dc, const DcDouble::Coefficients& c, const DcDoubleInput& in,
                    DcDouble::Output& out);
void field_oriented_double_step(FieldOrientedDouble& controller, const FieldOrientedDouble::Coefficients& c,
                                const FieldOrientedDouble::Input& in, FieldOrientedDouble::Output& out);
}

/// Of those that were tried instead of FOAW; in steps.cpp for each.
template <typename Candidate>
float candidate_step(Candidate& candidate, std::int32_t steps);

}  // namespace kmax::instruction_budget
