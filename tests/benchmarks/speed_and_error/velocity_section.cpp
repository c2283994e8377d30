#include <fmt/format.h>

#include <string>

#include "host_tools/plot/figure.hpp"
#include "tests/benchmarks/speed_and_error/sections.hpp"
#include "tests/benchmarks/velocity_estimator_measurement.hpp"

namespace kmax::benchmark {

// Every combination of quantum and rate is in docs/velocity_estimators.md; here the coarse encoder at both
// rates and the fine one at the higher.
report::Section velocity_section(const std::filesystem::path& pictures) {
  report::Section section;
  section.heading = "Velocity estimators";
  section.paragraphs = {fmt::format(
      "Compared: the six estimators of control/velocity_estimator.hpp in float, one update per sample, "
      "FOAW with a window of {} intervals, beyond 10 kHz of every second sample, low pass and tracking at "
      "{:g} Hz. Against: the analytic velocity of the motion at the sampling instant, so the error "
      "contains noise and delay. Motions of 4 s: a ramp of {:g} mm/s, a sine of {:g} mm at {:g} Hz, and a "
      "mass of {:g} g that bounces at {:g} mm/s between two walls of {:g} N/mm; positions rounded down to "
      "whole quanta. Time: processor time per update, best of 9, on this computer. The combinations left "
      "out here are in velocity_estimators.md.",
      velocity::window, velocity::bandwidth, 1e3 * velocity::ramp_speed, 1e3 * velocity::sine_amplitude,
      velocity::sine_frequency, 1e3 * velocity::impact_mass, 1e3 * velocity::impact_speed,
      1e-3 * velocity::impact_stiffness)};
  report::Table table{"", {"quantum (um)", "rate (Hz)", "estimator", "time (ns)"}, {}};
  for (const velocity::Signal& signal : velocity::signals)
    table.columns.push_back(fmt::format("{}, RMS error (mm/s)", signal.name));

  const std::vector<velocity::Row> rows = velocity::measure_all();
  const auto row_of = [&](const velocity::Signal& signal, const velocity::Estimator& estimator,
                          double quantum, double rate) {
    for (const velocity::Row& row : rows) {
      if (row.signal == signal.name && row.estimator == estimator.name && row.quantum == quantum &&
          row.rate == rate)
        return row;
    }
    return velocity::Row{};
  };

  plot::Figure figure;
  figure.x_label = "time per update (ns)";
  figure.log_x = figure.legend_beside = true;
  for (const velocity::Signal& signal : velocity::signals)
    figure.panels.push_back({fmt::format("{} (mm/s)", signal.name), {}, {}, std::nullopt, true});

  for (const auto& [quantum, rate] :
       {std::pair(55e-6, 500.0), std::pair(55e-6, 20'000.0), std::pair(1e-6, 20'000.0)}) {
    for (const velocity::Estimator& estimator : velocity::estimators) {
      std::vector<std::string> cells{fmt::format("{:g}", 1e6 * quantum), fmt::format("{:g}", rate),
                                     estimator.name};
      double nanoseconds = 0.0;
      for (const velocity::Signal& signal : velocity::signals) {
        const velocity::Row row = row_of(signal, estimator, quantum, rate);
        nanoseconds = std::max(nanoseconds, row.nanoseconds);
      }
      cells.push_back(fmt::format("{:.1f}", nanoseconds));
      for (const velocity::Signal& signal : velocity::signals)
        cells.push_back(fmt::format("{:.3g}", row_of(signal, estimator, quantum, rate).error));
      table.rows.push_back(cells);
    }
  }
  for (std::size_t panel = 0; panel < velocity::signals.size(); ++panel) {
    for (const velocity::Estimator& estimator : velocity::estimators) {
      plot::Series series{estimator.name, {}, {}, false, true};
      for (const double quantum : velocity::quanta) {
        const velocity::Row row = row_of(velocity::signals[panel], estimator, quantum, 20'000.0);
        series.x.push_back(row.nanoseconds);
        series.y.push_back(row.error);
      }
      figure.panels[panel].series.push_back(series);
    }
  }
  figure.title = "Velocity estimators at 20 kHz: upper mark 55 um, lower mark 1 um";
  plot::write_figure(figure, pictures / "speed_velocity_estimators.svg");
  section.tables = {table};
  section.pictures = {{figure.title, pictures / "speed_velocity_estimators.svg"}};
  return section;
}

}  // namespace kmax::benchmark
