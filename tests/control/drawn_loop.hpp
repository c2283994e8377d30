#pragma once
// Random sampled loops: what desktop devices, hands and controllers span, and more. The seed is the caller's.

#include <cmath>
#include <random>

#include "control/sampled_loop.hpp"

namespace kmax::control {

class LoopDraw {
 public:
  explicit LoopDraw(unsigned seed) : random_(seed) {}

  double uniform(double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(random_);
  }
  double log_uniform(double low, double high) { return std::exp(uniform(std::log(low), std::log(high))); }
  bool coin() { return uniform(0.0, 1.0) < 0.5; }

  Hand<double> hand() {
    return {log_uniform(0.05, 1.0), log_uniform(50.0, 5000.0), log_uniform(0.2, 10.0),
            log_uniform(10.0, 1000.0), log_uniform(1.0, 40.0)};
  }

  // Mass, damping, period; then by a coin each: a hand, a delay of up to 8 samples (a third of them whole),
  // wall damping of either sign.
  SampledLoop<double> loop() {
    SampledLoop<double> drawn;
    drawn.mass = log_uniform(0.01, 1.0);
    drawn.damping = drawn.mass * log_uniform(0.3, 100.0);
    drawn.period = log_uniform(5e-5, 4e-3);
    if (coin()) drawn.hand = hand();
    if (coin()) {
      const double samples = uniform(0.0, 8.0);
      drawn.delay = drawn.period * (uniform(0.0, 1.0) < 0.3 ? std::floor(samples) : samples);
    }
    if (coin()) drawn.wall_damping = drawn.damping * uniform(-0.7, 2.0);
    return drawn;
  }

 private:
  std::mt19937 random_;
};

}  // namespace kmax::control
