// Counts the instructions of each step of the interrupt path over inputs that reach its branches, prints the
// worst ones beside their budgets, and exits with 1 when one is above it.
#include <cstdint>

#include "tests/benchmarks/instruction_budget/fingerprint.hpp"
#include "tests/benchmarks/instruction_budget/inputs.hpp"
#include "tests/benchmarks/instruction_budget/machine.hpp"
#include "tests/benchmarks/instruction_budget/steps.hpp"

namespace kmax::instruction_budget {
namespace {

using namespace control;

constexpr float period = 5e-5F;
constexpr float dead_time = 119e-9F;

Inputs inputs;

void print_number(std::uint32_t value, int width) {
  char text[12];
  int at = 11;
  text[at] = '\0';
  do {
    text[--at] = static_cast<char>('0' + value % 10);
    value /= 10;
  } while (value != 0);
  while (at > 11 - width) text[--at] = ' ';
  print(text + at);
}

std::uint32_t overhead = 0;

std::uint32_t count(const Registers& arguments, auto* function) {
  return counted_call(arguments, reinterpret_cast<void (*)()>(function)) - overhead;
}

bool within = true;

/// Of all calls of a step; one of them is the usual one.
struct Counts {
  std::uint32_t usual = 0, worst = 0;
  void add(std::uint32_t counted, bool is_usual) {
    if (is_usual) usual = counted;
    if (counted > worst) worst = counted;
  }
};

void report(const char* step, const Counts& counts, std::uint32_t budget) {
  const std::uint32_t worst = counts.worst;
  print(step);
  print_number(counts.usual, 7);
  print_number(worst, 7);
  if (budget == 0) {
    print("      -\n");
    return;
  }
  print_number(budget, 7);
  print(worst <= budget ? "\n" : "  TOO MANY\n");
  if (worst > budget) within = false;
}

void measure_wall(const char* name, WallKind kind, float touch_stiffness, std::uint32_t budget) {
  static Wall wall;
  static Wall::Output out;
  Counts counts;
  for (int i = 0; i < 20000; ++i) {
    WallLawConfig<float> config;
    config.kind = kind;
    config.damping = (inputs.random() & 1U) != 0 ? 5.0F : 0.0F;
    config.growing.touch_stiffness = touch_stiffness;
    if (i > 0) {
      config.adaptive.relation = static_cast<AdaptiveRelation>(inputs.random() % 3);
      config.adaptive.velocity = static_cast<AdaptiveVelocity>(inputs.random() % 2);
      config.adaptive.mode = static_cast<AdaptiveMode>(inputs.random() % 3);
    }
    if (i % 64 == 0) wall.reset();
    const auto c = Wall::prepare(config, period);
    const Registers arguments{{&out, &wall, &c},
                              {inputs.hard(0.002F * inputs.unit()), inputs.hard(3.0F * inputs.unit())}};
    counts.add(count(arguments, &wall_step), i == 0);
  }
  report(name, counts, budget);
}

/// In contact, with a hand that moves; once asleep; and what a turn adds to it.
void measure_instability() {
  static Instability detector;
  const auto c = Instability::prepare({});
  Counts awake, asleep, turn;
  for (int i = 0; i < 60000; ++i) {
    const bool touched = i / 10000 % 2 == 0;
    const auto angle = static_cast<std::uint32_t>(i) * 20000000U;
    const float displacement = 4e-4F * sine_cosine<float>(angle).sine;
    const float force = touched ? 2.0F - 4000.0F * displacement : 0.0F;
    const Registers arguments{{&detector, &c}, {displacement, force}};
    const std::uint32_t counted = count(arguments, &instability_step);
    // A turn at every 107th sample or so, far above the others; it takes a period to fall asleep.
    if (touched) {
      (counted > 70 ? turn : awake).add(counted, true);
    } else if (i % 10000 > 2000) {
      asleep.add(counted, true);
    }
  }
  report("instability detector in free space     ", asleep, 20);
  report("instability detector in contact        ", awake, 60);
  report("instability detector, a turn           ", turn, 0);
}

template <typename Counter>
void measure_position(const char* name,
                      void (*step)(Position<Counter>&, const PositionCoefficients&, PositionOutput&,
                                   std::uint32_t),
                      VelocityEstimatorKind kind, std::uint32_t budget) {
  static Position<Counter> position;
  static PositionOutput out;
  Counts counts;
  for (const std::int32_t quantum : {1, 7, 550}) {
    for (const Rounding rounding : {Rounding::nearest, Rounding::floor, Rounding::hysteresis}) {
      VelocityEstimatorConfig<float> config;
      config.kind = kind;
      const PositionCoefficients c{Resampler::prepare({quantum, rounding}, 0),
                                   Velocity::prepare(config, period, 1e-7F, quantum)};
      position.extender.reset(0);
      position.resampler.reset();
      position.velocity.reset(0);
      Path path;
      for (int i = 0; i < 12000; ++i) {
        const auto raw = static_cast<std::int32_t>(path.next(inputs) * static_cast<float>(quantum));
        Registers arguments{{&position, &c, &out, nullptr}, {}};
        arguments.integers[3] = reinterpret_cast<const void*>(static_cast<std::intptr_t>(raw));
        const std::uint32_t counted = count(arguments, step);
        // The first sample of a grid is not the tick's worst case: it comes once.
        if (i > 0) counts.add(counted, i == 63 && quantum == 7 && rounding == Rounding::nearest);
      }
    }
  }
  report(name, counts, budget);
}

/// Usual: the mean. Motions of every speed, as for FOAW above.
template <typename Candidate>
void measure_candidate(const char* name, std::uint32_t budget) {
  static Candidate candidate;
  Inputs same;
  Path path;
  Counts counts;
  std::uint32_t sum = 0;
  std::int32_t last = 0;
  constexpr std::int32_t samples = 36'000;
  for (std::int32_t i = 0; i < samples; ++i) {
    const auto place = static_cast<std::int32_t>(path.next(same));
    Registers arguments{{&candidate, reinterpret_cast<const void*>(static_cast<std::intptr_t>(place - last))},
                        {}};
    last = place;
    const std::uint32_t counted = count(arguments, &candidate_step<Candidate>);
    counts.add(counted, false);
    sum += counted;
  }
  counts.usual = sum / samples;
  report(name, counts, budget);
}

void measure_haptic() {
  static Haptic loop;
  Counts counts;
  HapticLoopConfig<float> config;
  config.wall.kind = WallKind::adaptive;
  config.count_length = 1e-7;
  config.position_resolution = 7e-7;
  config.force.slew_limit = 1000.0F;
  const auto c = Haptic::prepare(config, 0);
  Path path;
  for (int i = 0; i < 20000; ++i) {
    // r0 loop, r1 coefficients, r2 and r3 the count.
    const auto position = static_cast<std::int32_t>(path.next(inputs) * 7.0F);
    Registers arguments{{&loop, &c, nullptr, nullptr}, {}};
    arguments.integers[2] = reinterpret_cast<const void*>(static_cast<std::intptr_t>(position));
    arguments.integers[3] = reinterpret_cast<const void*>(static_cast<std::intptr_t>(position >> 31));
    const std::uint32_t counted = count(arguments, &haptic_step);
    if (i > 0) counts.add(counted, i == 63);
  }
  report("haptic tick, adaptive wall, resampled  ", counts, 0);
}

void measure_dc() {
  static Dc dc;
  static Dc::Output out;
  DcCurrentControllerConfig<float> config;
  config.dead_time = dead_time;
  config.torque_constant = 0.05F;
  const auto c = Dc::prepare(config, period);
  Counts counts;
  for (int i = 0; i < 50000; ++i) {
    if (i % 100 == 0) dc.reset();
    const float size = (i / 100) % 2 == 0 ? 1.0F : 50.0F;
    const Registers arguments{
        {&out, &dc, &c},
        {i == 0 ? 0.1F : inputs.hard(size * inputs.unit()), i == 0 ? 0.0F : inputs.hard(size * inputs.unit()),
         i == 0 ? 0.0F : inputs.hard(100.0F * inputs.unit()),
         i == 0 ? 24.0F : inputs.hard(24.0F + 12.0F * inputs.unit())}};
    counts.add(count(arguments, &dc_step), i == 0);
  }
  report("DC current step                        ", counts, 45);
}

void measure_field_oriented() {
  static FieldOriented controller;
  static FieldOriented::Output out;
  FieldOriented::Input in;
  FieldOrientedControllerConfig<float> config;
  config.dead_time = dead_time;
  config.torque_constant = 0.05F;
  config.pole_pairs = 7;
  const auto c = FieldOriented::prepare(config, period);
  Counts counts;
  for (int i = 0; i < 50000; ++i) {
    if (i % 100 == 0) controller.reset();
    const float size = (i / 100) % 2 == 0 ? 1.0F : 50.0F;
    in = {inputs.random(),
          inputs.hard(size * inputs.unit()),
          inputs.hard(size * inputs.unit()),
          inputs.hard(1000.0F * inputs.unit()),
          inputs.hard(size * inputs.unit()),
          inputs.hard(size * inputs.unit()),
          inputs.hard(24.0F + 12.0F * inputs.unit())};
    if (i == 0) in = {0x12345678U, 0.1F, 0.1F, 10.0F, 0.0F, 0.2F, 24.0F};
    Registers arguments{
        {&out, &controller, &c, nullptr},
        {in.current_b, in.current_c, in.electrical_speed, in.reference_d, in.reference_q, in.supply}};
    arguments.integers[3] = reinterpret_cast<const void*>(in.angle);
    counts.add(count(arguments, &field_oriented_step), i == 0);
  }
  report("PMSM current step, sine and cosine in  ", counts, 150);
}

void measure_small_steps() {
  static Transmission::Output out;
  const auto c = Transmission::prepare({});
  Counts counts;
  for (int i = 0; i < 5000; ++i) {
    const Registers arguments{{&out, &c}, {i == 0 ? 1.0F : inputs.hard(40.0F * inputs.unit())}};
    counts.add(count(arguments, &transmission_step), i == 0);
  }
  report("force to current                       ", counts, 0);
}

void measure_sine(const char* name, control::SineCosine<float> (*step)(std::uint32_t)) {
  Counts counts;
  for (int i = 0; i < 5000; ++i) {
    Registers arguments;
    arguments.integers[0] = reinterpret_cast<const void*>(i == 0 ? 0x12345678U : inputs.random());
    counts.add(count(arguments, step), i == 0);
  }
  report(name, counts, 0);
}

void measure_double() {
  static DcDouble dc;
  DcCurrentControllerConfig<double> dc_config;
  dc_config.torque_constant = 0.05;
  dc_config.dead_time = 119e-9;
  const auto dc_c = DcDouble::prepare(dc_config, 5e-5);
  static FieldOrientedDouble controller;
  FieldOrientedControllerConfig<double> config;
  config.torque_constant = 0.05;
  config.pole_pairs = 7;
  config.dead_time = 119e-9;
  const auto c = FieldOrientedDouble::prepare(config, 5e-5);
  Counts dc_counts, counts;
  static DcDouble::Output dc_out;
  static FieldOrientedDouble::Output out;
  const auto number = [](float scale) { return static_cast<double>(scale * inputs.unit()); };
  for (int i = 0; i < 2000; ++i) {
    const DcDoubleInput two = {number(1.0F), number(1.0F), number(100.0F), 24.0 + number(12.0F)};
    dc_counts.add(count(Registers{{&dc, &dc_c, &two, &dc_out}, {}}, &dc_double_step), i == 0);
    const FieldOrientedDouble::Input three = {inputs.random(),     number(1.0F), number(1.0F),
                                              number(1000.0F),     0.0,          number(1.0F),
                                              24.0 + number(12.0F)};
    counts.add(count(Registers{{&controller, &c, &three, &out}, {}}, &field_oriented_double_step), i == 0);
  }
  report("DC current step in double              ", dc_counts, 0);
  report("PMSM current step in double            ", counts, 0);
}

}  // namespace
}  // namespace kmax::instruction_budget

int main() {
  using namespace kmax::instruction_budget;
  using Kind = kmax::control::VelocityEstimatorKind;
  start_counter();
  // An empty function is its return alone, which counts.
  overhead = count(Registers{}, &nothing_step) - 1;
  print("Executed instructions, Cortex-M4F       usual  worst budget\n");
  measure_wall("adaptive wall law                      ", kmax::control::WallKind::adaptive, 0.0F, 125);
  measure_wall("adaptive wall law that grows           ", kmax::control::WallKind::adaptive, 300.0F, 145);
  measure_wall("magnetic wall law                      ", kmax::control::WallKind::magnetic, 0.0F, 0);
  measure_instability();
  measure_position("32-bit position, FOAW best fit         ", &position32_step, Kind::foaw, 235);
  measure_position("16-bit position, FOAW best fit         ", &position16_step, Kind::foaw, 235);
  measure_position("32-bit position, FOAW end fit          ", &position32_step, Kind::foaw_end_fit, 240);
  measure_position("32-bit position, tracking              ", &position32_step, Kind::tracking, 0);
  measure_position("32-bit position, edge period           ", &position32_step, Kind::edge_period, 205);
  measure_position("32-bit position without velocity       ", &resample_step, Kind::foaw, 0);
  print("Velocity estimators alone, as docs/velocity_estimators.md compares them: mean and worst\n");
  measure_candidate<kmax::studies::HeldFoaw<1>>("alone: FOAW                            ", 0);
  measure_candidate<kmax::studies::HeldFoaw<2>>("alone: FOAW of every second sample     ", 0);
  measure_candidate<kmax::studies::TwoCones<16>>("alone: two cones                       ", 0);
  measure_candidate<kmax::studies::IntervalTracking>("alone: interval tracking               ", 0);
  measure_candidate<kmax::studies::EdgePeriod<16>>("alone: edge period, 16 samples         ", 125);
  measure_candidate<kmax::studies::EdgePeriod<8>>("alone: edge period, 8 samples          ", 0);
  measure_haptic();
  measure_dc();
  measure_field_oriented();
  measure_small_steps();
  measure_sine("sine and cosine: nearest entry         ", &sine_cosine_nearest_step);
  measure_sine("sine and cosine: first order           ", &sine_cosine_first_order_step);
  measure_sine("sine and cosine: second order          ", &sine_cosine_step);
  measure_sine("sine and cosine: polynomial            ", &sine_cosine_polynomial_step);
  measure_double();
  const std::uint32_t fingerprint = Fingerprint{}.of_all();
  print("Fingerprint of the results ");
  print_number(fingerprint, 0);
  if (fingerprint == known_fingerprint) {
    print(", as on x86\n");
  } else {
    print(", not the known one: see fingerprint.hpp\n");
    within = false;
  }
  return within ? 0 : 1;
}
