#include "tests/benchmarks/instruction_budget/steps.hpp"

namespace kmax::instruction_budget {

extern "C" {

void nothing_step() {}

Wall::Output wall_step(Wall& wall, const Wall::Coefficients& c, float distance, float velocity) {
  return wall.update(c, distance, velocity);
}

bool instability_step(Instability& detector, const Instability::Coefficients& c, float displacement,
                      float force) {
  return detector.update(c, displacement, force);
}

void position16_step(Position<std::uint16_t>& position, const PositionCoefficients& c, PositionOutput& out,
                     std::uint32_t raw) {
  const auto sample =
      position.resampler.sample(c.resampler, position.extender.update(static_cast<std::uint16_t>(raw)));
  out.count = sample.count;
  out.velocity = position.velocity.update(c.velocity, sample, ++position.samples);
}

void position32_step(Position<std::uint32_t>& position, const PositionCoefficients& c, PositionOutput& out,
                     std::uint32_t raw) {
  const auto sample = position.resampler.sample(c.resampler, position.extender.update(raw));
  out.count = sample.count;
  out.velocity = position.velocity.update(c.velocity, sample, ++position.samples);
}

void resample_step(Position<std::uint32_t>& position, const PositionCoefficients& c, PositionOutput& out,
                   std::uint32_t raw) {
  out.count = position.resampler.update(c.resampler, position.extender.update(raw));
}

Dc::Output dc_step(Dc& dc, const Dc::Coefficients& c, float reference, float current, float speed,
                   float supply) {
  return dc.update(c, reference, current, speed, supply);
}

FieldOriented::Output field_oriented_step(FieldOriented& controller, const FieldOriented::Coefficients& c,
                                          std::uint32_t angle, float current_b, float current_c,
                                          float electrical_speed, float reference_d, float reference_q,
                                          float supply) {
  return controller.update(c,
                           {angle, current_b, current_c, electrical_speed, reference_d, reference_q, supply});
}

Transmission::Output transmission_step(const Transmission::Coefficients& c, float force) {
  return Transmission::update(c, force);
}

const Haptic::Output& haptic_step(Haptic& loop, const Haptic::Coefficients& c, std::int64_t count) {
  return loop.tick(c, count, true);
}

control::SineCosine<float> sine_cosine_step(std::uint32_t angle) {
  return control::sine_cosine<float>(angle);
}
control::SineCosine<float> sine_cosine_first_order_step(std::uint32_t angle) {
  return control::sine_cosine_first_order<float>(angle);
}
control::SineCosine<float> sine_cosine_nearest_step(std::uint32_t angle) {
  return sine_cosine_nearest(angle);
}
control::SineCosine<float> sine_cosine_polynomial_step(std::uint32_t angle) {
  return sine_cosine_polynomial(angle);
}

void dc_double_step(DcDouble& dc, const DcDouble::Coefficients& c, const DcDoubleInput& in,
                    DcDouble::Output& out) {
  out = dc.update(c, in.reference, in.current, in.speed, in.supply);
}

void field_oriented_double_step(FieldOrientedDouble& controller, const FieldOrientedDouble::Coefficients& c,
                                const FieldOrientedDouble::Input& in, FieldOrientedDouble::Output& out) {
  out = controller.update(c, in);
}
}

template <typename Candidate>
float candidate_step(Candidate& candidate, std::int32_t steps) {
  return candidate.update(steps);
}
template float candidate_step(studies::HeldFoaw<1>&, std::int32_t);
template float candidate_step(studies::HeldFoaw<2>&, std::int32_t);
template float candidate_step(studies::TwoCones<16>&, std::int32_t);
template float candidate_step(studies::IntervalTracking&, std::int32_t);
template float candidate_step(studies::EdgePeriod<16>&, std::int32_t);
template float candidate_step(studies::EdgePeriod<8>&, std::int32_t);

}  // namespace kmax::instruction_budget
