// Simulated seconds per second of one axis, and nanoseconds per interval, for the intervals of a 500 Hz
// controller and of a 20 kHz one; handle alone or held, sticking or sliding. Prints a table; decides nothing.

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <ctime>
#include <functional>

#include "host_tools/simulation/coupled_handle.hpp"

namespace {

using kmax::simulation::CoupledHandle;
using kmax::simulation::DeviceModel;
using kmax::simulation::IntendedMotionConfig;
using kmax::simulation::OperatorModel;

double processor_time() {
  timespec now{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

void measure(const char* name, double interval, const std::function<CoupledHandle()>& make,
             double (*force)(const CoupledHandle&, long sample), double background) {
  double best = 1e9;
  double sliding = 0.0;
  constexpr long intervals = 200'000;
  for (int repeat = 0; repeat < 9; ++repeat) {
    CoupledHandle handle = make();
    if (handle.has_operator()) handle.begin_motion();
    for (double t = 0.0; t < 1.0; t += interval) handle.advance(force(handle, 0), background, interval);
    long moving = 0;
    const double begin = processor_time();
    for (long n = 0; n < intervals; ++n) {
      handle.advance(force(handle, n), background, interval);
      moving += handle.sticking() ? 0 : 1;
    }
    best = std::min(best, processor_time() - begin);
    sliding = static_cast<double>(moving) / intervals;
  }
  fmt::print("{:<34} {:>8.0f} us {:>9.1f} ns/interval {:>10.0f} simulated s/s  sliding {:>4.0f} %\n", name,
             interval * 1e6, best / intervals * 1e9, intervals * interval / best, sliding * 100.0);
}

CoupledHandle held(double friction) {
  DeviceModel device;
  device.friction = friction;
  IntendedMotionConfig motion;
  motion.hold_time = 1e5;
  return CoupledHandle(device, OperatorModel{}, motion);
}

}  // namespace

int main() {
  const auto wall = [](const CoupledHandle& handle, long) {
    return std::max(0.0, -5500.0 * handle.position());
  };
  const auto none = [](const CoupledHandle&, long) { return 0.0; };
  const auto swing = [](const CoupledHandle&, long n) { return (n / 64) % 2 == 0 ? 1.0 : -1.0; };
  for (const double interval : {0.002, 50e-6}) {
    measure(
        "held, sticking", interval, [] { return held(100.0); }, none, 0.0);
    measure(
        "held, sticking, field of 2 N", interval, [] { return held(100.0); }, none, 2.0);
    measure(
        "held, sliding without friction", interval, [] { return held(0.0); }, swing, 0.0);
    measure(
        "held, sliding with friction", interval, [] { return held(0.093); }, swing, 0.0);
    measure(
        "held, wall of 5.5 N/mm", interval, [] { return held(0.093); }, wall, 0.0);
    measure(
        "alone, sticking", interval, [] { return CoupledHandle(DeviceModel{}); }, none, 0.0);
    measure(
        "alone, sliding", interval, [] { return CoupledHandle(DeviceModel{}); }, swing, 0.0);
  }
}
