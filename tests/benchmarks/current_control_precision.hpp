#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdio>
#include <random>
#include <string>
#include <vector>

#include "control/dc_current_controller.hpp"
#include "control/field_oriented_controller.hpp"
#include "tests/benchmarks/current_control_cost.hpp"

// The current controllers in float against the same in double.
namespace kmax::benchmark {

using namespace control;

// Inputs as hard as they come: steps, saturation, the supply's collapse.
struct HardInputs {
  std::mt19937 random{1};
  std::uniform_real_distribution<float> unit{-1.0F, 1.0F};
  float size = 1.0F, supply = 24.0F;

  FieldOrientedController<float>::Input next(int k) {
    if (k % 50 == 0) size = unit(random) > 0.8F ? 30.0F : 0.3F * (1.1F + unit(random));
    if (k % 1000 == 0) supply = unit(random) > 0.9F ? 0.5F : 24.0F + 12.0F * unit(random);
    return {static_cast<TurnFraction>(random()),
            size * unit(random),
            size * unit(random),
            1000.0F * unit(random),
            size * unit(random),
            size * unit(random),
            supply};
  }
};
inline FieldOrientedController<double>::Input widened(const FieldOrientedController<float>::Input& in) {
  const auto wide = [](float value) { return static_cast<double>(value); };
  return {in.angle,
          wide(in.current_b),
          wide(in.current_c),
          wide(in.electrical_speed),
          wide(in.reference_d),
          wide(in.reference_q),
          wide(in.supply)};
}

inline void print_precision(const std::string& instructions) {
  constexpr int ticks = 1'000'000;
  constexpr double tick = 50e-6;
  DcCurrentControllerConfig<float> dc_config;
  dc_config.torque_constant = 0.005F;
  dc_config.dead_time = 119e-9F;
  DcCurrentControllerConfig<double> dc_wide_config;
  dc_wide_config.torque_constant = static_cast<double>(dc_config.torque_constant);
  dc_wide_config.dead_time = 119e-9;
  FieldOrientedControllerConfig<float> config;
  config.torque_constant = 0.05F;
  config.pole_pairs = 7;
  config.dead_time = 119e-9F;
  FieldOrientedControllerConfig<double> wide_config;
  wide_config.torque_constant = static_cast<double>(config.torque_constant);
  wide_config.pole_pairs = 7;
  wide_config.dead_time = 119e-9;
  const auto dc_c = DcCurrentController<float>::prepare(dc_config, static_cast<float>(tick));
  const auto dc_wide_c = DcCurrentController<double>::prepare(dc_wide_config, tick);
  const auto c = FieldOrientedController<float>::prepare(config, static_cast<float>(tick));
  const auto wide_c = FieldOrientedController<double>::prepare(wide_config, tick);
  DcCurrentController<float> dc;
  DcCurrentController<double> dc_wide;
  FieldOrientedController<float> three;
  FieldOrientedController<double> three_wide;
  HardInputs inputs;
  double dc_error[2] = {}, error[2] = {};  // not saturated, saturated
  int dc_saturated = 0, saturated = 0, dc_other = 0, other = 0;
  for (int k = 0; k < ticks; ++k) {
    const auto in = inputs.next(k);
    const auto wide = widened(in);
    const auto a = dc.update(dc_c, in.reference_q, in.current_b, in.electrical_speed, in.supply);
    const auto b =
        dc_wide.update(dc_wide_c, wide.reference_q, wide.current_b, wide.electrical_speed, wide.supply);
    dc_saturated += b.saturated ? 1 : 0;
    dc_other += a.saturated != b.saturated ? 1 : 0;
    if (a.saturated == b.saturated)
      dc_error[b.saturated] =
          std::max(dc_error[b.saturated], std::fabs(static_cast<double>(a.duty_b) - b.duty_b));
    const auto d = three.update(c, in);
    const auto e = three_wide.update(wide_c, wide);
    saturated += e.saturated ? 1 : 0;
    other += d.saturated != e.saturated ? 1 : 0;
    if (d.saturated == e.saturated) {
      error[e.saturated] = std::max({error[e.saturated], std::fabs(static_cast<double>(d.duty_a) - e.duty_a),
                                     std::fabs(static_cast<double>(d.duty_b) - e.duty_b),
                                     std::fabs(static_cast<double>(d.duty_c) - e.duty_c)});
    }
  }
  std::vector<FieldOrientedController<float>::Input> many;
  std::vector<FieldOrientedController<double>::Input> many_wide;
  for (int k = 0; k < 1024; ++k) {
    many.push_back(inputs.next(k));
    many_wide.push_back(widened(many.back()));
  }
  volatile double sink = 0.0;
  const auto at = [](int k) { return static_cast<std::size_t>(k) % 1024; };
  const double times[] = {
      nanoseconds([&](int k) {
        const auto& in = many[at(k)];
        sink = static_cast<double>(
            dc.update(dc_c, in.reference_q, in.current_b, in.electrical_speed, in.supply).duty_b);
      }),
      nanoseconds([&](int k) {
        const auto& in = many_wide[at(k)];
        sink = dc_wide.update(dc_wide_c, in.reference_q, in.current_b, in.electrical_speed, in.supply).duty_b;
      }),
      nanoseconds([&](int k) { sink = static_cast<double>(three.update(c, many[at(k)]).duty_b); }),
      nanoseconds([&](int k) { sink = three_wide.update(wide_c, many_wide[at(k)]).duty_b; })};
  std::printf(
      "## Float against double\n\n%d ticks of hard inputs (steps, saturation, the supply's collapse), dead "
      "time and advance on; the largest\ndifference of a duty. One step of the timer is 2.4e-4. In "
      "saturation the q voltage is the root of what d leaves over:\nwhere that is next to nothing, rounding "
      "weighs most. \"Other verdict\": ticks in which only one of the two saturated;\nthey are not compared. "
      "Instructions: Cortex-M4F, the worst counted; in double the runtime library's are among them.\n\n```\n"
      "                     duty error  saturated  share of it  other verdict  float: instr.  ns  double: "
      "instr.  ns\n",
      ticks);
  std::printf("DC current step      %10.2e %10.2e %11.1f%% %14d %14d %3.0f %15d %3.0f\n", dc_error[0],
              dc_error[1], 100.0 * dc_saturated / ticks, dc_other,
              instructions_of(instructions, "DC current step   ", true), times[0],
              instructions_of(instructions, "DC current step in double", true), times[1]);
  std::printf("PMSM current step    %10.2e %10.2e %11.1f%% %14d %14d %3.0f %15d %3.0f\n```\n", error[0],
              error[1], 100.0 * saturated / ticks, other,
              instructions_of(instructions, "PMSM current step, ", true), times[2],
              instructions_of(instructions, "PMSM current step in double", true), times[3]);
}

}  // namespace kmax::benchmark
