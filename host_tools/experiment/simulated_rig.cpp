#include "host_tools/experiment/simulated_rig.hpp"

#include <cmath>
#include <optional>
#include <utility>

#include "host_tools/experiment/setting_check.hpp"
#include "host_tools/simulation/coupled_handle.hpp"
#include "host_tools/simulation/encoder_config.hpp"

namespace kmax::experiment {
namespace {
constexpr double approach_patience = 30.0;  // s
constexpr double approach_distance = 0.02;  // m

control::HapticLoopConfig<float> loop_of(const RigWall& wall, const SimulatedHands& hands) {
  control::HapticLoopConfig<float> config =
      touched_wall(wall.haptic_rate, hands.count_length, hands.device.force_limit);
  config.wall.kind = wall.law;
  config.wall.magnetic_coefficient = static_cast<float>(wall.magnetic_coefficient);
  config.wall.adaptive.mode = wall.mode;
  config.wall.stiffness = static_cast<float>(wall.stiffness);
  config.position_resolution = wall.resolution;
  config.position_rounding = wall.rounding;
  config.interference.mode = wall.interference;
  config.interference.force = static_cast<float>(wall.force);
  config.interference.background_force = static_cast<float>(wall.background_force);
  return config;
}
}  // namespace

SimulatedRig::SimulatedRig(const char* experiment, std::vector<simulation::OperatorModel> people,
                           const SimulatedHands& hands)
    : experiment_(experiment), people_(std::move(people)), hands_(hands) {
  const SettingCheck check(experiment);
  check.require_somebody(people_);
  check("count length", hands.count_length, 1e-9, 1e-2);
  check("reaction", hands.reaction, 0.0, 1.0);
  check("waiting time", hands.waiting_time, 0.0, 1000.0);
}

void SimulatedRig::set(const RigWall& wall) {
  const SettingCheck check(experiment_);
  check("stiffness", wall.stiffness, 1.0, 1e6);
  check("haptic rate", wall.haptic_rate, 10.0, 1e6);
  check("resolution", wall.resolution, 0.0, 0.1);
  wall_ = wall;
}

double SimulatedRig::resolution_step() {
  return control::resampler_step(wall_.resolution, hands_.count_length) * hands_.count_length;
}

TouchSetup SimulatedRig::setup_of(const TouchPlan& plan) const {
  TouchSetup setup;
  setup.device = hands_.device;
  setup.person = people_.at(plan.person);
  setup.threshold = plan.threshold;
  setup.motion.hold_time = plan.hold_time;
  setup.motion.approach_speed = plan.approach_speed;
  setup.motion.push_force = plan.push;
  setup.motion.start_position = approach_distance + plan.phase * plan.approach_speed / wall_.haptic_rate;
  setup.wall = loop_of(wall_, hands_);
  return setup;
}

RigTouch SimulatedRig::hold(const TouchPlan& plan) {
  if (plan.wall) set(*plan.wall);
  if (!(plan.threshold > 0.0)) return record(plan);
  const TouchOutcome outcome = simulate_touch(setup_of(plan));
  RigTouch touch;
  touch.judgement.verdict = outcome.verdict;
  touch.judgement.peak_to_peak = outcome.peak_to_peak;
  touch.judgement.deepest = outcome.deepest;
  touch.touched = outcome.verdict != simulation::ContactVerdict::no_contact;
  touch.speed = plan.approach_speed;
  return touch;
}

RigTouch SimulatedRig::record(const TouchPlan& plan) const {
  const double period = 1.0 / wall_.haptic_rate;
  const bool parallel = wall_.interference == control::InterferenceMode::parallel;
  simulation::IntendedMotionConfig motion, still;
  motion.start_position = approach_distance + plan.phase * hands_.approach_speed * period;
  motion.approach_speed = hands_.approach_speed;
  motion.push_force = hands_.push;
  motion.hold_time = plan.hold_time + 60.0;  // longer than anything that is recorded
  still.start_position = 0.0;  // begin_motion() is never called: the person intends to stay there
  simulation::CoupledHandle normal(hands_.device, people_.at(plan.person), motion);
  std::optional<simulation::CoupledHandle> tangential;
  if (parallel) tangential.emplace(hands_.device, people_.at(plan.person), still);

  const simulation::EncoderModel encoder(hands_.count_length);
  using Loop = control::HapticLoop<float>;
  RigWall wall = wall_;
  const auto prepared = [&] {
    return Loop::prepare(loop_of(wall, hands_), encoder.extended_counts(motion.start_position));
  };
  Loop::Coefficients coefficients = prepared();
  Loop loop;

  RigTouch touch;
  std::uint64_t touched_at = 0, inside = 0, beyond = 0, since_touch = 0;
  bool moving = false;
  double begin = 0.0;  // s, of the touch
  // The sample at the end of one with changes is no part of it.
  const double length = plan.hold_time - (plan.changes.empty() ? 0.0 : 0.5 * period);
  for (std::uint64_t n = 0;; ++n) {
    const double time = static_cast<double>(n) * period;
    if (!moving && time >= hands_.waiting_time) {
      normal.begin_motion();
      moving = true;
    }
    if (touch.touched ? time > begin + length : time > hands_.waiting_time + approach_patience) break;
    for (const double since = static_cast<double>(n - touched_at) * period;
         touch.touched && touch.change_times.size() < plan.changes.size();) {
      const ForceChange& next = plan.changes[touch.change_times.size()];
      if (since < next.time) break;
      (next.of == ForceChange::Of::interference ? wall.force : wall.background_force) = next.force;
      coefficients = prepared();
      touch.change_times.push_back(next.time - 0.5 * period);
    }
    const Loop::Output& out = loop.tick(coefficients, encoder.extended_counts(normal.position()), true);
    if (moving && !touch.touched && out.inside) {
      touch.touched = true;
      touched_at = n;
      begin = time;
    }
    const auto force = static_cast<double>(out.force), along = static_cast<double>(out.tangential_force);
    const double place = tangential ? static_cast<double>(encoder.extended_counts(tangential->position())) *
                                          hands_.count_length
                                    : 0.0;
    if (moving)
      touch.samples.push_back({time, static_cast<double>(out.outside_distance), force, place, along});
    if (touch.touched) {
      ++since_touch;
      inside += out.inside ? 1 : 0;
      beyond +=
          std::abs(force) > paper::touch_force_limit || std::abs(along) > paper::touch_force_limit ? 1 : 0;
    }
    const Resisted resisted = resisted_force(loop, coefficients, hands_.reaction);
    const auto advance = [&](simulation::CoupledHandle& handle, double commanded) {
      handle.resist_across(resisted.across);
      handle.advance(commanded, resisted.along, period);
    };
    advance(normal, force);
    if (tangential) advance(*tangential, along);
  }
  if (!touch.touched) return touch;
  for (RigSample& sample : touch.samples) sample.time -= begin;
  touch.contact_share = static_cast<double>(inside) / static_cast<double>(since_touch);
  touch.beyond_limit_share = static_cast<double>(beyond) / static_cast<double>(since_touch);
  return touch;
}

}  // namespace kmax::experiment
