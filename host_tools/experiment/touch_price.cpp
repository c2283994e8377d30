#include "host_tools/experiment/touch_price.hpp"

#include <algorithm>
#include <cmath>

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

double rate_hardness(const std::vector<TouchSample>& touch, double rate) {
  const auto inside = [](const TouchSample& sample) { return sample.position <= 0.0; };
  const auto contact = std::find_if(touch.begin(), touch.end(), inside);
  const auto length = std::max<std::ptrdiff_t>(1, std::lround(rate_hardness_time * rate));
  if (contact == touch.begin() || touch.end() - contact <= length || !(contact->velocity < 0.0)) return 0.0;
  if (!std::all_of(contact, contact + length, inside)) return 0.0;
  const double rise = contact[length - 1].force - contact[-1].force;
  return rise * rate / static_cast<double>(length) / -contact->velocity;
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
    if (!touched && n > 0) price.work += touch[n - 1].force * (touch[n - 1].position - touch[n].position);
  }
  price.rate_hardness = rate_hardness(touch, setup.wall.tick_rate);
  price.field_at_rest = field_at_rest(setup);
  return price;
}

}  // namespace kmax::experiment
