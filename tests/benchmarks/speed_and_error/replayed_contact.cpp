#include "tests/benchmarks/speed_and_error/replayed_contact.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>

#include "control/haptic_loop.hpp"
#include "host_tools/simulation/coupled_handle.hpp"
#include "tests/benchmarks/speed_and_error/measurement.hpp"
#include "tests/host_tools/simulation/reference_handle.hpp"

namespace kmax::benchmark {
namespace {

using simulation::CoupledHandle;
using Loop = control::HapticLoop<float>;

constexpr double quantum = 0.055e-3;  // m per count, as the papers' device
constexpr double trial_time = 1.5;    // s

simulation::IntendedMotionConfig motion() {
  simulation::IntendedMotionConfig motion;
  motion.start_position = 0.01;
  motion.hold_time = 100.0;
  return motion;
}

CoupledHandle held_handle(const Method& method) {
  CoupledHandle handle(simulation::DeviceModel{}, simulation::OperatorModel{}, motion());
  handle.set_integrator(method.integrator);
  if (method.table) handle.share(method.table);
  handle.begin_motion();
  return handle;
}

simulation::ReferenceHandle reference_handle() {
  return {simulation::DeviceModel{}, simulation::OperatorModel{}, motion()};
}

// `advance(force, background)` goes on by one period and returns the handle's position.
template <typename Advance>
ContactTrial run(const ContactScene& scene, Advance advance) {
  control::HapticLoopConfig<float> config;
  config.count_length = quantum;
  config.tick_rate = scene.rate;
  config.wall.kind = control::WallKind::magnetic;
  config.wall.stiffness = static_cast<float>(scene.stiffness);
  config.wall.magnetic_coefficient = static_cast<float>(scene.magnetic_coefficient);
  config.force.limit = 3.3F;
  config.force.ramp_time = 0.0F;
  const Loop::Coefficients coefficients = Loop::prepare(config, 0);
  Loop loop;
  ContactTrial trial;
  trial.period = 1.0 / scene.rate;
  double position = motion().start_position;
  for (long n = 0; n < std::lround(trial_time * scene.rate); ++n) {
    const auto count = static_cast<std::int64_t>(std::floor(position / quantum));
    const Loop::Output& out = loop.tick(coefficients, count, true);
    trial.force.push_back(static_cast<double>(out.force));
    trial.background.push_back(static_cast<double>(out.magnetic_force));
    position = advance(trial.force.back(), trial.background.back());
    trial.position.push_back(position);
  }
  return trial;
}

}  // namespace

std::shared_ptr<simulation::PropagatorTable> empty_table() {
  return std::make_shared<simulation::PropagatorTable>(simulation::DeviceModel{},
                                                       simulation::OperatorModel{});
}

ContactTrial reference_trial(const ContactScene& scene) {
  simulation::ReferenceHandle handle = reference_handle();
  const int pieces = static_cast<int>(std::lround(1.0 / scene.rate / 10e-6));
  return run(scene, [&](double force, double background) {
    for (int n = 0; n < pieces; ++n) handle.advance(force, background, 1.0 / scene.rate / pieces);
    return static_cast<double>(handle.position());
  });
}

std::vector<double> reference_positions(const ContactTrial& trial) {
  simulation::ReferenceHandle handle = reference_handle();
  std::vector<double> positions;
  for (std::size_t n = 0; n < trial.force.size(); ++n) {
    handle.advance(trial.force[n], trial.background[n], trial.period);
    positions.push_back(static_cast<double>(handle.position()));
  }
  return positions;
}

ContactTrial closed_loop_trial(const ContactScene& scene, const Method& method) {
  CoupledHandle handle = held_handle(method);
  return run(scene, [&](double force, double background) {
    handle.advance(force, background, 1.0 / scene.rate);
    return handle.position();
  });
}

void replay(const ContactTrial& trial, const Method& method, std::vector<double>& positions) {
  CoupledHandle handle = held_handle(method);
  for (std::size_t n = 0; n < trial.force.size(); ++n) {
    handle.advance(trial.force[n], trial.background[n], trial.period);
    positions[n] = handle.position();
  }
}

double root_mean_square_distance(const std::vector<double>& a, const std::vector<double>& b) {
  ErrorStatistics errors;
  for (std::size_t n = 0; n < a.size() && n < b.size(); ++n) errors.add(a[n] - b[n]);
  return errors.root_mean_square();
}

double peak_to_peak(const ContactTrial& trial) {
  const auto samples = static_cast<std::ptrdiff_t>(std::lround(0.5 / trial.period));
  const auto [low, high] = std::minmax_element(trial.position.end() - samples, trial.position.end());
  return *high - *low;
}

}  // namespace kmax::benchmark
