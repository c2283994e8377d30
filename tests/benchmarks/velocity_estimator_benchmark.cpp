// Velocity estimators: what each one costs and how far it is from the true velocity.
//   velocity_estimator_benchmark [--csv FILE] [--picture FILE.svg]
// The picture is drawn by gnuplot. Exit code 1 when a file cannot be written or gnuplot fails, 2 on wrong
// usage.

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <fstream>
#include <numbers>
#include <string>
#include <vector>

#include "tests/benchmarks/gnuplot_pipe.hpp"
#include "tests/benchmarks/velocity_estimator_measurement.hpp"

namespace {

using namespace kmax::benchmark::velocity;

void print(const std::vector<Row>& rows) {
  std::printf(
      "Velocity estimators, float, one VelocityEstimator::update per sample; best of 9 repetitions on this "
      "computer.\n"
      "Settings: FOAW window %d intervals, band +-1 quantum, beyond 10 kHz of every second sample;\n"
      "low pass and tracking %g Hz.\n"
      "Signals, 4 s each, floor-quantized; the error is against the analytic velocity at the sampling "
      "instant,\n"
      "so it contains both the noise and the delay; the first 0.2 s are left out:\n"
      "  slow ramp  %g mm/s constant\n"
      "  sine       %g mm at %g Hz (peak %.1f mm/s)\n"
      "  impact     %g g at %g mm/s between two walls of %g N/mm: flight %.1f ms, contact %.2f ms, ideal "
      "rebound\n\n",
      window, bandwidth, 1e3 * ramp_speed, 1e3 * sine_amplitude, sine_frequency,
      2e3 * std::numbers::pi * sine_frequency * sine_amplitude, 1e3 * impact_mass, 1e3 * impact_speed,
      1e-3 * impact_stiffness, 1e3 * impact_flight,
      1e3 * std::numbers::pi / std::sqrt(impact_stiffness / impact_mass));
  std::printf("%-10s %12s %9s  %-14s %14s %18s\n", "signal", "quantum, um", "rate, Hz", "estimator",
              "time, ns/sample", "RMS error, mm/s");
  const Row* previous = nullptr;
  for (const Row& row : rows) {
    if (previous != nullptr && (previous->rate != row.rate || previous->quantum != row.quantum))
      std::printf("\n");
    std::printf("%-10s %12g %9g  %-14s %14.2f %18.4f\n", row.signal, 1e6 * row.quantum, row.rate,
                row.estimator, row.nanoseconds, row.error);
    previous = &row;
  }
}

bool write_csv(const std::vector<Row>& rows, const std::string& path) {
  std::ofstream file(path);
  file << "signal,quantum_m,rate_hz,estimator,time_ns,rms_error_mm_per_s\n";
  for (const Row& row : rows) {
    file << row.signal << ',' << row.quantum << ',' << row.rate << ',' << row.estimator << ','
         << row.nanoseconds << ',' << row.error << '\n';
  }
  file.flush();
  if (!file)
    std::fprintf(stderr, "--csv %s: cannot be written; give a path in an existing, writable folder\n",
                 path.c_str());
  return static_cast<bool>(file);
}

// One panel per signal; colour tells the estimator, shape the quantum and filling the rate.
std::string gnuplot_script(const std::vector<Row>& rows, const std::string& path) {
  double fastest = rows.front().nanoseconds;
  double slowest = fastest;
  for (const Row& row : rows) {
    fastest = std::min(fastest, row.nanoseconds);
    slowest = std::max(slowest, row.nanoseconds);
  }
  std::string script = "set terminal svg size 1320,480 font 'sans,13' background 'white'\nset output '" +
                       path +
                       "'\nset logscale xy\nset grid lc rgb '#dddddd'\nset format y '10^{%L}'\nset xtics "
                       "(1,2,5,10,20,50,100,200,500)\n"
                       "set xlabel 'time per sample (ns, this computer)'\nset yrange [0.001:1000]\n"
                       "set multiplot layout 1,3 margins 0.06,0.84,0.14,0.92 spacing 0.035\nunset key\n";
  script += "set xrange [" + std::to_string(fastest / 1.5) + ":" + std::to_string(slowest * 1.5) + "]\n";
  constexpr std::array<std::array<int, 2>, 2> shapes = {{{4, 5}, {6, 7}}};  // [quantum][rate]
  for (std::size_t s = 0; s < signals.size(); ++s) {
    script += std::string("set title '") + signals[s].name + "'\n";
    script += s == 0 ? "set ylabel 'RMS velocity error (mm/s)'\n" : "unset ylabel\n";
    if (s == 2)
      script += "set key at screen 0.99,0.9 right top vertical Left reverse samplen 1 spacing 1.4\n";
    std::string plot;
    std::string data;
    for (std::size_t e = 0; e < estimators.size(); ++e) {
      for (std::size_t q = 0; q < quanta.size(); ++q) {
        for (std::size_t r = 0; r < rates.size(); ++r) {
          plot += std::string(plot.empty() ? "plot " : ", ") + "'-' using 1:2 with points pt " +
                  std::to_string(shapes[q][r]) + " ps 1.2 lw 2 lc rgb '" + estimators[e].colour + "' notitle";
          for (const Row& row : rows) {
            if (row.signal == signals[s].name && row.estimator == estimators[e].name &&
                row.quantum == quanta[q] && row.rate == rates[r]) {
              data += std::to_string(row.nanoseconds) + " " + std::to_string(row.error) + "\n";
            }
          }
          data += "e\n";
        }
      }
    }
    for (const Estimator& estimator : estimators) {
      plot += std::string(", NaN with points pt 7 ps 1.2 lc rgb '") + estimator.colour + "' title '" +
              estimator.name + "'";
    }
    for (std::size_t q = 0; q < quanta.size(); ++q) {
      for (std::size_t r = 0; r < rates.size(); ++r) {
        std::array<char, 64> title{};
        std::snprintf(title.data(), title.size(), "%g um, %g Hz", 1e6 * quanta[q], rates[r]);
        plot += ", NaN with points pt " + std::to_string(shapes[q][r]) +
                " ps 1.2 lw 2 lc rgb '#666666' title '" + title.data() + "'";
      }
    }
    script += plot + "\n" + data;
  }
  return script + "unset multiplot\n";
}

}  // namespace

int main(int argc, char** argv) {
  std::string csv;
  std::string picture;
  for (int i = 1; i < argc; ++i) {
    const bool has_value = i + 1 < argc;
    if (std::strcmp(argv[i], "--csv") == 0 && has_value) {
      csv = argv[++i];
    } else if (std::strcmp(argv[i], "--picture") == 0 && has_value) {
      picture = argv[++i];
    } else {
      std::fprintf(
          stderr,
          "%s: not understood; usage: velocity_estimator_benchmark [--csv FILE] [--picture FILE.svg]\n",
          argv[i]);
      return 2;
    }
  }
  const std::vector<Row> rows = measure_all();
  print(rows);
  if (!csv.empty() && !write_csv(rows, csv)) return 1;
  if (!picture.empty() && !kmax::benchmark::draw_by_gnuplot(gnuplot_script(rows, picture), picture)) return 1;
  return 0;
}
