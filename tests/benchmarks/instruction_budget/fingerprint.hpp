#pragma once

#include <bit>
#include <cstdint>
#include <iterator>

#include "firmware/object_dictionary/axis_groups.hpp"
#include "tests/benchmarks/instruction_budget/inputs.hpp"
#include "tests/benchmarks/instruction_budget/steps.hpp"

namespace kmax::instruction_budget {

/// One number for all bits that the steps put out over a long run of inputs. The Cortex-M4F, with its own
/// instructions for halves of words and for pairs of them, and x86, without, must come to the same.
class Fingerprint {
 public:
  std::uint32_t of_all() {
    for (int kind = 0; kind <= 5; ++kind) position(static_cast<control::VelocityEstimatorKind>(kind));
    wall();
    currents();
    instability();
    return value_;
  }

 private:
  void add(std::uint32_t word) {  // FNV-1a over words
    value_ = (value_ ^ word) * 16777619U;
  }
  void add(float number) {
    // Which NaN comes out of an operation is up to the machine.
    add(number == number ? std::bit_cast<std::uint32_t>(number) : 0x7FC00000U);
  }

  void position(control::VelocityEstimatorKind kind) {
    Position<std::uint32_t> position;
    PositionOutput out;
    Path path;
    position.extender.reset(0);
    position.velocity.reset(0);
    for (int i = 0; i < 6000; ++i) {
      const std::int32_t step = i < 2000 ? 1 : i < 4000 ? 7 : 550;
      control::VelocityEstimatorConfig<float> config;
      config.kind = kind;
      const PositionCoefficients c{
          control::Resampler::prepare({step, static_cast<control::Rounding>(i / 500 % 3)}, out.count),
          Velocity::prepare(config, 5e-5F, 1e-7F, step)};
      const auto raw = static_cast<std::int32_t>(path.next(inputs_) * static_cast<float>(step));
      position32_step(position, c, out, static_cast<std::uint32_t>(raw));
      add(static_cast<std::uint32_t>(out.count));
      add(out.velocity);
    }
  }

  void wall() {
    Wall wall;
    for (int i = 0; i < 6000; ++i) {
      control::WallLawConfig<float> config;
      config.kind = static_cast<control::WallKind>(inputs_.random() % std::size(firmware::names::wall_law));
      config.damping = 5.0F;
      config.growing.touch_stiffness = inputs_.random() % 2 == 0 ? 300.0F : 0.0F;
      config.adaptive.relation = static_cast<control::AdaptiveRelation>(inputs_.random() % 3);
      config.adaptive.velocity = static_cast<control::AdaptiveVelocity>(inputs_.random() % 2);
      config.adaptive.mode = static_cast<control::AdaptiveMode>(inputs_.random() % 3);
      const float distance = inputs_.hard(0.002F * inputs_.unit());
      const auto out =
          wall_step(wall, Wall::prepare(config, 5e-5F), distance, inputs_.hard(3.0F * inputs_.unit()));
      add(out.force);
      add(out.magnetic_force);
      add(out.magnetic_coefficient);
      if (i % 64 == 0) wall.reset();
    }
  }

  void instability() {
    Instability detector;
    const auto c = Instability::prepare({});
    control::SineCosine<float> wave{};
    for (std::uint32_t i = 0; i < 60000; ++i) {
      wave = control::sine_cosine<float>(i * 20000000U);  // 93 Hz, its size changed every half second
      const float size = 1e-4F * static_cast<float>(1 + i / 10000 % 5);
      const bool odd = inputs_.random() % 4096 == 0;
      // One after the other: arguments are evaluated in the order that a compiler likes.
      float displacement = size * wave.sine + 2e-5F * inputs_.unit();
      float force = 1.0F - 4000.0F * displacement;
      if (odd) displacement = inputs_.hard(1.0F);
      if (odd) force = inputs_.hard(1.0F);
      add(static_cast<std::uint32_t>(instability_step(detector, c, displacement, force)));
      add(detector.displacement_amplitude());
      add(detector.force_amplitude());
    }
  }

  void currents() {
    Dc dc;
    FieldOriented field_oriented;
    for (int i = 0; i < 6000; ++i) {
      control::DcCurrentControllerConfig<float> dc_config;
      dc_config.torque_constant = 0.05F;
      dc_config.resistance = 0.1F + static_cast<float>(i) * 0.01F;
      control::FieldOrientedControllerConfig<float> config;
      config.torque_constant = 0.05F;
      config.resistance = dc_config.resistance;
      config.dead_time = dc_config.dead_time = i / 200 % 2 == 0 ? 500e-9F : 0.0F;
      FieldOriented::Input in;
      in.angle = inputs_.random();
      const float size = i / 100 % 2 == 0 ? 1.0F : 30.0F;
      in.current_b = inputs_.hard(size * inputs_.unit());
      in.current_c = size * inputs_.unit();
      in.electrical_speed = 500.0F * inputs_.unit();
      in.reference_d = size * inputs_.unit();
      in.reference_q = inputs_.hard(size * inputs_.unit());
      in.supply = 24.0F + 12.0F * inputs_.unit();
      const auto a = dc_step(dc, Dc::prepare(dc_config, 5e-5F), in.reference_q, in.current_b,
                             in.electrical_speed, in.supply);
      add(a.voltage);
      add(a.duty_b);
      add(a.duty_c);
      const auto b =
          field_oriented_step(field_oriented, FieldOriented::prepare(config, 5e-5F), in.angle, in.current_b,
                              in.current_c, in.electrical_speed, in.reference_d, in.reference_q, in.supply);
      for (const float number :
           {b.duty_a, b.duty_b, b.duty_c, b.current_d, b.current_q, b.voltage_d, b.voltage_q})
        add(number);
      const auto phases =
          b.not_finite ? control::PhaseCurrents<float>{} : FieldOriented::phase_references(in);
      for (const float number : {phases.a, phases.b, phases.c}) add(number);
      const auto open =
          FieldOriented::voltage(FieldOriented::prepare(config, 5e-5F), in, in.reference_d, in.reference_q);
      for (const float number : {open.duty_a, open.duty_b, open.duty_c, open.voltage_d, open.voltage_q})
        add(number);
      for (const auto& pair : {control::sine_cosine<float>(in.angle), sine_cosine_polynomial(in.angle)}) {
        add(pair.sine);
        add(pair.cosine);
      }
      const auto c = transmission_step(Transmission::prepare({}), in.reference_q);
      add(c.current);
      add(c.force);
    }
  }

  Inputs inputs_;
  std::uint32_t value_ = 2166136261U;
};

/// What it was when the steps were last changed on purpose. When it differs on one machine only, the machines
/// do not agree; when it differs on both in the same way, put the new number here.
inline constexpr std::uint32_t known_fingerprint = 4078565570U;

}  // namespace kmax::instruction_budget
