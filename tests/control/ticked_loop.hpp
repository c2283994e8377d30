#pragma once
// A haptic loop with its coefficients, ticked count by count, and the wall that its tests begin with.

#include <cstdint>

#include "control/haptic_loop.hpp"

namespace kmax::control::haptic_loop_test {

// A plain wall without soft start, sampled at every tick.
template <typename Scalar>
HapticLoopConfig<Scalar> plain_wall() {
  HapticLoopConfig<Scalar> config;
  config.count_length = 1e-6;
  config.wall.kind = WallKind::plain;
  config.wall.stiffness = Scalar(1000);
  config.force.limit = Scalar(1e6);
  config.force.ramp_time = Scalar(0);
  return config;
}

template <typename Scalar>
class Loop {
 public:
  explicit Loop(const HapticLoopConfig<Scalar>& config, std::int64_t near = 0)
      : coefficients_(HapticLoop<Scalar>::prepare(config, near)) {}
  const typename HapticLoop<Scalar>::Output& at(std::int64_t count, bool enabled = true,
                                                Scalar external = Scalar(0)) {
    return loop_.tick(coefficients_, count, enabled, external);
  }
  HapticLoop<Scalar>& loop() { return loop_; }

 private:
  typename HapticLoop<Scalar>::Coefficients coefficients_;
  HapticLoop<Scalar> loop_;
};

}  // namespace kmax::control::haptic_loop_test
