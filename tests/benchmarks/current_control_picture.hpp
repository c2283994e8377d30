#pragma once

#include <cstddef>
#include <cstdio>
#include <string>
#include <vector>

// Draws docs/pictures/current_control.svg with gnuplot.
namespace kmax::benchmark {

struct BandwidthPoint {
  double asked, measured, before;  // Hz
};
struct SinePoint {
  const char* name;
  int instructions;
  double error;
};
struct CurrentTraces {
  std::vector<double> without, with;  // A, one sample per tick from a zero of the reference on
  double amplitude = 0.0, frequency = 0.0;
};

inline std::string line(double x, double y) {
  return std::to_string(x) + " " + std::to_string(y) + "\n";
}

inline std::string current_control_script(const std::vector<BandwidthPoint>& bandwidth,
                                          const CurrentTraces& traces, const std::vector<SinePoint>& sines,
                                          const std::string& path) {
  std::string script =
      "set terminal svg size 1500,500 font 'sans,13' background rgb 'white'\n"
      "set output '" +
      path +
      "'\n"
      "set multiplot layout 1,3 margins 0.055,0.985,0.13,0.9 spacing 0.07,0\n"
      "set grid lc rgb '#dddddd'\nset key top left Left reverse samplen 2\n"
      "set title '-3 dB frequency, L/R 33 ticks'\nset xlabel 'asked for (Hz)'\nset ylabel 'measured (Hz)'\n"
      "set xrange [0:2700]\nset yrange [0:3700]\n"
      "plot x with lines lc rgb '#999999' dt 2 title 'as asked for', '-' using 1:2 with linespoints pt 7 ps "
      "0.8 lw 2 lc rgb '#0072B2' title 'quadratic for g, with the delay', '-' using 1:2 with linespoints pt "
      "5 ps 0.7 lw 2 lc rgb '#D55E00' title 'pole placement without it'\n";
  for (const BandwidthPoint& point : bandwidth) script += line(point.asked, point.measured);
  script += "e\n";
  for (const BandwidthPoint& point : bandwidth) script += line(point.asked, point.before);
  script +=
      "e\nset title 'phase current, 500 ns of dead time, 0.25 A'\nset xlabel 'time (ms)'\n"
      "set ylabel 'current (A)'\nset xrange [0:20]\nset yrange [-0.3:0.42]\n"
      "plot '-' using 1:2 with lines lw 2 lc rgb '#D55E00' title 'without compensation', "
      "'-' using 1:2 with lines lw 2 lc rgb '#0072B2' title 'with: from the reference'\n";
  for (const auto* currents : {&traces.without, &traces.with}) {
    const auto period = static_cast<std::size_t>(20000.0 / traces.frequency);
    for (std::size_t k = 0; k <= period && k < currents->size(); ++k)
      script += line(0.05 * static_cast<double>(k), (*currents)[k]);
    script += "e\n";
  }
  script +=
      "set title 'sine and cosine: error against cost'\nset xlabel 'instructions, Cortex-M4F'\n"
      "set ylabel 'largest error' offset 1\nset logscale y\nset format y '10^{%L}'\n"
      "set xrange [0:72]\nset yrange [1e-8:1e-1]\nunset key\n"
      "plot '-' using 1:2:3 with labels left offset 0.8,0.5 font ',12', "
      "'-' using 1:2 with points pt 7 ps 1.2 lc rgb '#0072B2'\n";
  for (int pass = 0; pass < 2; ++pass) {
    for (const SinePoint& sine : sines) {
      char text[96];
      std::snprintf(text, sizeof text, "%d %.3e \"%s\"\n", sine.instructions, sine.error, sine.name);
      script += text;
    }
    script += "e\n";
  }
  return script + "unset multiplot\n";
}

}  // namespace kmax::benchmark
