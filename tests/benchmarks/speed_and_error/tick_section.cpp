#include <fmt/format.h>

#include <array>
#include <cmath>
#include <cstdint>
#include <string>
#include <vector>

#include "control/haptic_loop.hpp"
#include "host_tools/plot/figure.hpp"
#include "host_tools/simulation/coupled_handle.hpp"
#include "tests/benchmarks/speed_and_error/measurement.hpp"
#include "tests/benchmarks/speed_and_error/sections.hpp"

namespace kmax::benchmark {
namespace {

using control::HapticLoop;
using control::HapticLoopConfig;
using control::VelocityEstimatorKind;
using control::WallKind;

constexpr double rate = 20'000.0;      // Hz
constexpr double count_length = 1e-6;  // m
constexpr double contact_time = 1.0;   // s

struct Setting {
  const char* law;
  WallKind kind;
  const char* estimator;
  VelocityEstimatorKind velocity;
  double damping;        // N s/m
  double wall_position;  // m
};

template <typename Scalar>
HapticLoopConfig<Scalar> config_of(const Setting& setting) {
  HapticLoopConfig<Scalar> config;
  config.count_length = count_length;
  config.wall_position = setting.wall_position;
  config.tick_rate = rate;
  config.velocity.kind = setting.velocity;
  config.wall.kind = setting.kind;
  config.wall.stiffness = Scalar(5500);
  config.wall.damping = static_cast<Scalar>(setting.damping);
  config.force.limit = Scalar(3.3F);
  config.force.ramp_time = Scalar(0);
  return config;
}

// Counts of a contact in closed loop with the loop in float.
std::vector<std::int64_t> recorded_contact(const Setting& setting) {
  simulation::IntendedMotionConfig motion;
  motion.start_position = 0.01;
  motion.hold_time = 100.0;
  simulation::CoupledHandle handle(simulation::DeviceModel{}, simulation::OperatorModel{}, motion);
  handle.begin_motion();
  const auto origin = static_cast<std::int64_t>(std::lround(setting.wall_position / count_length));
  std::vector<std::int64_t> counts;
  const auto coefficients = HapticLoop<float>::prepare(config_of<float>(setting), origin);
  HapticLoop<float> loop;
  for (int n = 0; n < static_cast<int>(contact_time * rate); ++n) {
    counts.push_back(origin + static_cast<std::int64_t>(std::floor(handle.position() / count_length)));
    const auto& out = loop.tick(coefficients, counts.back(), true);
    handle.advance(static_cast<double>(out.force), static_cast<double>(out.magnetic_force), 1.0 / rate);
  }
  return counts;
}

template <typename Scalar>
struct Replayed {
  std::vector<double> force;  // N
  double nanoseconds = 0.0;
};

template <typename Scalar>
Replayed<Scalar> replay(const Setting& setting, const std::vector<std::int64_t>& counts) {
  const auto coefficients = HapticLoop<Scalar>::prepare(config_of<Scalar>(setting), counts.front());
  Replayed<Scalar> replayed;
  replayed.force.resize(counts.size());
  const double seconds = best_processor_time(15, [&] {
    HapticLoop<Scalar> loop;
    for (std::size_t n = 0; n < counts.size(); ++n)
      replayed.force[n] = static_cast<double>(loop.tick(coefficients, counts[n], true).force);
    keep(replayed.force.back());
  });
  replayed.nanoseconds = 1e9 * seconds / static_cast<double>(counts.size());
  return replayed;
}

// The largest difference in every 5 ms.
plot::Series curve_of(const std::string& label, const std::vector<double>& a, const std::vector<double>& b) {
  plot::Series series{label, {}, {}, false, false};
  constexpr std::size_t bin = 100;
  for (std::size_t first = 0; first + bin <= a.size(); first += bin) {
    double largest = 0.0;
    for (std::size_t n = first; n < first + bin; ++n) largest = std::max(largest, std::abs(a[n] - b[n]));
    series.x.push_back(static_cast<double>(first) / rate);
    series.y.push_back(largest);
  }
  return series;
}

}  // namespace

double native_haptic_tick() {
  const Setting setting{"adaptive", WallKind::adaptive, "FOAW", VelocityEstimatorKind::foaw, 0.0, 0.0};
  return replay<float>(setting, recorded_contact(setting)).nanoseconds;
}

report::Section tick_section(const std::filesystem::path& pictures) {
  constexpr std::array settings{
      Setting{"plain", WallKind::plain, "FOAW", VelocityEstimatorKind::foaw, 0.0, 0.0},
      Setting{"magnetic", WallKind::magnetic, "FOAW", VelocityEstimatorKind::foaw, 0.0, 0.0},
      Setting{"adaptive", WallKind::adaptive, "FOAW", VelocityEstimatorKind::foaw, 0.0, 0.0},
      Setting{"adaptive", WallKind::adaptive, "FOAW, B = 2 N s/m", VelocityEstimatorKind::foaw, 2.0, 0.0},
      Setting{"adaptive", WallKind::adaptive, "difference", VelocityEstimatorKind::difference, 0.0, 0.0},
      Setting{"adaptive", WallKind::adaptive, "low pass", VelocityEstimatorKind::low_pass, 0.0, 0.0},
      Setting{"adaptive", WallKind::adaptive, "tracking", VelocityEstimatorKind::tracking, 0.0, 0.0},
      Setting{"adaptive", WallKind::adaptive, "tracking, wall at 10 m", VelocityEstimatorKind::tracking, 0.0,
              10.0}};
  report::Section section;
  section.heading = "Float against double in the whole haptic tick";
  section.paragraphs = {
      "Compared: control::HapticLoop<float>, the firmware's, with control::HapticLoop<double>, the same "
      "source, on the same encoder counts: a contact of 1 s recorded in closed loop at 20 kHz (1 um per "
      "count, K = 5.5 N/mm, the default device and person, force limit 3.3 N). Against: the double. Time: "
      "one tick on this computer, best of 15; the Cortex-M4F has no double at all.",
      "Positions are whole counts up to the distance from the wall, so a wall 10 m away loses nothing."};
  report::Table table{"",
                      {"wall law", "velocity", "largest force (N)", "largest difference (N)",
                       "RMS difference (N)", "float (ns)", "double (ns)"},
                      {}};
  plot::Figure figure;
  figure.title = "Haptic tick: force in float less force in double, largest in 5 ms";
  figure.x_label = "time (s)";
  figure.legend_beside = true;
  figure.panels = {{"difference (N)", {}, {}, std::nullopt, true}};
  for (const Setting& setting : settings) {
    const std::vector<std::int64_t> counts = recorded_contact(setting);
    const auto in_float = replay<float>(setting, counts);
    const auto in_double = replay<double>(setting, counts);
    ErrorStatistics difference, force;
    for (std::size_t n = 0; n < counts.size(); ++n) {
      difference.add(in_float.force[n] - in_double.force[n]);
      force.add(in_double.force[n]);
    }
    table.rows.push_back(
        {setting.law, setting.estimator, fmt::format("{:.2f}", force.largest()),
         fmt::format("{:.2g}", difference.largest()), fmt::format("{:.2g}", difference.root_mean_square()),
         fmt::format("{:.1f}", in_float.nanoseconds), fmt::format("{:.1f}", in_double.nanoseconds)});
    if (setting.damping == 0.0 && setting.wall_position == 0.0)
      figure.panels[0].series.push_back(
          curve_of(fmt::format("{}, {}", setting.law, setting.estimator), in_float.force, in_double.force));
  }
  plot::write_figure(figure, pictures / "speed_tick.svg");
  section.tables = {table};
  section.pictures = {{figure.title, pictures / "speed_tick.svg"}};
  return section;
}

}  // namespace kmax::benchmark
