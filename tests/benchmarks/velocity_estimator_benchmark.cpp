// Velocity estimators: what each one costs and how far it is from the true velocity.
//   velocity_estimator_benchmark [--csv FILE] [--picture FILE.svg]
// The picture is drawn by gnuplot. Exit code 1 when a file cannot be written or gnuplot fails, 2 on wrong
// usage.

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <numbers>
#include <string>
#include <vector>

#include "control/velocity_estimator.hpp"

namespace {

using namespace kmax::control;

struct Motion {
  double position;  // m
  double velocity;  // m/s
};

constexpr double ramp_speed =
    0.01037;  // no simple fraction of a quantum per sample: those hide the noise of a filter
constexpr double sine_amplitude = 0.005;
constexpr double sine_frequency = 2.0;
constexpr double impact_speed = 0.200;
constexpr double impact_mass = 0.045;
constexpr double impact_stiffness = 8000.0;
constexpr double impact_flight = 0.0437;  // s between two contacts; no whole number of samples at either rate
constexpr double bandwidth = 100.0;
constexpr std::int32_t window = 16;

Motion ramp(double time) {
  return {ramp_speed * time, ramp_speed};
}

Motion sine(double time) {
  const double omega = 2.0 * std::numbers::pi * sine_frequency;
  return {sine_amplitude * std::sin(omega * time), sine_amplitude * omega * std::cos(omega * time)};
}

// Free flight, half a period of a mass on a spring, free flight back, the same on the other side.
Motion impact(double time) {
  const double omega = std::sqrt(impact_stiffness / impact_mass);
  const double contact = std::numbers::pi / omega;
  const double half = impact_flight + contact;
  const double cycles = std::floor(time / half);
  const double side = std::fmod(cycles, 2.0) == 0.0 ? 1.0 : -1.0;
  const double since = time - cycles * half;
  const double wall = 0.5 * impact_speed * impact_flight;
  if (since < impact_flight) return {side * (impact_speed * since - wall), side * impact_speed};
  const double phase = omega * (since - impact_flight);
  return {side * (wall + impact_speed / omega * std::sin(phase)), side * impact_speed * std::cos(phase)};
}

struct Signal {
  const char* name;
  Motion (*motion)(double);
};
struct Estimator {
  const char* name;
  VelocityEstimatorKind kind;
  const char* colour;  // Okabe and Ito's palette
};
struct Row {
  const char* estimator;
  const char* signal;
  double quantum;
  double rate;
  double nanoseconds;
  double error;  // mm/s, root mean square
};

constexpr std::array<Signal, 3> signals = {{{"slow ramp", ramp}, {"sine", sine}, {"impact", impact}}};
constexpr std::array<Estimator, 5> estimators = {
    {{"difference", VelocityEstimatorKind::difference, "#000000"},
     {"low pass", VelocityEstimatorKind::low_pass, "#E69F00"},
     {"FOAW best-fit", VelocityEstimatorKind::foaw, "#0072B2"},
     {"FOAW end-fit", VelocityEstimatorKind::foaw_end_fit, "#56B4E9"},
     {"tracking", VelocityEstimatorKind::tracking, "#D55E00"}}};
constexpr std::array<double, 2> quanta = {55e-6, 1e-6};
constexpr std::array<double, 2> rates = {500.0, 20'000.0};

Row measure(const Estimator& estimator, const Signal& signal, double quantum, double rate) {
  const auto samples = static_cast<std::size_t>(4.0 * rate);
  const auto settled = static_cast<std::size_t>(0.2 * rate);
  std::vector<std::int64_t> counts(samples);
  std::vector<double> truth(samples);
  for (std::size_t k = 0; k < samples; ++k) {
    const Motion motion = signal.motion(static_cast<double>(k) / rate);
    counts[k] = static_cast<std::int64_t>(std::floor(motion.position / quantum));
    truth[k] = motion.velocity;
  }
  VelocityEstimatorConfig<float> config;
  config.kind = estimator.kind;
  config.window = window;
  config.bandwidth = static_cast<float>(bandwidth);
  const auto coefficients = VelocityEstimator<float>::prepare(config, static_cast<float>(1.0 / rate),
                                                              static_cast<float>(quantum), 1);
  std::vector<float> estimates(samples);
  std::vector<double> times;
  const std::size_t passes = 1 + 200'000 / samples;
  for (int repetition = 0; repetition < 9; ++repetition) {
    const auto start = std::chrono::steady_clock::now();
    for (std::size_t pass = 0; pass < passes; ++pass) {
      VelocityEstimator<float> velocity;
      velocity.reset(counts[0]);
      for (std::size_t k = 0; k < samples; ++k) estimates[k] = velocity.update(coefficients, counts[k]);
    }
    const std::chrono::duration<double, std::nano> elapsed = std::chrono::steady_clock::now() - start;
    times.push_back(elapsed.count() / static_cast<double>(passes * samples));
  }
  std::nth_element(times.begin(), times.begin() + 4, times.end());
  double square = 0.0;
  for (std::size_t k = settled; k < samples; ++k) {
    const double error = static_cast<double>(estimates[k]) - truth[k];
    square += error * error;
  }
  return {estimator.name, signal.name, quantum,
          rate,           times[4],    1e3 * std::sqrt(square / static_cast<double>(samples - settled))};
}

void print(const std::vector<Row>& rows) {
  std::printf(
      "Velocity estimators, float, one VelocityEstimator::update per sample; median of 9 repetitions on this "
      "computer.\n"
      "Settings: FOAW window %d intervals, band +-1 quantum; low pass and tracking %g Hz.\n"
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

bool draw(const std::vector<Row>& rows, const std::string& path) {
  if (path.find_first_of("'\n\\") != std::string::npos) {
    std::fprintf(stderr, "--picture %s: quotes, backslashes and line ends are not allowed in the path\n",
                 path.c_str());
    return false;
  }
  if (std::system("command -v gnuplot > /dev/null") != 0) {
    std::fprintf(
        stderr,
        "--picture %s: gnuplot was not found; install it (Debian: gnuplot-nox) or leave out --picture\n",
        path.c_str());
    return false;
  }
  std::FILE* const pipe = popen("gnuplot", "w");
  if (pipe == nullptr) {
    std::fprintf(stderr, "--picture %s: gnuplot could not be started\n", path.c_str());
    return false;
  }
  const std::string script = gnuplot_script(rows, path);
  const bool written = std::fwrite(script.data(), 1, script.size(), pipe) == script.size();
  if (pclose(pipe) != 0 || !written) {
    std::fprintf(stderr, "--picture %s: gnuplot failed (its message is above); is the folder writable?\n",
                 path.c_str());
    return false;
  }
  return true;
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
  std::vector<Row> rows;
  for (const Signal& signal : signals) {
    for (const double quantum : quanta) {
      for (const double rate : rates) {
        for (const Estimator& estimator : estimators)
          rows.push_back(measure(estimator, signal, quantum, rate));
      }
    }
  }
  print(rows);
  if (!csv.empty() && !write_csv(rows, csv)) return 1;
  if (!picture.empty() && !draw(rows, picture)) return 1;
  return 0;
}
