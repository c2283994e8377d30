#include "host_tools/experiment/touch_price.hpp"

#include <algorithm>

#include "host_tools/experiment/rate_hardness.hpp"

namespace kmax::experiment {
namespace {

/// Of a handle that rests on the surface, until whatever was held has decayed.
double field_at_rest(const TouchSetup& setup) {
  using FloatLoop = control::HapticLoop<float>;
  const FloatLoop::Coefficients coefficients = FloatLoop::prepare(setup.wall, 0);
  FloatLoop loop;
  for (int n = 0; n < 5000; ++n) loop.tick(coefficients, 0, true);
  return static_cast<double>(loop.output().magnetic_force);
}

double rate_hardness_of(const std::vector<TouchSample>& touch, double rate) {
  const auto contact = std::ranges::find_if(
      touch, [](double position) { return position <= 0.0; }, &TouchSample::position);
  if (contact == touch.end()) return 0.0;
  std::vector<ContactForce> trace;
  const auto first = contact - touch.begin();
  for (std::ptrdiff_t n = 0; n < std::ssize(touch); ++n)
    trace.push_back({static_cast<double>(n - first) / rate, touch[n].position, touch[n].force});
  return rate_hardness(trace, -contact->velocity).value_or(0.0);
}

}  // namespace

TouchPrice price_of(const TouchSetup& setup) {
  std::vector<TouchSample> touch;
  simulate_touch(setup, &touch);
  TouchPrice price;
  bool touched = false;
  for (std::size_t n = 0; n < touch.size(); ++n) {
    price.depth = std::max(price.depth, -touch[n].position);
    touched = touched || touch[n].position <= 0.0;
    price.peak_force = std::max(price.peak_force, touch[n].force);
    if (n == 0) continue;
    const double work = touch[n - 1].force * (touch[n - 1].position - touch[n].position);
    price.touch_work += work;
    if (!touched) price.work += work;
  }
  price.rate_hardness = rate_hardness_of(touch, setup.wall.tick_rate);
  price.field_at_rest = field_at_rest(setup);
  return price;
}

}  // namespace kmax::experiment
