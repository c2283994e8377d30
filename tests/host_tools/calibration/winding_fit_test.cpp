// Records of the simulated motors, and records that no motor makes.
#include "host_tools/calibration/winding_fit.hpp"

#include <gtest/gtest.h>

#include <cstdio>
#include <limits>

#include "board/odrive_v3/description.hpp"
#include "host_tools/calibration/applied_voltage.hpp"
#include "host_tools/calibration/winding_excitation.hpp"
#include "tests/host_tools/calibration/motor_bench.hpp"

namespace kmax::calibration::winding_fit_test {

using test::BenchMotor;
using test::MotorBench;

struct Record {
  std::vector<double> voltage, current, supply;
  WindingRecord view() const { return {voltage, current, supply, {}}; }
};

double square(std::size_t k, int half_period) {
  return (k / static_cast<std::size_t>(half_period)) % 2 == 0 ? 1.0 : -1.0;
}

// `across`: the wave a quarter turn ahead of the bias.
Record run(MotorBench& bench, const WindingExcitation& wave, bool across) {
  Record record;
  const auto settling = static_cast<std::size_t>(wave.settling / test::tick);
  for (std::size_t k = 0; k < settling + wave.samples; ++k) {
    const double ramp = std::min(1.0, static_cast<double>(k) / (0.5 * static_cast<double>(settling) + 1.0));
    const double bias = ramp * wave.bias, alternation = ramp * wave.alternation * square(k, wave.half_period);
    const test::BenchSample sample = bench.sample();
    double current, applied;
    if (bench.motor().brushed()) {
      current = 0.5 * (sample.current_b - sample.current_c);
      applied = applied_brushed_voltage(board::odrive_v3::description, bias + alternation, sample.supply);
      bench.tick_with_voltage(bias + alternation, sample.supply);
    } else {
      const VoltageVector asked{across ? bias : bias + alternation, across ? alternation : 0.0};
      const test::VectorCurrent vector = test::current_at(sample, 0.0);
      const VoltageVector given = applied_vector(board::odrive_v3::description, asked, 0.0, sample.supply);
      current = across ? vector.q : vector.d;
      applied = across ? given.q : given.d;
      bench.tick_with_vector(asked.d, asked.q, 0.0, sample.supply);
    }
    if (k < settling) continue;
    record.current.push_back(current);
    record.voltage.push_back(applied);
    record.supply.push_back(sample.supply);
  }
  return record;
}

WindingFitConfig config_of(const BenchMotor& motor) {
  WindingFitConfig config;
  config.motion = motor.brushed() ? WindingMotion::free : WindingMotion::standing;
  config.switching_legs = motor.brushed() ? 2.0 : 4.0 / 3.0;
  return config;
}

WindingExcitation excitation_of(const BenchMotor& motor) {
  return motor.brushed()
             ? brushed_excitation(motor.resistance(), motor.inductance(), motor.current, test::tick)
             : vector_excitation(motor.resistance(), motor.inductance(), motor.current, test::tick);
}

std::string fit_words(const Record& record, const WindingFitConfig& config = {}) {
  const WindingRecord view[] = {record.view()};
  return to_string(fit_winding(view, config).finding);
}
WindingCause cause_of(const Record& record, const WindingFitConfig& config = {}) {
  const WindingRecord view[] = {record.view()};
  return fit_winding(view, config).finding.cause;
}

class WindingOfMotors : public testing::TestWithParam<std::size_t> {};

TEST_P(WindingOfMotors, ResistanceAndInductanceWithinThreePercent) {
  const BenchMotor motor = test::bench_motors()[GetParam()];
  double worst_resistance = 0.0, worst_inductance = 0.0, worst_across = 0.0;
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    // Somewhere else every time: another cogging position, another misalignment by friction.
    MotorBench bench(motor, seed, 1e-3 * static_cast<double>(seed));
    const WindingExcitation wave = excitation_of(motor);
    const Record along = run(bench, wave, false);
    std::vector<Record> records{along};
    if (motor.brushed()) {
      WindingExcitation low = wave;
      low.alternation *= 0.33;
      records.push_back(run(bench, low, false));
    }
    std::vector<WindingRecord> views;
    for (const Record& record : records) views.push_back(record.view());
    const WindingFit fit = fit_winding(views, config_of(motor));
    ASSERT_EQ(to_string(fit.finding), "");
    worst_resistance = std::max(worst_resistance, std::abs(fit.resistance.value / motor.resistance() - 1.0));
    worst_inductance = std::max(worst_inductance, std::abs(fit.inductance.value / motor.inductance() - 1.0));
    if (motor.brushed()) {
      // 2 legs x 24 V x 20 kHz x 125 ns
      EXPECT_NEAR(fit.dead_time_voltage.value, 0.12, 0.02);
      continue;
    }
    EXPECT_FALSE(fit.dead_time_voltage.known()) << "the phase currents keep their signs";

    WindingExcitation side =
        across_excitation(motor.resistance(), motor.inductance(), motor.current, test::tick);
    const Record fast = run(bench, side, true);
    side.half_period = winding_slow_half_period(side.half_period);
    const Record slow = run(bench, side, true);
    const WindingRecord q[] = {fast.view(), slow.view()};
    WindingFitConfig free = config_of(motor);
    free.motion = WindingMotion::free;
    free.fit_dead_time = false;
    free.known_resistance = fit.resistance;
    const WindingFit q_fit = fit_winding(q, free);
    ASSERT_EQ(to_string(q_fit.finding), "");
    worst_across = std::max(worst_across, std::abs(q_fit.inductance.value / motor.pmsm().inductance_q - 1.0));
  }
  std::printf("%s, worst of 20: R %.2f %%, L %.2f %%, L_q %.2f %%\n", motor.name.c_str(),
              100 * worst_resistance, 100 * worst_inductance, 100 * worst_across);
  EXPECT_LT(worst_resistance, 0.03);
  EXPECT_LT(worst_inductance, 0.03);
  EXPECT_LT(worst_across, 0.03);
}

INSTANTIATE_TEST_SUITE_P(WindingFit, WindingOfMotors, testing::Range<std::size_t>(0, 5));

TEST(WindingFit, APhaseThatIsOpenShowsNoCurrent) {
  for (const std::size_t m : {0u, 2u}) {
    const BenchMotor motor = test::bench_motors()[m];
    MotorBench bench(motor, 3);
    bench.drive().open_terminal(motor.brushed() ? 1 : 0, true);
    const Record record = run(bench, excitation_of(motor), false);
    EXPECT_EQ(cause_of(record, config_of(motor)), WindingCause::no_current);
  }
}

TEST(WindingFit, AnInvertedSensorIsCalledThat) {
  MotorBench bench(test::bench_motors()[0], 4);
  Record record = run(bench, excitation_of(bench.motor()), false);
  for (double& i : record.current) i = -i;
  EXPECT_EQ(cause_of(record, config_of(bench.motor())), WindingCause::current_inverted);
}

TEST(WindingFit, SupplyThatSagsDuringThePulseIsTakenIntoAccount) {
  BenchMotor motor = test::bench_motors()[0];
  motor.current = 3.0;
  motor.supply_resistance = 1.5;
  motor.supply_capacitance = 50e-6;
  MotorBench bench(motor, 5);
  const Record record = run(bench, excitation_of(motor), false);
  const WindingRecord view[] = {record.view()};
  const WindingFit fit = fit_winding(view, config_of(motor));
  EXPECT_EQ(to_string(fit.finding), "");
  EXPECT_NEAR(fit.resistance.value / motor.resistance(), 1.0, 0.03);
  EXPECT_NEAR(fit.inductance.value / motor.inductance(), 1.0, 0.03);
}

// A winding integrated in steps of 50 ns with the definition's equation, without the simulation's or the
// fit's closed forms.
Record fine_steps(double resistance, double inductance, double lost, int half_period, std::size_t samples,
                  double volts, double bias, std::uint64_t seed, double noise) {
  Record record;
  simulation::NoiseGenerator random(seed);
  double i = 0.0, before = 0.0;
  for (std::size_t k = 0; k < samples; ++k) {
    const double now = bias + volts * square(k, half_period);
    record.voltage.push_back(now);
    record.current.push_back(i + noise * random.gaussian());
    const double band = lost / (2.0 * 20e3 * inductance);
    for (int n = 0; n < 1000; ++n) {
      const double v = n < 500 ? before : now;
      const double dead = lost > 0.0 ? lost * std::clamp(i / band, -1.0, 1.0) : 0.0;
      i += 50e-9 / inductance * (v - dead - resistance * i);
    }
    before = now;
  }
  return record;
}

TEST(WindingFit, TimeConstantsFromAThirdOfATickToAHundred) {
  for (const double ticks : {0.3, 1.0, 3.0, 10.0, 30.0, 100.0}) {
    const double inductance = 4.0 * ticks * test::tick;
    const int half = winding_half_period(ticks * test::tick, test::tick);
    const Record high = fine_steps(4.0, inductance, 0.15, half, 4000, 4.0, 0.0, 1, 0.03);
    const Record low = fine_steps(4.0, inductance, 0.15, half, 4000, 1.5, 0.0, 2, 0.03);
    const WindingRecord views[] = {high.view(), low.view()};
    const WindingFit fit = fit_winding(views);
    ASSERT_EQ(to_string(fit.finding), "") << ticks;
    EXPECT_NEAR(fit.resistance.value, 4.0, 0.03 * 4.0) << ticks;
    EXPECT_NEAR(fit.inductance.value / inductance, 1.0, 0.03) << ticks;
    EXPECT_NEAR(fit.dead_time_voltage.value, 0.15, 0.05) << ticks;
    EXPECT_NEAR(fit.residual, 0.03, 0.003) << ticks;
  }
}

TEST(WindingFit, StandardErrorsAreWhatTheValuesScatter) {
  double squares = 0.0;
  constexpr int runs = 40;
  for (std::uint64_t seed = 1; seed <= runs; ++seed) {
    const Record record = fine_steps(4.0, 1e-3, 0.0, 15, 1000, 2.0, 3.0, seed, 0.03);
    const WindingRecord view[] = {record.view()};
    const WindingFit fit = fit_winding(view);
    ASSERT_EQ(to_string(fit.finding), "");
    squares += std::pow((fit.inductance.value - 1e-3) / fit.inductance.standard_error, 2);
  }
  EXPECT_NEAR(std::sqrt(squares / runs), 1.0, 0.35);
}

TEST(WindingFit, RecordsThatHoldNothingAreNamed) {
  EXPECT_EQ(fit_winding({}).finding.cause, WindingCause::too_little_data);
  const Record good = fine_steps(4.0, 1e-3, 0.0, 15, 400, 2.0, 0.0, 1, 0.03);
  Record bad = good;
  bad.current.pop_back();
  EXPECT_EQ(cause_of(bad), WindingCause::too_little_data);
  for (const std::size_t samples : {1u, 2u, 3u, 10u}) {
    EXPECT_EQ(cause_of(fine_steps(4.0, 1e-3, 0.0, 15, samples, 2.0, 0.0, 1, 0.03)),
              WindingCause::too_little_data);
  }
  for (const double wrong :
       {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity()}) {
    bad = good;
    bad.current[217] = wrong;
    const WindingRecord view[] = {bad.view()};
    const WindingFit fit = fit_winding(view);
    EXPECT_EQ(fit.finding.cause, WindingCause::not_finite);
    EXPECT_EQ(fit.finding.found, 217.0);
    bad = good;
    bad.voltage[3] = wrong;
    EXPECT_EQ(cause_of(bad), WindingCause::not_finite);
  }
  EXPECT_EQ(cause_of(fine_steps(4.0, 1e-3, 0.0, 15, 400, 0.0, 3.0, 1, 0.03)), WindingCause::no_alternation);
  bad = good;
  bad.supply.assign(bad.voltage.size(), 2.1);
  EXPECT_EQ(cause_of(bad), WindingCause::supply_saturated);
  bad.supply.assign(bad.voltage.size(), 0.0);
  EXPECT_EQ(cause_of(bad), WindingCause::supply_saturated);
}

TEST(WindingFit, CurrentsThatAreNotAWindingsAreNamed) {
  simulation::NoiseGenerator random(7);
  Record record = fine_steps(4.0, 1e-3, 0.0, 15, 2000, 2.0, 0.0, 1, 0.0);
  const Record good = record;
  for (double& i : record.current) i = 0.03 * random.gaussian();
  EXPECT_EQ(cause_of(record), WindingCause::no_current);
  for (double& i : record.current) i = 0.0;
  EXPECT_EQ(cause_of(record), WindingCause::no_current);
  for (double& i : record.current) i = 2.5 + 0.03 * random.gaussian();
  EXPECT_EQ(cause_of(record), WindingCause::current_constant);
  for (double& i : record.current) i = 2.5;
  EXPECT_EQ(cause_of(record), WindingCause::current_constant);
  for (double& i : record.current) i = random.gaussian();
  EXPECT_EQ(cause_of(record), WindingCause::current_constant);
  // A wire that loses contact every now and then.
  record = good;
  for (std::size_t k = 0; k < record.current.size(); ++k) record.current[k] *= (k / 37) % 3 == 0 ? 0.0 : 1.0;
  EXPECT_EQ(cause_of(record), WindingCause::bad_fit);
}

TEST(WindingFit, OnePeriodOnlyGivesAResultOrSaysWhyNot) {
  const Record record = fine_steps(4.0, 1e-3, 0.0, 30, 60, 4.0, 0.0, 1, 0.03);
  const WindingRecord view[] = {record.view()};
  const WindingFit fit = fit_winding(view);
  if (fit.finding.is_none()) {
    EXPECT_NEAR(fit.resistance.value, 4.0, 5.0 * fit.resistance.standard_error);
    EXPECT_NEAR(fit.inductance.value, 1e-3, 5.0 * fit.inductance.standard_error);
  } else {
    EXPECT_EQ(fit.finding.cause, WindingCause::not_resolved);
  }
}

TEST(WindingFit, EveryCauseHasWordsAndTheNumbersFollow) {
  for (int n = 1; n <= static_cast<int>(WindingCause::bad_fit); ++n)
    EXPECT_GT(to_string(static_cast<WindingCause>(n)).size(), 20u);
  EXPECT_EQ(to_string(WindingCause::none), "");
  const Record still = fine_steps(4.0, 1e-3, 0.0, 15, 400, 0.0, 3.0, 1, 0.03);
  EXPECT_NE(fit_words(still).find("found 0 V, bound 0.001 V"), std::string::npos) << fit_words(still);
}

}  // namespace kmax::calibration::winding_fit_test
