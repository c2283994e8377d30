#include "tests/benchmarks/instruction_budget/steps.hpp"

namespace kmax::instruction_budget {

extern "C" {

void nothing_step() {}

Wall::Output wall_step(Wall& wall, const Wall::Coefficients& c, float distance, float velocity) {
  return wall.update(c, distance, velocity);
}

void position16_step(Position<std::uint16_t>& position, const PositionCoefficients& c, PositionOutput& out,
                     std::uint32_t raw) {
  const auto sample =
      position.resampler.sample(c.resampler, position.extender.update(static_cast<std::uint16_t>(raw)));
  out.count = sample.count;
  out.velocity = position.velocity.update(c.velocity, sample);
}

void position32_step(Position<std::uint32_t>& position, const PositionCoefficients& c, PositionOutput& out,
                     std::uint32_t raw) {
  const auto sample = position.resampler.sample(c.resampler, position.extender.update(raw));
  out.count = sample.count;
  out.velocity = position.velocity.update(c.velocity, sample);
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
                                          const FieldOriented::Input& in) {
  return controller.update(c, in);
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
}

}  // namespace kmax::instruction_budget
