#pragma once
// What becomes of a simulated handle in a linear wall: the force is computed from the handle's position at
// each sample, in double, and CoupledHandle moves under it.

#include <algorithm>
#include <array>
#include <cmath>

#include "control/sampled_loop.hpp"
#include "host_tools/simulation/coupled_handle.hpp"

namespace kmax::simulation {

// The delay of the loop is made by dividing each sample where the delayed force changes, or is the simulated
// device's own.
enum class Delay { divided_sample, of_the_device };

// Loops whose motion changes more slowly than this are not simulated, samples per factor e.
inline constexpr double longest_e_fold = 60'000.0;

enum class Fate { decays, grows, undecided };

// Runs until the largest excursion of a block of samples is a twentieth, or the twentyfold, of the first
// block's. Of `loop` period, delay and wall damping count: the handle is moving, and nobody moves it besides.
// `settling`: times samples_per_e_fold that pass before, for motions of which most dies away before the rest
// is seen to grow.
inline Fate fate_of(CoupledHandle handle, const control::SampledLoop<double>& loop, double stiffness,
                    double samples_per_e_fold, Delay delay, int settling = 0) {
  const int whole = static_cast<int>(std::floor(loop.delay / loop.period));
  const double late = loop.delay - whole * loop.period;
  // A ring; its size is a power of two, so that the index may wrap below 0.
  std::array<double, 16> under_way{};
  std::size_t newest = 0;
  const auto force_of = [&](int samples_ago) {
    return under_way[(newest - static_cast<std::size_t>(samples_ago)) % under_way.size()];
  };
  double last = handle.position();
  const auto sample = [&] {
    const double x = handle.position();
    under_way[++newest % under_way.size()] = -stiffness * x - loop.wall_damping * (x - last) / loop.period;
    last = x;
    if (delay == Delay::of_the_device) {
      handle.advance(force_of(0), 0.0, loop.period);
      return std::abs(x);
    }
    if (late > 0.0) handle.advance(force_of(whole + 1), 0.0, late);
    handle.advance(force_of(whole), 0.0, loop.period - late);
    return std::abs(x);
  };
  const int block = std::max(30, static_cast<int>(samples_per_e_fold * 0.2));
  for (int i = 0; i < static_cast<int>(samples_per_e_fold * settling); ++i) sample();
  double first = 0.0;
  for (int blocks = 0; blocks < 400; ++blocks) {
    double largest = 0.0;
    for (int i = 0; i < block; ++i) largest = std::max(largest, sample());
    if (blocks == 0) first = largest;
    if (!(largest < 20.0 * first)) return Fate::grows;
    if (largest < 0.05 * first) return Fate::decays;
  }
  return Fate::undecided;
}

}  // namespace kmax::simulation
